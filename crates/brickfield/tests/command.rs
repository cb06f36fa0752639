//! The `brickfield` command as scripts see it: what it prints, writes and ends with.

#![cfg(feature = "cli")]

use std::io::Read;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use brickfield::core::glam::{DVec3, UVec3};
use brickfield::core::{Grid, Rescale, Volume};
use brickfield::io::{OpenOptions, SaveOptions, open, save};

/// A folder with a volume of 12 x 10 x 8 voxels, and the command run in it.
struct WorkFolder {
    folder: tempfile::TempDir,
}

impl WorkFolder {
    fn new() -> WorkFolder {
        let folder = tempfile::tempdir().unwrap();
        let grid = Grid::axis_aligned(UVec3::new(12, 10, 8), DVec3::new(1.0, 1.0, 4.22 + 6e-15)).unwrap();
        let volume = Volume::new(grid, (0..960).map(|i| (i % 251) as u8).collect::<Vec<_>>()).unwrap();
        save(&folder.path().join("a.nrrd"), &volume, &SaveOptions::default()).unwrap();
        WorkFolder { folder }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn command(&self, words: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickfield"));
        command.args(words.split('|')).current_dir(self.path());
        command
    }

    fn run(&self, words: &str) -> Output {
        self.command(words).output().unwrap()
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn info_says_what_the_file_holds() {
    let out = WorkFolder::new().run("info|a.nrrd");
    let said = text(&out.stdout);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    assert!(said.contains("12 x 10 x 8") && said.contains("1 x 1 x 4.22 units"), "{said}");
}

#[test]
fn scripts_read_json() {
    let out = WorkFolder::new().run("info|a.nrrd|--json|--spacing|2:2:3");
    let said: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(said["dimensions"], serde_json::json!([12, 10, 8]));
    assert_eq!((&said["type"], &said["values"]["max"]), (&"u8".into(), &250.0.into()));
    assert_eq!(said["spacing"], serde_json::json!([2.0, 2.0, 3.0]));
    assert_eq!(said["first_sample"], serde_json::json!([1.0, 1.0, 1.5]));
    assert_eq!(said["world"], serde_json::json!({ "min": [0.0, 0.0, 0.0], "max": [24.0, 20.0, 24.0] }));
    assert_eq!((&said["rendering"], &said["bricks"]["side"]), (&serde_json::json!([]), &32.into()));
    let level = serde_json::json!({
        "level": 0, "dimensions": [12, 10, 8], "bricks": 1, "stored_bytes": 32768, "shared_bytes": 0
    });
    assert_eq!(said["bricks"]["levels"], serde_json::json!([level]));
}

#[test]
#[cfg(feature = "formats")]
fn pack_makes_a_store_that_is_read_like_the_file() {
    let place = WorkFolder::new();
    let out = place.run("pack|a.nrrd|-o|a.zarr");
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    assert_eq!(text(&out.stdout), "a.zarr: 12 x 10 x 8 voxels of u8, levels 0 to 4\n");
    let [a, b] =
        ["a.nrrd", "a.zarr"].map(|name| open(&place.path().join(name), &OpenOptions::default()).unwrap().volume);
    assert_eq!(a.voxels(), b.voxels());
    // Once more it is refused, before any work, and with what is wrong of the file nothing is left.
    for (words, expected) in [
        (
            "pack|a.nrrd|-o|b.tif",
            "b.tif: a store is a folder of OME-Zarr; the end of the name is that of TIFF: take .zarr",
        ),
        ("pack|a.zarr|-o|a.zarr/b.zarr", "a.zarr/b.zarr: the store would lie inside of a.zarr, which is packed"),
    ] {
        let refused = place.run(words);
        assert_eq!(refused.status.code(), Some(2));
        assert!(text(&refused.stderr).contains(expected), "{}", text(&refused.stderr));
        assert!(!place.path().join("b.tif").exists() && !place.path().join("a.zarr/b.zarr").exists());
    }
    let again = place.run("pack|a.nrrd|-o|a.zarr");
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("a.zarr: there is one already"), "{}", text(&again.stderr));
    std::fs::write(place.path().join("short.raw"), [0; 10]).unwrap();
    let short = place.run("pack|short.raw|--raw|4x4x4,u8|-o|b.zarr");
    assert_eq!(short.status.code(), Some(1));
    assert!(
        text(&short.stderr).contains("short.raw: the file holds 10 bytes; 64 are promised"),
        "{}",
        text(&short.stderr)
    );
    assert!(!place.path().join("b.zarr").exists());
}

#[test]
fn rescaled_integers_take_the_bytes_of_integers() {
    let place = WorkFolder::new();
    let plain = open(&place.path().join("a.nrrd"), &OpenOptions::default()).unwrap().volume;
    let rescale = Rescale::new(0.5, -1024.0).unwrap();
    let volume = Volume::rescaled(*plain.grid(), plain.voxels().clone(), rescale).unwrap();
    save(&place.path().join("b.nii"), &volume, &SaveOptions::default()).unwrap();
    let said: serde_json::Value = serde_json::from_slice(&place.run("info|b.nii|--json").stdout).unwrap();
    assert_eq!((&said["type"], &said["bytes"]), (&"u8".into(), &960.into()));
    assert_eq!(said["values"], serde_json::json!({ "min": -1024.0, "max": -899.0 }));
    let out = place.run("convert|b.nii|-o|b.mha");
    assert_eq!(text(&out.stdout), "b.mha: 12 x 10 x 8 voxels of f32\n");
    assert!(text(&out.stderr).contains("note: MetaImage stores no slope and intercept"), "{}", text(&out.stderr));
    let bricks = |file: &str| {
        let out = place.run(&format!("render|{file}|-o|{file}.png|{SMALL}"));
        let said = text(&out.stdout);
        said.lines().find(|line| line.contains("bricks,")).map(str::to_owned).expect("a line about bricks")
    };
    // One byte a sample, in the atlas too.
    assert_eq!(bricks("b.nii"), bricks("a.nrrd"));
}

#[test]
fn a_volume_is_saved_in_another_format() {
    let place = WorkFolder::new();
    let original = open(&place.path().join("a.nrrd"), &OpenOptions::default()).unwrap();
    for name in ["b.mha", "b.nii.gz", "b.zarr", "b.nrrd"] {
        let out = place.run(&format!("convert|a.nrrd|-o|{name}"));
        assert_eq!(text(&out.stdout), format!("{name}: 12 x 10 x 8 voxels of u8\n"), "{}", text(&out.stderr));
        let saved = open(&place.path().join(name), &OpenOptions::default()).unwrap();
        assert_eq!(saved.volume.voxels(), original.volume.voxels(), "{name}");
    }
    for (out, part) in [
        ("b.tif", "b.tif: the end of the name is none of .nrrd"),
        ("no/b.nrrd", "no/b.nrrd: there is no folder no"),
        ("b.zarr", "b.zarr: there is one already, and a folder is not replaced; remove it, or take another name"),
    ] {
        // Before the input is looked for.
        let refused = place.run(&format!("convert|none.nrrd|-o|{out}"));
        assert_eq!(refused.status.code(), Some(2), "{out}");
        assert!(text(&refused.stderr).contains(part), "{}", text(&refused.stderr));
    }
    let refused = place.run("info|a.nrrd|--channel|2");
    assert!(text(&refused.stderr).contains("channel is \"2\"; expected 0"), "{}", text(&refused.stderr));
}

#[test]
fn a_picture_is_written_and_what_the_volume_lacks_is_said() {
    let place = WorkFolder::new();
    let out = place.run("render|a.nrrd|-o|a.png|--backend|cpu|--size|8x6|--lod|9|--clip|0:6,0:10,0:99|--step|1/4");
    let said = text(&out.stderr);
    assert_eq!(out.status.code(), Some(0), "{said}");
    assert!(said.contains("--lod 9: the volume has levels 0 to 0") && said.contains("--clip"), "{said}");
    assert_eq!(image::open(place.path().join("a.png")).unwrap().width(), 8);
}

#[test]
fn a_peak_that_samples_step_over_is_integrated() {
    let place = WorkFolder::new();
    let knots = |width: f64| {
        format!(
            r##"{{"knots": [{{"value": {}, "extinction": 0, "srgb": "#ffffff"}}, {{"value": 100, "extinction": 3, "srgb": "#ffffff"}},
                {{"value": {}, "extinction": 0, "srgb": "#ffffff"}}]}}"##,
            100.0 - width,
            100.0 + width
        )
    };
    // Values rise by 1 a voxel along x, by 12 along y and by 120 along z.
    for (width, rule, is_told) in [(0.25, "pre-integrated", true), (60.0, "midpoint", false)] {
        std::fs::write(place.path().join("peak.json"), knots(width)).unwrap();
        let out = place.run(&format!("render|a.nrrd|-o|a.png|{SMALL}|--transfer|peak.json"));
        assert_eq!(text(&out.stderr).contains("--rule pre-integrated is taken"), is_told, "{}", text(&out.stderr));
        assert!(text(&out.stdout).contains(rule), "{}", text(&out.stdout));
        let asked = place.run(&format!("render|a.nrrd|-o|a.png|{SMALL}|--transfer|peak.json|--rule|gauss2"));
        assert!(text(&asked.stdout).contains("gauss2") && asked.stderr.is_empty());
    }
}

