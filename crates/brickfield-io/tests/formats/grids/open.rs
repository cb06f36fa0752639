//! Opening by path: formats are told apart, volumes and grids send to each other.

use std::path::{Path, PathBuf};

use brickfield_io::{GridFormat, GridNote, GridOptions, OpenOptions, detect_grid, open, open_grid};

use super::{examples, options, plot3d};

fn write(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

#[track_caller]
fn refusal(path: &Path, options: &GridOptions) -> String {
    let message = open_grid(path, options).expect_err("a refusal").to_string();
    let said = message.strip_prefix(&format!("{}: ", path.display())).expect("the path comes first");
    assert!(!said.contains(['\n', '\r']), "{said}");
    said.to_owned()
}

#[test]
fn every_example_opens_by_path_and_by_content() {
    let folder = tempfile::tempdir().unwrap();
    for example in examples().iter().filter(|e| !e.name.ends_with(".q") && !e.name.ends_with(".f")) {
        let read = (example.read)(&example.bytes).unwrap();
        let path = write(folder.path(), example.name, &example.bytes);
        assert_eq!(open_grid(&path, &options()).unwrap(), read, "{}", example.name);
        for other in ["unnamed", "other.bin"] {
            let path = write(folder.path(), other, &example.bytes);
            assert_eq!(detect_grid(&path).unwrap(), read.format, "{} as {other}", example.name);
            assert_eq!(open_grid(&path, &options()).unwrap(), read, "{}", example.name);
        }
    }
}

#[test]
fn the_volume_reader_says_that_it_is_a_grid() {
    let folder = tempfile::tempdir().unwrap();
    let mut names = vec![("v.hgt", vec![0; 10]), ("v.xyz", plot3d::PLAIN.grid(&plot3d::GRIDS[..1]))];
    names.push(("v.bin", plot3d::PLAIN.grid(&plot3d::GRIDS[..1])));
    names.push(("q.bin", plot3d::PLAIN.solution(&plot3d::GRIDS[..1])));
    for example in examples() {
        names.push((example.name, example.bytes));
    }
    for (name, bytes) in names.iter().filter(|(name, _)| !name.ends_with(".tif")) {
        let said = open(&write(folder.path(), name, bytes), &OpenOptions::default()).unwrap_err().to_string();
        assert!(said.ends_with("it is a structured grid, and no volume"), "{said}");
    }
}

#[test]
fn volumes_empty_and_unknown_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let said = |name: &str, bytes: &[u8]| refusal(&write(folder.path(), name, bytes), &options());
    for extension in GridFormat::ALL.iter().flat_map(|format| format.extensions()) {
        assert_eq!(said(&format!("v.{extension}"), b""), "the file is empty (0 bytes)");
        let letter = said(&format!("v.{extension}"), &b"This is a letter to a friend.\n".repeat(50));
        assert!(letter.len() < 250, "{letter}");
    }
    assert_eq!(
        said("letter", b"Dear friend,\n"),
        "no known format of structured grids; it starts with \"Dear friend,\\n\""
    );
    let nrrd = said("v.nrrd", b"NRRD0004\ntype: uchar\n");
    assert_eq!(nrrd, "format \"NRRD\" is not supported; it is a volume, and no structured grid");
    let points = b"# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\n";
    assert!(said("v.vtk", points).ends_with("`open` reads it as a volume"));
    assert!(refusal(&folder.path().join("gone.xyz"), &options()).starts_with("cannot read the file"));
    assert!(said("tile.hgt", &[0; 2_884_802]).starts_with("name of the file is \"TILE.HGT\""));
}

#[test]
fn a_solution_beside_a_grid_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let grids = &plot3d::GRIDS[..1];
    let path = write(folder.path(), "combxyz.bin", &plot3d::PLAIN.grid(grids));
    assert!(open_grid(&path, &options()).unwrap().notes.is_empty());
    let solution = write(folder.path(), "combq.bin", &plot3d::PLAIN.solution(grids));
    let notes = open_grid(&path, &options()).unwrap().notes;
    assert_eq!(notes, [GridNote::SolutionBeside { name: "combq.bin".to_owned() }]);
    assert_eq!(notes[0].to_string(), "\"combq.bin\" beside it may have its values: state it as the solution");
    let mut with_solution = options();
    with_solution.solution = Some(solution.clone());
    assert_eq!(open_grid(&path, &with_solution).unwrap().grids[0].fields().len(), 5);
    assert_eq!(
        refusal(&solution, &options()),
        "PLOT3D file \"a solution of 4 x 3 x 2 nodes\" is not supported; it is the solution of a grid: \
         open that, with this file as its solution"
    );
    let dem = write(folder.path(), "v.dem", b"x");
    assert!(refusal(&dem, &with_solution).starts_with("solution of format \"USGS DEM\" is not supported"));
    with_solution.solution = Some(folder.path().join("gone.q"));
    assert!(open_grid(&path, &with_solution).unwrap_err().to_string().contains("gone.q: cannot read the file"));
}
