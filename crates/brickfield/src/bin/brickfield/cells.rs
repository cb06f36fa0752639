//! `brickfield cells`.

use std::sync::Arc;

use brickfield::core::glam::UVec3;
use brickfield::core::{Camera, Image, StructuredGrid, TransferFunction, ValueRange};
use brickfield::curvilinear::CurvilinearGrid;
use brickfield::frame::{Backend, Cells, CellsPlan, CellsView, Frame, MeshLines, MeshPlan, MeshView, Sampling};
use brickfield::io::WorldFrame;
use brickfield::options::{NamedTransfer, OptionError, presets};
use brickfield::{SurfaceNormals, check_picture_path, joined_mesh, spectrum, write_picture};

use crate::backend::check_validation;
use crate::grid_input::{box_grid, check_plane};
use crate::{CellsArgs, Failure, print};

pub(crate) fn run(args: &CellsArgs) -> Result<(), Failure> {
    check_picture_path(&args.out).map_err(Failure::usage)?;
    args.camera.check().map_err(OptionError::from)?;
    let mut backend = args.backend.open()?;
    let (grid, field) = args.input.open()?;
    args.plane.iter().try_for_each(|plane| check_plane(&grid, *plane))?;
    if grid.n_nodes().min_element() < 2 {
        return Err(Failure::usage(NoCells { n: grid.n_nodes() }));
    }
    let cells = Arc::new(Cells::of_grid(&grid, field)?);
    let around = cells.extent();
    let camera =
        args.camera.camera(&box_grid(Some(around))?, WorldFrame::default(), args.size).map_err(OptionError::from)?;
    let range = cells.range();
    let transfer = transfer(args, range, around.diagonal())?;
    let behind = surfaces(args, &grid, field, range, &camera, backend.as_mut())?;
    let sampling = Sampling::new(around.diagonal() / f64::from(args.steps), args.rule, args.mode)?;
    let view = CellsView { camera, size: args.size, sampling, transfer, behind };
    let plan = CellsPlan::new(cells, view).map_err(Failure::usage)?;
    let frame = backend.render_cells(&plan)?;
    if frame.image.pixels().iter().all(|pixel| pixel[3] == 0.0) {
        let (min, max) = (range.min, range.max);
        eprintln!(
            "note: nothing is visible: the transfer function is 0 over the values {min} to {max}, or nothing is in the view"
        );
    }
    let attributes = vec![
        ("file", args.input.file.file_name().unwrap_or_default().to_string_lossy().into_owned()),
        ("field", grid.fields()[field].name.clone()),
        ("step", plan.sampling().step_world().to_string()),
        ("rule", plan.sampling().rule().name().to_owned()),
    ];
    write_picture(&args.out, &frame.image, args.background.0, &attributes)?;
    print(&summary(&plan, &frame, range, backend.describe().backend))?;
    check_validation(&backend.validation_messages())
}

/// Surfaces are drawn by another command.
#[derive(Debug, thiserror::Error)]
#[error("a grid of {} x {} x {} nodes has no cells; `brickfield surface` draws it", n.x, n.y, n.z)]
struct NoCells {
    n: UVec3,
}

/// The automatic one is of volumes' histograms.
#[derive(Debug, thiserror::Error)]
#[error("--transfer: {name:?} is neither a file nor a preset; the presets are {presets}")]
struct NoSuchTransfer {
    name: String,
    presets: String,
}

fn transfer(args: &CellsArgs, range: ValueRange, length: f64) -> Result<TransferFunction, Failure> {
    match NamedTransfer::of(&args.transfer)? {
        Some(NamedTransfer::Preset(preset)) => Ok(preset.transfer(range, length)?),
        Some(NamedTransfer::OfFile(transfer)) => Ok(transfer),
        Some(NamedTransfer::Automatic) | None => {
            Err(Failure::usage(NoSuchTransfer { name: args.transfer.clone(), presets: presets() }))
        }
    }
}

/// The planes of the grid that are asked for, as an opaque surface amid the cells.
fn surfaces(
    args: &CellsArgs,
    grid: &StructuredGrid,
    field: usize,
    range: ValueRange,
    camera: &Camera,
    backend: &mut dyn Backend,
) -> Result<Option<Arc<Image<f32>>>, Failure> {
    if args.plane.is_empty() {
        return Ok(None);
    }
    let planes = args.plane.iter().map(|plane| CurvilinearGrid::of_plane(grid, *plane, field));
    let planes: Vec<CurvilinearGrid> = planes.collect::<Result<_, _>>()?;
    let mesh = Arc::new(joined_mesh(planes, SurfaceNormals::Triangles)?);
    let view = MeshView {
        camera: *camera,
        size: args.size,
        colors: spectrum(range).map_err(OptionError::from)?,
        coloring: Default::default(),
        light: args.light.light(1.0).map_err(OptionError::from)?,
        lines: args.lines.map(|width| MeshLines { width, color: [0.0; 3] }),
    };
    let plan = MeshPlan::new(mesh, view).map_err(Failure::usage)?;
    Ok(Some(Arc::new(backend.render_mesh(&plan)?.pixels)))
}

fn summary(plan: &CellsPlan, frame: &Frame, range: ValueRange, backend: &str) -> String {
    let n = plan.cells().n_cells();
    format!(
        "{} x {} x {} cells, {} to {}; step {:.4}, {}\n{backend}: {:.1} ms, upload {:.1} ms of {} KiB\n",
        n.x,
        n.y,
        n.z,
        range.min,
        range.max,
        plan.sampling().step_world(),
        plan.sampling().rule().name(),
        frame.timing.device_ms.unwrap_or(frame.timing.wall_ms),
        frame.timing.upload_ms,
        frame.uploaded_bytes >> 10,
    )
}