#[test]
fn criteria_are_listed_or_repeated() {
    let place = WorkFolder::new();
    let said = |lod: &str| text(&place.run(&format!("render|a.nrrd|-o|a.png|--backend|cpu|--size|8x6|{lod}")).stderr);
    let both = said("--lod|7,error=2.5,poi=-1:2:3:0.5|--lod|9,fov,distance=2");
    assert!(both.contains("--lod 7: the volume has") && both.contains("--lod 9: the volume has"), "{both}");
    assert!(!both.contains("error:"), "{both}");
}

#[test]
#[cfg(feature = "formats")]
fn a_store_is_drawn_like_the_file_by_the_parts_that_its_blocks_need() {
    let place = WorkFolder::new();
    assert_eq!(place.run("pack|a.nrrd|-o|a.zarr").status.code(), Some(0));
    let picture = |file: &str, words: &str| {
        let out = place.run(&format!("render|{file}|-o|b.png|{SMALL}|--blocks|8|{words}"));
        assert_eq!(out.status.code(), Some(0), "{words}: {}", text(&out.stderr));
        (image::open(place.path().join("b.png")).unwrap().to_rgb8().into_raw(), text(&out.stdout))
    };
    let peak = r##"{"knots": [{"value": 60, "extinction": 0, "srgb": "#ffffff"}, {"value": 61, "extinction": 4, "srgb": "#ff0000"},
                             {"value": 62, "extinction": 0, "srgb": "#ffffff"}]}"##;
    std::fs::write(place.path().join("peak.json"), peak).unwrap();
    for words in [
        "--block-level|0",
        "--block-level|1|--transfer|ramp",
        "--ratio|8",
        "--transfer|viridis|--ratio|20",
        "--block-level|0|--transfer|peak.json",
    ] {
        let ((of_file, _), (of_store, said)) = (picture("a.nrrd", words), picture("a.zarr", words));
        assert_eq!(of_file, of_store, "{words}");
        assert!(said.contains("MiB of the store\nkept beside the blocks: "), "{said}");
    }
    // The rule is chosen by the voxels of a few blocks.
    let out = place.run(&format!("render|a.zarr|-o|b.png|{SMALL}|--blocks|8|--transfer|peak.json"));
    assert!(text(&out.stderr).contains("--rule pre-integrated is taken"), "{}", text(&out.stderr));
    // Chunks that are lost or damaged are named, and no picture is left.
    std::fs::remove_file(place.path().join("b.png")).unwrap();
    let chunk = place.path().join("a.zarr/0/c/0/0/0");
    let whole = std::fs::read(&chunk).unwrap();
    for content in [Some(&whole[..whole.len() / 2]), None] {
        match content {
            Some(content) => std::fs::write(&chunk, content).unwrap(),
            None => std::fs::remove_file(&chunk).unwrap(),
        }
        let out = place.run(&format!("render|a.zarr|-o|b.png|{SMALL}|--blocks|8|--transfer|ramp"));
        assert_eq!(out.status.code(), Some(1));
        let said = text(&out.stderr);
        assert!(said.contains("a.zarr: ") && said.contains("[0, 0, 0] of array \"0\""), "{said}");
        assert!(!place.path().join("b.png").exists());
    }
}

