//! Whole runs of `peers`: with peers that are a shell script, and with another build that draws something else than it is asked.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Answers as `serve.py` does: `vtk-gpu` draws black pictures of 32 x 32 pixels, `vispy` fails at its first frame, anybody
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
      sleep 0.02
      say "$frame";;
    *'"ask":"frame"'*)
      if [ "$fails" ]; then echo "out of memory" >&2; exit 1; fi
      # No frame takes longer than its answer.
      sleep 0.02
      say "$frame";;
    *) say "$failed";;
  esac
done
"#;

/// `vtk-fixed` never opens the scene, `vtk-gpu` never draws it, `pygfx` answers nonsense, `vispy` says times that cannot be.
const HANGS: &str = r#"#!/bin/sh
opened='{"answer":"opened","version":"fake 1","device":"none","domain":"centres","view":1.0,"phases":[]}'
while read -r line; do
  case "$line" in
    *'"ask":"open"'*vtk-fixed*) exec sleep 60;;
    *'"ask":"open"'*vtk-gpu*) printf '%s\n' "$opened"; hangs=1;;
    *'"ask":"open"'*pygfx*) printf '%s\n' "$opened"; say='<html>';;
    *'"ask":"open"'*) printf '%s\n' "$opened"; say='{"answer":"frame","wall_ms":4e9,"cpu_ms":8.0,"parts":[]}';;
    *) if [ "$hangs" ]; then exec sleep 60; fi; printf '%s\n' "$say";;
  esac
done
"#;

/// The `peers` of the tests, whose requests go through the lines of LIE.
const LIAR: &str = r#"#!/bin/sh
while read -r line; do
  LIE
  printf '%s\n' "$line"
done | PEERS --serve
"#;

fn program(path: &Path, text: &str) {
    fs::write(path, text).unwrap();
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
}

fn run(folder: &Path, words: &str) -> Output {
    run_with(FAKE, folder, words)
}

fn run_with(python: &str, folder: &Path, words: &str) -> Output {
    let path = folder.join("python");
    program(&path, python);
    let (python, mut command) = (path, Command::new(env!("CARGO_BIN_EXE_peers")));
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
    assert!(
        text.lines().any(|l| l.starts_with("failed: vispy: ") && l.ends_with("(exit status: 1); out of memory")),
        "{text}"
    );
    assert!(text.contains("note: vtk-gpu: an RMSE of 0.") && !text.contains("note: cpu exact: an"), "{text}");
    // The program has the profile of its test.
    assert_eq!(text.contains("note: cpu fast, other cpu fast"), cfg!(debug_assertions), "{text}");
    let report = report(folder.path());
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
    assert_eq!(scene["times_to_errors"].as_array().unwrap().len(), 2 * 7);
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
    let report = report(folder.path());
    let first = &report["first"][0];
    let (own, fake) = (&first["pictures"][0], &first["pictures"][1]);
    let parts: Vec<&str> = own["parts"].as_array().unwrap().iter().map(|p| p[0].as_str().unwrap()).collect();
    assert_eq!(parts, ["read", "octree", "device", "prepare", "upload", "render", "read-back"]);
    assert!(own["process"]["median"].as_f64() > own["wall"]["median"].as_f64());
    assert_eq!((&fake["wall"]["median"], &fake["cpu"]["median"]), (&6.0.into(), &9.0.into()));
    assert!(own["rmse"].as_f64().unwrap() < 0.01 && fake["rmse"].as_f64().unwrap() > 0.05, "{first}");
    assert!(text.contains("note: vtk-gpu: an RMSE of 0."), "{text}");
    assert_eq!(first["absent"][0]["absent"], "no module");
}

#[test]
fn peers_are_refused_a_required_backend_that_is_not_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "--scene ml --steps 1 --peers none --require ash");
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).contains("ash is required and absent"));
}

fn report(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("out/peers.json")).unwrap()).unwrap()
}

