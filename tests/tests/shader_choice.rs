//! Which shader draws changes no picture, on either GPU backend; and pipelines that a file keeps are used only if they are whole and the
//! driver's own. Prints `no device` where there is none.

mod devices;

use std::fs;
use std::path::Path;

use brickfield::bricks::{BuildOptions, build_tree};
use brickfield::core::glam::{DVec3, UVec2, UVec3};
use brickfield::core::{BrickSide, Camera, Grid, Image, Knot, TransferFunction, Volume};
use brickfield::frame::{Backend, FramePlan, ShaderChoice};
use brickfield::{Residency, Scene, prepare};
use brickfield_ash::{Options, PipelineFile};
use devices::{ash, wgpu};

/// A slope under transfer functions of 2 to 40 knots: each needs a search of its own. Nine are even, 17 have a jump, 40 lie closer and closer.
fn plans() -> Vec<FramePlan> {
    let grid = Grid::axis_aligned(UVec3::new(40, 31, 20), DVec3::ONE).unwrap();
    let voxels: Vec<u8> = (0..grid.n_voxels()).map(|i| (i % 40 * 5 + i / 1240 * 2) as u8).collect();
    let volume = Volume::new(grid, voxels).unwrap();
    let tree = build_tree(&volume, &BuildOptions { side: BrickSide::S16, ..BuildOptions::default() }).unwrap();
    let camera = Camera::framing(&grid.world_box(), DVec3::new(1.0, 0.7, 0.4), DVec3::Z).unwrap();
    let mut residency = Residency::default();
    let place = |i: u32, n: u32| match n {
        17 => f64::from(if i == 8 { 7 } else { i }) / 17.0,
        40 => (f64::from(i) / 40.0).powi(2),
        _ => f64::from(i) / f64::from(n),
    };
    let plan = |n: u32| {
        let knot = |i: u32| Knot {
            value: 230.0 * place(i, n),
            extinction: 0.03 * f64::from(i % 3),
            color: [0.9, 0.5, f64::from(i) / f64::from(n)],
        };
        let transfer = TransferFunction::new((0..n).map(knot).collect()).unwrap();
        prepare(&tree, &Scene::new(camera, UVec2::new(40, 32), transfer), &mut residency).unwrap()
    };
    [2, 5, 9, 17, 40].map(plan).to_vec()
}

fn pictures(backend: &mut dyn Backend, plans: &[FramePlan]) -> Vec<Image<f32>> {
    plans.iter().map(|plan| backend.render(plan).unwrap().image).collect()
}

fn check(backend: &mut dyn Backend) {
    let plans = plans();
    let expected = pictures(backend, &plans);
    assert!(expected.windows(2).all(|pair| pair[0] != pair[1]));
    backend.choose_shaders(ShaderChoice::General);
    for (plan, expected) in plans.iter().zip(&expected) {
        let frame = backend.render(plan).unwrap();
        assert!(frame.is_general && frame.image == *expected);
    }
    backend.choose_shaders(ShaderChoice::Quickest);
    for (plan, expected) in plans.iter().zip(&expected) {
        let frames: Vec<_> = (0..14).map(|_| backend.render(plan).unwrap()).collect();
        assert!(frames.iter().all(|frame| frame.image == *expected));
        // Both are there: they take turns.
        assert!(frames.iter().any(|frame| frame.is_general) && frames.iter().any(|frame| !frame.is_general));
    }
}

/// From the first frame on, with edits: at first no general shader is there, then each edit is drawn by it at once.
fn check_new(backend: &mut dyn Backend, expected: &[Image<f32>]) {
    backend.choose_shaders(ShaderChoice::Quickest);
    let plans = plans();
    let mut n_general = 0;
    for (plan, expected) in plans.iter().zip(expected) {
        for _ in 0..20 {
            let frame = backend.render(plan).unwrap();
            assert!(frame.image == *expected);
            n_general += usize::from(frame.is_general);
        }
    }
    assert!(n_general > 0);
}

#[test]
fn no_choice_changes_a_picture_with_wgpu() {
    if let Some(mut backend) = wgpu() {
        check(&mut backend);
        let expected = pictures(&mut backend, &plans());
        check_new(&mut wgpu().unwrap(), &expected);
    }
}

#[test]
fn no_choice_changes_a_picture_with_ash() {
    if let Some(mut backend) = ash(&Options::default()) {
        check(&mut backend);
        let expected = pictures(&mut backend, &plans());
        check_new(&mut ash(&Options::default()).unwrap(), &expected);
    }
}

#[test]
fn pipelines_of_a_file_are_used_if_they_are_whole_and_the_drivers_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipelines");
    let options = Options { pipelines: Some(path.clone()), ..Options::default() };
    let Some(mut backend) = ash(&options) else { return };
    assert_eq!(backend.pipeline_file(), Some(&PipelineFile::New));
    let plans = plans();
    let expected = pictures(&mut backend, &plans);
    drop(backend);

    let opened = |why: fn(&PipelineFile) -> bool| {
        let mut backend = ash(&options).unwrap();
        assert!(why(backend.pipeline_file().unwrap()), "{:?}", backend.pipeline_file());
        assert!(pictures(&mut backend, &plans) == expected);
    };
    opened(|file| matches!(file, PipelineFile::Read { n_bytes } if *n_bytes > 0));
    // A byte of the driver's version, one of the data, a part, and something else.
    for spoil in [
        (|bytes: &mut Vec<u8>| bytes[16] ^= 1) as fn(&mut Vec<u8>),
        |bytes| *bytes.last_mut().unwrap() ^= 1,
        |bytes| bytes.truncate(bytes.len() - 1),
        |bytes| *bytes = b"no pipelines".to_vec(),
    ] {
        rewrite(&path, spoil);
        opened(|file| matches!(file, PipelineFile::Ignored { .. }));
        // It was written anew.
        opened(|file| matches!(file, PipelineFile::Read { .. }));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    // A folder that is not there: pictures all the same, and an error for who asks.
    let nowhere = Options { pipelines: Some(folder.path().join("none/pipelines")), ..Options::default() };
    let mut backend = ash(&nowhere).unwrap();
    assert!(pictures(&mut backend, &plans) == expected);
    assert!(backend.save_pipelines().unwrap_err().to_string().contains("none/pipelines"));
}

fn rewrite(path: &Path, spoil: impl Fn(&mut Vec<u8>)) {
    let mut bytes = fs::read(path).unwrap();
    spoil(&mut bytes);
    fs::write(path, bytes).unwrap();
}
