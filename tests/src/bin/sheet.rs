//! The first picture of every volume of a folder, as one sheet: the camera and the transfer function that a person gets who
//! states none.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail, ensure};
use brickfield::io::{Format, detect};
use brickfield::options::{FinestVoxels, InputOptions, SamplingOptions, Subject, TreeOptions, ViewOptions};
use brickfield::{BackendKind, Classification, Residency, Validation, open_backend, prepare, write_picture};
use clap::Parser;
use comfy_table::{Table, presets::NOTHING};
use image::{GenericImage, Rgba, RgbaImage};

/// Renders every volume of a folder with nothing stated but the file, and puts the pictures on one sheet; with --other those
/// of another build to their left
#[derive(Parser)]
struct Arguments {
    /// The folder of volumes; its sub-folders are looked through
    #[arg(long, env = "BRICKFIELD_DATA", value_name = "FOLDER")]
    data: PathBuf,
    /// The `brickfield` command of another build
    #[arg(long, value_name = "PROGRAM")]
    other: Option<PathBuf>,
    /// Side of each picture in pixels
    #[arg(long, default_value_t = 224, value_parser = clap::value_parser!(u32).range(16..=1024))]
    side: u32,
    /// The sheet to write
    #[arg(long, default_value = "target/sheet.png", value_name = "PICTURE")]
    out: PathBuf,
}

/// Options of which none is stated.
#[derive(Parser)]
struct Unstated {
    #[command(flatten)]
    input: InputOptions,
    #[command(flatten)]
    tree: TreeOptions,
    #[command(flatten)]
    view: ViewOptions,
    #[command(flatten)]
    sampling: SamplingOptions,
}

fn main() -> Result<ExitCode> {
    let arguments = Arguments::parse();
    let mut volumes = Vec::new();
    find_volumes(&arguments.data, &mut volumes).with_context(|| arguments.data.display().to_string())?;
    ensure!(!volumes.is_empty(), "{}: no volume is there", arguments.data.display());
    let folder = tempfile::tempdir()?;
    let picture = folder.path().join("picture.png");
    let (mut rows, mut table) = (Vec::new(), Table::new());
    table.load_preset(NOTHING).set_header(["row", "volume", "covered before", "covered", "notes"]);
    for path in &volumes {
        let name = path.strip_prefix(&arguments.data).unwrap_or(path).display().to_string();
        let Ok(()) = render(path, arguments.side, &picture) else {
            table.add_row(["", name.as_str(), "", "not read", ""]);
            continue;
        };
        let after = image::open(&picture)?.to_rgba8();
        let before = match &arguments.other {
            Some(program) => render_by(program, path, arguments.side, &picture).ok().map(|()| image::open(&picture)),
            None => None,
        };
        let before = before.transpose()?.map(|picture| picture.to_rgba8());
        let changed = before.as_ref().filter(|before| **before != after).map_or("", |_| "changed");
        let share = |picture: &RgbaImage| format!("{:.0} %", 100.0 * covered(picture));
        let row = (rows.len() + 1).to_string();
        table.add_row([&row, &name, &before.as_ref().map(share).unwrap_or_default(), &share(&after), changed]);
        rows.push(before.into_iter().chain([after]).collect::<Vec<_>>());
    }
    sheet(&rows, arguments.side).save(&arguments.out).with_context(|| arguments.out.display().to_string())?;
    println!("{table}\n{}: {} rows, left to right, then down", arguments.out.display(), rows.len());
    Ok(ExitCode::SUCCESS)
}

/// Files and folders that are volumes, in order: a folder with DICOM slices or of OME-Zarr is one, every other is looked through.
fn find_volumes(folder: &Path, volumes: &mut Vec<PathBuf>) -> Result<()> {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    entries.sort();
    let is = |path: &Path, wanted| detect(path).is_ok_and(|format| format == wanted);
    if is(folder, Format::OmeZarr) || entries.iter().any(|entry| entry.is_file() && is(entry, Format::Dicom)) {
        volumes.push(folder.to_owned());
        return Ok(());
    }
    for entry in entries {
        if entry.is_dir() {
            find_volumes(&entry, volumes)?;
        } else if detect(&entry).is_ok_and(Format::is_readable) {
            volumes.push(entry);
        }
    }
    Ok(())
}

/// Renders by this build.
fn render(path: &Path, side: u32, picture: &Path) -> Result<()> {
    let size = format!("{side}x{side}");
    let options = Unstated::try_parse_from(["sheet", "--size", &size])?;
    let subject = Subject::open(path, &options.input, &options.tree, &options.view)?;
    let scene = options.sampling.of(
        options.view.scene(&subject)?,
        FinestVoxels::Volume(&subject.volume),
        Classification::OfMean,
    )?;
    let plan = prepare(&subject.tree, &scene, &mut Residency::default())?;
    let frame = open_backend(BackendKind::Cpu, None, Validation::Off)?.render(&plan)?;
    Ok(write_picture(picture, &frame.image, options.view.background.0, &[])?)
}

/// Renders by the command of another build.
fn render_by(program: &Path, path: &Path, side: u32, picture: &Path) -> Result<()> {
    let mut command = Command::new(program);
    command.arg("render").arg(path).arg("-o").arg(picture);
    command.args(["--backend", "cpu", "--size", &format!("{side}x{side}")]);
    let out = command.output().with_context(|| program.display().to_string())?;
    if !out.status.success() {
        bail!("{}: {}", program.display(), String::from_utf8_lossy(&out.stderr));
    }
    Ok(())
}

/// The share of pixels that are not background.
fn covered(picture: &RgbaImage) -> f64 {
    let n = picture.pixels().filter(|p| p.0[..3].iter().any(|v| *v > 8)).count();
    n as f64 / (picture.width() * picture.height()) as f64
}

/// Rows of pictures, in as many columns as make the sheet about square.
fn sheet(rows: &[Vec<RgbaImage>], side: u32) -> RgbaImage {
    const GAP: u32 = 6;
    let n_pictures = rows.iter().map(Vec::len).max().unwrap_or(1) as u32;
    let row_width = n_pictures * (side + GAP) + GAP;
    let n_columns = ((rows.len() as f64 * f64::from(side + GAP) / f64::from(row_width)).sqrt().round() as u32).max(1);
    let n_down = (rows.len() as u32).div_ceil(n_columns);
    let grey = Rgba([90, 90, 90, 255]);
    let mut sheet = RgbaImage::from_pixel(n_columns * row_width, n_down * (side + GAP) + GAP, grey);
    for (i, row) in (0..).zip(rows) {
        let (column, down) = (i % n_columns, i / n_columns);
        for (j, picture) in (0..).zip(row) {
            let x = column * row_width + GAP + j * (side + GAP);
            sheet.copy_from(picture, x, down * (side + GAP) + GAP).expect("the sheet has room for every picture");
        }
    }
    sheet
}