#[test]
fn peers_that_hang_or_talk_nonsense_leave_the_others_alone() {
    let folder = tempfile::tempdir().unwrap();
    let words = "--scene blobs --steps 1/2,1/4 --modes fast --peers vtk-fixed,vtk-gpu,pygfx,vispy --patience 3";
    let output = run_with(HANGS, folder.path(), words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let scene = &report(folder.path())["scenes"][0];
    let absent: Vec<&str> =
        scene["contestants"].as_array().unwrap().iter().map(|c| c["absent"].as_str().unwrap_or("")).collect();
    assert_eq!(absent[0], "");
    for late in &absent[1..3] {
        assert!(late.ends_with("it did not write an answer within 3 s (--patience), and was killed"), "{late}");
    }
    assert!(absent[3].ends_with("it wrote \"<html>\", and not an answer"), "{absent:?}");
    assert!(absent[4].starts_with("it says that a frame took 4000000000 ms, and answered after "), "{absent:?}");
    for step in scene["steps"].as_array().unwrap() {
        assert_eq!(step["rows"].as_array().unwrap().len(), 1, "{step}");
    }
    let first = run_with(HANGS, folder.path(), "--first --modes fast --peers vtk-gpu,pygfx --patience 3");
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let first = &report(folder.path())["first"][0];
    assert_eq!((&first["pictures"].as_array().unwrap().len(), &first["absent"].as_array().unwrap().len()), (&1, &2));
}

/// A tenth of the extinction; the first camera for all frames; a step of another length.
#[test]
fn peers_that_draw_something_else_have_large_errors() {
    let lies = [
        r#"line=$(printf '%s' "$line" | sed 's/"extinction":\([0-9]*\)\./"extinction":0.\1/g')"#,
        r#"at=$(printf '%s' "$line" | sed -n 's/.*\("eye":.*\),"up".*/\1/p'); first=${first:-$at}
           line=$(printf '%s' "$line" | sed "s/\"eye\":.*,\"up\"/$first,\"up\"/")"#,
        r#"line=$(printf '%s' "$line" | sed 's/"step_voxels":0.25/"step_voxels":1/')"#,
    ];
    for lie in lies {
        let folder = tempfile::tempdir().unwrap();
        let liar = folder.path().join("liar");
        program(&liar, &LIAR.replace("LIE", lie).replace("PEERS", env!("CARGO_BIN_EXE_peers")));
        let words = "--scene blobs --steps 1/4 --modes exact --peers none --other";
        let output = run(folder.path(), &format!("{words} {}", liar.display()));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report = report(folder.path());
        let rows = report["scenes"][0]["steps"][0]["rows"].as_array().unwrap();
        let rmse = |i: usize| rows[i]["rmse"].as_f64().unwrap();
        assert_eq!(rows[1]["contestant"], "other cpu exact", "{report}");
        assert!(rmse(1) > 5.0 * rmse(0), "{lie}: {} and {}", rmse(0), rmse(1));
    }
}

#[test]
fn peers_go_on_to_smaller_steps_until_an_error_is_reached() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "--scene blobs --steps 1,2 --modes exact --peers vtk-gpu --to-error");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report = report(folder.path());
    let scene = &report["scenes"][0];
    let reached = scene["times_to_errors"].as_array().unwrap();
    // Of a voxel or more, steps say nothing yet; a black picture has the same error at half of one.
    let at = reached[1]["reached"]["at"]["step_voxels"].as_f64().unwrap();
    assert!((0.02..0.5).contains(&at), "{report}");
    assert_eq!(reached[3]["reached"]["stays"]["step_voxels"], 1.0);
    let timed = scene["steps"].as_array().unwrap().iter().find(|step| step["step_voxels"] == at).unwrap();
    let rows = timed["rows"].as_array().unwrap();
    assert!(rows.len() == 1 && rows[0]["rmse"].as_f64().unwrap() <= 1e-4, "{timed}");
    // The step before does not reach it: steps are halved one by one.
    let probes = scene["probes"].as_array().unwrap();
    let error = |step: f64| probes.iter().find(|p| p["step_voxels"] == step).unwrap()["rmse"].as_f64().unwrap();
    assert!(error(2.0 * at) > 1e-4 && error(at) <= 1e-4, "{probes:?}");
    assert_eq!(probes.iter().filter(|p| p["contestant"] == "vtk-gpu").count(), 1);
}