#[test]
#[cfg(feature = "formats")]
fn a_store_without_a_budget_is_held_to_the_limit_of_the_reader() {
    let place = WorkFolder::new();
    std::fs::write(place.path().join("a.raw"), vec![7u8; 128 * 128 * 80]).unwrap();
    assert_eq!(place.run("pack|a.raw|-o|a.zarr|--raw|128x128x80,u8").status.code(), Some(0));
    let render = |words: &str| place.run(&format!("render|a.zarr|-o|b.png|{SMALL}|--blocks|16|--max-mib|1{words}"));
    let out = render("");
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    assert!(
        text(&out.stderr).contains("all blocks at level 0 take 2 MiB; --max-mib allows 1"),
        "{}",
        text(&out.stderr)
    );
    for words in ["--classify|prefiltered", "--light|head|--normals|stored"] {
        let out = render(&format!("|{words}"));
        assert_eq!(out.status.code(), Some(2), "{words}");
        assert!(text(&out.stderr).contains("and a store exclude each other: it has values alone"), "{words}");
    }
    for words in ["|--block-level|1", "|--budget-mib|1.5", "|--ratio|2"] {
        assert_eq!(render(words).status.code(), Some(0), "{words}");
    }
}

const SMALL: &str = "--backend|cpu|--size|24x18";

