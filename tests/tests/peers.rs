//! A whole run of `peers`, with a peer that is a shell script, and one that is absent.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Answers as `serve.py` does: `vtk-gpu` draws black pictures of 32 x 32 pixels, `vispy` fails after its first picture, anybody
/// else is absent.
const FAKE: &str = r#"#!/bin/sh
opened='{"answer":"opened","version":"fake 1","device":"none","domain":"centres","view":1.0,"phases":[{"name":"read","wall_ms":2,"cpu_ms":1}]}'
frame='{"answer":"frame","wall_ms":4.0,"cpu_ms":8.0,"parts":[]}'
failed='{"answer":"failed","reason":"no\n module"}'
say() { printf '%s\n' "$1"; }
while read -r line; do
  case "$line" in
    *'"ask":"open"'*vtk-gpu*) say "$opened";;
    *'"ask":"open"'*vispy*) say "$opened"; fails=1;;
    *'"ask":"picture"'*)
      path=$(printf '%s' "$line" | sed 's/.*"path":"\([^"]*\)".*/\1/')
      head -c 16384 /dev/zero > "$path"
      say "$frame";;
    *'"ask":"frame"'*) if [ "$fails" ]; then echo "out of memory" >&2; exit 1; fi; say "$frame";;
    *) say "$failed";;
  esac
done
"#;

fn run(folder: &Path, words: &str) -> Output {
    let python = folder.join("python");
    fs::write(&python, FAKE).unwrap();
    fs::set_permissions(&python, fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_peers"));
    command.args(words.split_whitespace()).args([
        "--backends",
        "cpu",
        "--size",
        "32x32",
        "--voxels",
        "24",
        "--frames",
        "1",
    ]);
    command.arg("--python").arg(python).arg("--out").arg(folder.join("out")).output().unwrap()
}

#[test]
fn peers_take_part_are_absent_or_fail() {
    let folder = tempfile::tempdir().unwrap();
    let other = env!("CARGO_BIN_EXE_peers");
    let output =
        run(folder.path(), &format!("--scene blobs --steps 1/2,1/4 --peers vtk-gpu,pygfx,vispy --other {other}"));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    // Who fails on the way is told, too.
    assert!(text.lines().any(|l| l.starts_with("failed: vispy: ") && l.ends_with("out of memory")), "{text}");
    // The program has the profile of its test.
    assert_eq!(text.contains("note: cpu fast, other cpu fast"), cfg!(debug_assertions), "{text}");
    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("out/peers.json")).unwrap()).unwrap();
    let scene = &report["scenes"][0];
    let absent = |name: &str| {
        let all = scene["contestants"].as_array().unwrap();
        all.iter().find(|c| c["name"] == name).unwrap()["absent"].as_str().map(str::to_owned)
    };
    assert_eq!((absent("cpu fast"), absent("vtk-gpu")), (None, None));
    assert_eq!(absent("pygfx").unwrap(), "no module");
    assert!(absent("vispy").unwrap().ends_with("out of memory"), "{:?}", absent("vispy"));
    for step in scene["steps"].as_array().unwrap() {
        let rows = step["rows"].as_array().unwrap();
        let row = |name: &str| rows.iter().find(|r| r["contestant"] == name).unwrap();
        let names: Vec<&str> = rows.iter().map(|r| r["contestant"].as_str().unwrap()).collect();
        assert_eq!(names, ["cpu fast", "other cpu fast", "cpu exact", "other cpu exact", "vtk-gpu"]);
        assert_eq!((&row("vtk-gpu")["cpu"]["median"], &row("vtk-gpu")["wall_ms"][0]), (&8.0.into(), &4.0.into()));
        // A black picture is far off, and another process of the same build draws the same.
        assert!(row("vtk-gpu")["rmse"].as_f64().unwrap() > 0.05);
        assert_eq!(row("cpu fast")["rmse"], row("other cpu fast")["rmse"]);
        assert!(row("cpu fast")["cpu"]["median"].as_f64().unwrap() > 0.0);
        assert_eq!(step["ratios"].as_array().unwrap().len(), 4);
    }
    // The midpoint rule has order 2: held to a wrong answer, or to that of another box, errors would not fall so.
    let error = |step: usize| scene["steps"][step]["rows"][2]["rmse"].as_f64().unwrap();
    let ratio = error(0) / error(1);
    assert!((3.0..5.0).contains(&ratio), "half the step has 1/{ratio} of the error");
    assert_eq!(scene["times_to_errors"].as_array().unwrap().len(), 2 * 5);
    let page = fs::read_to_string(folder.path().join("out/blobs-24/index.html")).unwrap();
    assert!(page.contains("data-rule=\"other-build\"") && page.contains("<b>pygfx</b> is absent: no module"));
    // A reference, and two pictures of each contestant.
    assert_eq!(page.matches("<figure").count(), 1 + 2 * 5);
}

#[test]
fn peers_bring_a_first_picture_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "--first --peers vtk-gpu,pygfx --modes fast");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("out/peers.json")).unwrap()).unwrap();
    let first = &report["first"][0];
    let (own, fake) = (&first["pictures"][0], &first["pictures"][1]);
    let parts: Vec<&str> = own["parts"].as_array().unwrap().iter().map(|p| p[0].as_str().unwrap()).collect();
    assert_eq!(parts, ["read", "octree", "device", "prepare", "upload", "render", "read-back"]);
    assert!(own["process"]["median"].as_f64() > own["wall"]["median"].as_f64());
    assert_eq!((&fake["wall"]["median"], &fake["cpu"]["median"]), (&6.0.into(), &9.0.into()));
    assert_eq!(first["absent"][0]["absent"], "no module");
}

#[test]
fn peers_are_refused_a_required_backend_that_is_not_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "--scene ml --steps 1 --peers none --require ash");
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).contains("ash is required and absent"));
}
