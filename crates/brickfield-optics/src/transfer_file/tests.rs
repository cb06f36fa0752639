//! Files round trip, opacities are converted once, and errors name the line.

use std::fs;

use super::*;
use brickfield_core::Knot;
use proptest::prelude::*;

const BOTH: [TransferFormat; 2] = [TransferFormat::Json, TransferFormat::Toml];

fn knot(value: f64, extinction: f64, color: [f64; 3]) -> Knot {
    Knot { value, extinction, color }
}

#[test]
fn opacities_of_a_reference_length_become_extinction() {
    let json = r##"{"reference_length": 2.0, "knots": [
        {"value": 0, "opacity": 0, "srgb": "#000000"},
        {"value": 1, "opacity": 0.75, "srgb": "#ffffff"}]}"##;
    let toml = "reference_length = 2\nknots = [{ value = 0, opacity = 0, color = [0, 0, 0] },\n\
                { value = 1, opacity = 0.75, color = [1, 1, 1] }]";
    for (text, format) in [json, toml].into_iter().zip(BOTH) {
        let tf = parse_transfer(text, format).unwrap();
        assert_eq!(TransferFormat::of_text(text), format);
        assert_eq!(tf.knots()[0], knot(0.0, 0.0, [0.0; 3]));
        assert!((tf.knots()[1].extinction - 2f64.ln()).abs() < 1e-15, "1 - e^(-2 ln 2) = 3/4");
    }
}

#[test]
fn toml_tables_are_knots_too() {
    let text = "[[knots]]\nvalue = 3.0\nextinction = 0.5\ncolor = [0.1, 0.2, 0.3]\n";
    let tf = parse_transfer(text, TransferFormat::Toml).unwrap();
    assert_eq!(tf.knots(), [knot(3.0, 0.5, [0.1, 0.2, 0.3])]);
}

#[test]
fn errors_name_line_and_thing() {
    let of = |knots: &str, format| parse_transfer(knots, format).unwrap_err().to_string();
    let json = |knot: &str| of(&format!("{{\n \"knots\": [\n  {knot}\n ]\n}}"), TransferFormat::Json);
    let toml = |knot: &str| of(&format!("knots = [\n\n  {{ {knot} }}\n]"), TransferFormat::Toml);
    for (problem, message) in [
        (json(r#"{"value": 1, "color": [0, 0, 0]}"#), "line 3: knot 0 has neither `extinction` nor `opacity`"),
        (toml("value = 1, color = [0, 0, 0]"), "line 3: knot 0 has neither `extinction` nor `opacity`"),
        (toml("value = 1, opacity = 0.5, color = [0, 0, 0]"), "`reference_length`"),
        (json(r#"{"value": 1, "extinction": -1, "color": [0, 0, 0]}"#), "line 3: knot 0: extinction is -1"),
        (toml("value = 1, extinction = 1, color = [0, 2, 0]"), "line 3: knot 0: colour channel 1 is 2"),
        (json(r#"{"value": 1, "extinction": 1, "srgb": "red"}"#), "line 3: knot 0 has srgb \"red\""),
        (json(r#"{"value": 1, "extinction": 1, "colour": [0, 0, 0]}"#), "line 3, column 40: unknown field `colour`"),
        (toml("value = 1, extinction = 1, colour = [0, 0, 0]"), "line 3, column 32: unknown field `colour`"),
        (json(r#"{"value": }"#), "line 3, column 13: expected value"),
        (toml("value = "), "line 3, column"),
    ] {
        assert!(problem.contains(message), "{problem:?} does not contain {message:?}");
    }
}

#[test]
fn errors_of_the_whole_are_named() {
    let of = |text: &str| parse_transfer(text, TransferFormat::Toml).unwrap_err().to_string();
    assert!(of("").contains("at least one knot"));
    assert!(of("\nreference_length = -1").contains("line 2: reference_length is -1"));
    let falling = "[[knots]]\nvalue = 1\nextinction = 1\nsrgb = \"#000000\"\n\
                   [[knots]]\nvalue = 0\nextinction = 1\nsrgb = \"#000000\"\n";
    assert_eq!(of(falling), "line 5: knot 1: value 0 comes after 1; values must not fall");
}

#[test]
fn a_missing_file_is_named() {
    let error = read_transfer(Path::new("no/such.json")).unwrap_err().to_string();
    assert!(error.contains("no/such.json"), "{error}");
}

#[test]
fn files_appear_whole_and_replace_what_was_there() {
    let dir = std::env::temp_dir().join(format!("brickfield-transfer-{}", std::process::id()));
    fs::create_dir_all(&dir).unwrap();
    for name in ["a.json", "b.TOML"] {
        for extinction in [1.0, 0.1] {
            let tf = TransferFunction::new(vec![knot(-1e-7, extinction, [0.1, 0.2, 1.0 / 3.0])]).unwrap();
            write_transfer(&dir.join(name), &tf).unwrap();
            assert_eq!(read_transfer(&dir.join(name)).unwrap(), tf);
        }
    }
    assert_eq!(fs::read_dir(&dir).unwrap().count(), 2, "nothing is left beside the files");
    fs::remove_dir_all(&dir).unwrap();
    let tf = TransferFunction::constant(1.0, [0.0; 3]).unwrap();
    assert!(write_transfer(&dir.join("c.txt"), &tf).unwrap_err().to_string().contains("c.txt"));
    assert!(write_transfer(&dir.join("c.json"), &tf).unwrap_err().to_string().contains("c.json"));
}

proptest! {
    #[test]
    fn every_number_round_trips(
        numbers in prop::collection::vec((any::<f64>(), 0.0..1e30f64, prop::array::uniform3(0.0..=1.0f64)), 1..6),
    ) {
        let mut knots: Vec<Knot> = numbers.into_iter().map(|(v, e, c)| knot(v, e, c)).collect();
        knots.retain(|k| k.value.is_finite());
        knots.sort_by(|a, b| a.value.total_cmp(&b.value));
        knots.dedup_by_key(|k| k.value);
        prop_assume!(!knots.is_empty());
        let tf = TransferFunction::new(knots).unwrap();
        for format in BOTH {
            prop_assert_eq!(&parse_transfer(&format.text(&tf), format).unwrap(), &tf);
        }
    }

    #[test]
    fn no_text_panics(text in any::<String>()) {
        for format in BOTH {
            let _ = parse_transfer(&text, format);
        }
    }
}