impl WorkFolder {
    /// What is printed for a picture that is written.
    fn rendered(&self, picture: &str, words: &str) -> String {
        let out = self.run(&format!("render|a.nrrd|-o|{picture}|{SMALL}{words}"));
        assert_eq!(out.status.code(), Some(0), "{words}: {}", text(&out.stderr));
        text(&out.stdout)
    }

    fn pixels(&self, words: &str) -> Vec<u8> {
        self.rendered("a.png", words);
        image::open(self.path().join("a.png")).unwrap().to_rgb8().into_raw()
    }
}

#[test]
fn what_a_picture_was_sampled_with_is_printed_and_kept() {
    let place = WorkFolder::new();
    let polygons = "divide bricks, lengths true, rays cast to the samples of polygons";
    for (words, expected) in [
        ("", "placement shells, divide rays, lengths true, rays cast\n".to_owned()),
        ("|--placement|tessellated-shells=5", "placement tessellated-shells=5, divide rays".to_owned()),
        (
            "|--placement|viewport-planes|--lengths|nominal",
            "placement viewport-planes, divide rays, lengths nominal".to_owned(),
        ),
        (
            "|--placement|object-planes|--divide|bricks",
            "placement object-planes, divide bricks, lengths true, rays cast\n".to_owned(),
        ),
        ("|--polygons|rgba32float", format!("placement tessellated-shells=16, {polygons} rgba32float")),
        (
            "|--polygons|rgba16float|--divide|bricks|--placement|object-planes",
            format!("placement object-planes, {polygons} rgba16float"),
        ),
    ] {
        let said = place.rendered("a.exr", words);
        assert!(said.contains(&expected), "{words}: {said}");
        let file = text(&std::fs::read(place.path().join("a.exr")).unwrap());
        assert!(file.contains(expected.trim_end()) && !file.contains("overlay"), "{words}");
    }
}

#[test]
fn polygons_imply_tessellated_shells_and_bricks() {
    let place = WorkFolder::new();
    let implied = place.pixels("|--polygons|rgba32float");
    assert_eq!(implied, place.pixels("|--placement|tessellated-shells|--divide|bricks"));
    assert!(implied.iter().any(|c| *c > 0));
}

#[test]
fn light_falls_on_bricks_and_on_blocks() {
    let place = WorkFolder::new();
    let (unlit, lit) = (place.pixels(""), place.pixels("|--light|head"));
    assert_ne!(unlit, lit);
    // Light that is the colour itself, on nothing steep enough to be a surface.
    assert_eq!(place.pixels("|--light|-1,2,3|--flat-below|1e30"), unlit);
    let sides =
        |which: &str| place.pixels(&format!("|--blocks|8|--light|place=1,-9,4|--specular|0|--lit-sides|{which}"));
    let (lower, both) = (sides("lower"), sides("both"));
    assert!(lower != both && lower.iter().zip(&both).all(|(a, b)| a <= b));
    let stored = place.pixels("|--blocks|8|--light|place=1,-9,4|--specular|0|--normals|stored");
    let differences = || stored.iter().zip(&lower).map(|(a, b)| a.abs_diff(*b));
    assert!(stored != lower && differences().all(|d| d < 128), "{:?}", differences().max());
}

#[test]
fn trimmed_bricks_are_the_same_picture() {
    let place = WorkFolder::new();
    let whole = place.pixels("|--brick|16|--trim|conventional");
    assert!(whole.iter().any(|c| *c > 0));
    for how in ["envelope", "visible", "alone", "merged", "packed"] {
        assert_eq!(place.pixels(&format!("|--brick|16|--trim|{how}")), whole, "{how}");
    }
    let said = place.rendered("a.png", "|--brick|16|--trim|packed");
    assert!(said.contains("bricks of 16: 0 white, 1 grey, 0 black\nkept 0.0 of 0.0 MiB"), "{said}");
    let in_batches = "|--brick|16|--trim|visible|--cache-mib|0.005";
    assert_eq!(place.pixels(in_batches), whole);
    assert!(
        place.rendered("a.png", in_batches).contains("1 batch(es), of which the last is above; 1 pages, 1 brought")
    );
}

#[test]
fn bricks_are_shown_over_the_picture_and_in_the_legend() {
    let place = WorkFolder::new();
    let (plain, shown) = (place.pixels(""), place.pixels("|--show-bricks"));
    let n_changed = plain.chunks(3).zip(shown.chunks(3)).filter(|(a, b)| a != b).count();
    assert!(plain.len() == shown.len() && (20..24 * 18 / 2).contains(&n_changed), "{n_changed}");
    let said = place.rendered("a.exr", "|--show-bricks=drawn");
    assert!(said.contains("boxes: 1 of level 0 (sky blue)"), "{said}");
    assert!(text(&std::fs::read(place.path().join("a.exr")).unwrap()).contains("drawn bricks as boxes"));
}

#[test]
fn bricks_that_show_nothing_are_boxes_only_if_all_are_asked_for() {
    let place = WorkFolder::new();
    let knot = |value: f64, extinction: f64| {
        format!(r##"{{"value": {value}, "extinction": {extinction}, "srgb": "#ffffff"}}"##)
    };
    let knots = format!(r#"{{"knots": [{}, {}]}}"#, knot(900.0, 0.0), knot(901.0, 1.0));
    std::fs::write(place.path().join("dark.json"), knots).unwrap();
    let said = place.rendered("a.exr", "|--transfer|dark.json|--show-bricks=all");
    assert!(said.contains("\nboxes: none\n"), "{said}");
    assert!(said.contains("\nfaint boxes, in which nothing is visible: 1 of level 0 (sky blue)\n"), "{said}");
    assert!(!place.rendered("b.exr", "|--show-bricks").contains("faint"));
    assert!(place.pixels("|--transfer|dark.json|--show-bricks=drawn").iter().all(|c| *c == 0));
    assert!(place.pixels("|--transfer|dark.json|--show-bricks=all").iter().any(|c| *c > 0));
    // What is drawn is not drawn again.
    assert_eq!(place.pixels("|--show-bricks=all"), place.pixels("|--show-bricks"));
}

/// Arguments after `render`, the status, and what the message must hold.
const REFUSED: [(&str, i32, &str); 52] = [
    ("b.nrrd|-o|a.png", 1, "b.nrrd"),
    ("a.nrrd|-o|a.jpg", 2, "a.jpg: pictures are written as .exr or .png"),
    ("a.nrrd|-o|no/a.png", 2, "no/a.png: there is no folder no"),
    ("a.nrrd|-o|a.png|--backend|metal", 2, "\"metal\": there are cpu, wgpu and ash"),
    ("a.nrrd|-o|a.png|--backend|cpu|--adapter|none such", 3, "none such"),
    // Before backends are looked for.
    ("a.nrrd|-o|a.png|--backend|cpu|--adapter|none such|--transfer|no.json", 2, "--transfer: \"no.json\""),
    (
        "a.nrrd|-o|a.png|--backend|cpu|--adapter|none such|--camera|eye=1,1,1 target=1,1,1",
        2,
        "--camera: the camera's eye",
    ),
    ("a.nrrd|-o|a.png|--backend|cpu|--adapter|none such|--lengths|nominal|--rule|gauss2", 2, "--lengths nominal"),
    ("a.nrrd|-o|a.png|--step|-1", 2, "above 0"),
    ("a.nrrd|-o|a.png|--step|nan", 2, "above 0"),
    ("a.nrrd|-o|a.png|--step|1e-9", 2, "segments"),
    ("a.nrrd|-o|a.png|--lod|finest", 2, "\"finest\" is not full, a level 0 to 31"),
    ("a.nrrd|-o|a.png|--lod|-1", 2, "\"-1\" is not full, a level 0 to 31"),
    ("a.nrrd|-o|a.png|--lod|1,error", 2, "error=\"\" is not a finite number above 0"),
    ("a.nrrd|-o|a.png|--lod|fov=0", 2, "fov=\"0\" is not a finite number above 0"),
    ("a.nrrd|-o|a.png|--lod|distance=inf", 2, "distance=\"inf\" is not a finite number above 0"),
    ("a.nrrd|-o|a.png|--lod|poi=1:2", 2, "poi=\"1:2\" is not X:Y:Z in world units"),
    ("a.nrrd|-o|a.png|--size|0x0", 2, "each 1 to 32768"),
    ("a.nrrd|-o|a.png|--camera|fov=500", 2, "fov=\"500\" is not above 0 and below 180 degrees"),
    ("a.nrrd|-o|a.png|--camera|zoom=1e300", 2, "zoom"),
    ("a.nrrd|-o|a.png|--camera|target=NaN,0,0", 2, "target"),
    ("a.nrrd|-o|a.png|--camera|eye=1,1,1 target=1,1,1", 2, "--camera: the camera's eye and target"),
    ("a.nrrd|-o|a.png|--clip|20:30,0:1,0:1", 2, "--clip: the box from"),
    ("a.nrrd|-o|a.png|--transfer|none such", 2, "--transfer: \"none such\""),
    ("a.nrrd|-o|a.png|--max-mib|0", 2, "--max-mib"),
    ("a.nrrd|-o|a.png|--placement|spheres", 2, "\"spheres\" is not shells, tessellated-shells[=PIXELS]"),
    ("a.nrrd|-o|a.png|--placement|tessellated-shells=0", 2, "a whole number 1 to 32768"),
    ("a.nrrd|-o|a.png|--placement|shells=3", 2, "\"shells=3\" is not shells"),
    ("a.nrrd|-o|a.png|--divide|shells", 2, "rays or bricks"),
    ("a.nrrd|-o|a.png|--polygons|rgba8unorm", 2, "rgba32float or rgba16float"),
    ("a.nrrd|-o|a.png|--polygons|rgba16float|--placement|shells", 2, "--polygons rgba16float and --placement shells"),
    ("a.nrrd|-o|a.png|--divide|rays|--polygons|rgba32float", 2, "--polygons rgba32float and --divide rays"),
    ("a.nrrd|-o|a.png|--lengths|nominal|--rule|gauss2", 2, "--lengths nominal and --rule gauss2 exclude each other"),
    ("a.nrrd|-o|a.png|--show-bricks=hidden", 2, "drawn or all"),
    ("a.nrrd|-o|a.png|--validation|--backend|cpu", 2, "--validation"),
    ("a.nrrd|-o|a.png|--light|lamp", 2, "head, the direction X,Y,Z towards the light, or place=X,Y,Z"),
    (
        "a.nrrd|-o|a.png|--light|0,0,0",
        2,
        "--light: a light from direction [0, 0, 0]; it must be finite and longer than 0",
    ),
    ("a.nrrd|-o|a.png|--light|head|--diffuse|-1", 2, "--light: diffuse light of -1; it must be 0 to 16"),
    ("a.nrrd|-o|a.png|--light|head|--specular|nan", 2, "--light: specular light of NaN"),
    ("a.nrrd|-o|a.png|--light|head|--shininess|0", 2, "--light: a shininess of 0; it must be 1 to 255"),
    (
        "a.nrrd|-o|a.png|--light|head|--flat-below|0",
        2,
        "a gradient of 0 data values per world unit; it must be finite and above 0",
    ),
    ("a.nrrd|-o|a.png|--light|head|--lit-sides|left", 2, "lower or both"),
    ("a.nrrd|-o|a.png|--light|head|--normals|stored", 2, "--blocks <N>"),
    ("a.nrrd|-o|a.png|--trim|packed|--light|head|--normals|stored", 2, "--blocks <N>"),
    ("a.nrrd|-o|a.png|--trim|packed|--ratio|8", 2, "--blocks <N>"),
    ("a.nrrd|-o|a.png|--trim|packed|--blocks|8", 2, "--trim and --blocks exclude each other"),
    ("a.nrrd|-o|a.png|--trim|packed|--lod|1", 2, "--lod and --trim exclude each other"),
    ("a.nrrd|-o|a.png|--blocks|8|--lod|error=2", 2, "--lod and --blocks exclude each other"),
    ("a.nrrd|-o|a.png|--blocks|8|--classify|prefiltered|--rule|pre-integrated", 2, "--classify prefiltered and --rule"),
    ("a.nrrd|-o|a.png|--ambient|1", 2, "--light <FROM>"),
    ("a.nrrd|-o|.|--size|8x8", 2, "exr or .png"),
    ("a.nrrd|-o|a.png|--raw|99x99x99,u8", 1, "a.nrrd"),
];

#[test]
fn what_is_refused_is_named_and_leaves_nothing_behind() {
    let place = WorkFolder::new();
    for (words, status, part) in REFUSED {
        let out = place.run(&format!("render|{words}"));
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(status), "{words}: {said}");
        assert!(said.contains(part), "{words}: {said}");
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1, "{words}");
    }
}

#[cfg(all(feature = "serve", feature = "fetch"))]
#[test]
fn a_store_is_served_until_the_command_is_ended() {
    use std::io::{BufRead, BufReader};

    use brickfield::core::Objects;
    use brickfield::fetch::{Client, FetchOptions};

    let folder = WorkFolder::new();
    let mut command = folder.command("serve|.|--address|127.0.0.1:0|--mbit|30|--latency-ms|0.5");
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut said = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut said).unwrap();
    let url = said.split_whitespace().next().unwrap();
    assert!(url.starts_with("http://127.0.0.1:") && said.contains("for trying out"), "{said}");
    let client = Client::open(url, FetchOptions::default()).unwrap();
    let file = std::fs::read(folder.path().join("a.nrrd")).unwrap();
    let all = 0..file.len() as u64;
    assert_eq!(client.read("a.nrrd", std::slice::from_ref(&all)).unwrap(), Some(vec![file]));
    child.kill().unwrap();
    child.wait().unwrap();

    for (words, told) in [
        ("serve|gone", "cannot serve gone: "),
        ("serve|.|--mbit|0", "it must be a finite number above 0"),
        ("serve|.|--address|nowhere", "invalid socket address"),
    ] {
        let out = folder.run(words);
        assert_eq!(out.status.code(), Some(2), "{words}");
        assert!(text(&out.stderr).contains(told), "{words}: {}", text(&out.stderr));
    }
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let place = WorkFolder::new();
    let mut child = place.command("info|a.nrrd").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(child.wait().unwrap().success() && said.is_empty(), "{said}");
}

#[test]
#[cfg(feature = "formats")]
fn a_budget_is_spent_on_what_is_seen_and_holds_all_that_it_is_for() {
    let place = WorkFolder::new();
    let (dims, value) = (UVec3::new(100, 90, 80), |i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as u8);
    let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
    let volume = Volume::new(grid, (0..dims.element_product()).map(value).collect::<Vec<_>>()).unwrap();
    save(&place.path().join("b.nrrd"), &volume, &SaveOptions::default()).unwrap();
    assert_eq!(place.run("pack|b.nrrd|-o|b.zarr").status.code(), Some(0));
    // The samples of the blocks, by their printed ratio to the volume's.
    let said = |file: &str, words: &str| {
        let out = place.run(&format!("render|{file}|-o|b.png|{SMALL}|--blocks|8|--transfer|ramp|{words}"));
        assert_eq!(out.status.code(), Some(0), "{words}: {}", text(&out.stderr));
        text(&out.stdout)
    };
    let ratio = |said: &str| {
        let line = said.lines().find(|line| line.starts_with("flat blocks")).unwrap();
        line.rsplit("; ").next().unwrap().trim_end_matches(":1").parse::<f64>().unwrap()
    };
    let volume_bytes = f64::from(dims.element_product());
    let least = |n_bytes: f64| volume_bytes / n_bytes - 0.05;
    let mib = f64::from(1 << 20);
    // A quarter of a store's budget is for chunks.
    let (of_file, of_store) = (ratio(&said("b.nrrd", "--budget-mib|0.3")), ratio(&said("b.zarr", "--budget-mib|0.3")));
    assert!(of_file >= least(0.3 * mib) && of_store >= least(0.225 * mib), "{of_file} {of_store}");
    // A spread takes a byte for each sample of a byte.
    let with_spreads = ratio(&said("b.nrrd", "--budget-mib|0.3|--classify|prefiltered"));
    assert!(with_spreads >= least(0.15 * mib), "{with_spreads}");
    // Blocks that are clipped away stay one sample.
    let clipped = said("b.nrrd", "--budget-mib|0.3|--clip|0:30,0:90,0:80");
    assert!(clipped.contains("1080 of level 3"), "{clipped}");
}
