//! `brickfield surface`.

use std::sync::Arc;

use brickfield::core::{Camera, GridPoints, NodeField, StructuredGrid, TransferFunction, ValueRange};
use brickfield::curvilinear::{BudgetSelector, CurvilinearGrid, IndexPlane, QuadTree, Selection, SizeSelector, View};
use brickfield::frame::{Coloring, MeshFrame, MeshLines, MeshPlan, MeshView};
use brickfield::io::WorldFrame;
use brickfield::optics::{ReadTransferError, read_transfer};
use brickfield::options::OptionError;
use brickfield::overlay::show_color_bar;
use brickfield::{check_picture_path, spectrum, surface_mesh, write_picture};

use crate::backend::check_validation;
use crate::grid_input::{box_grid, check_plane};
use crate::{Failure, SurfaceArgs, print};

pub(crate) fn run(args: &SurfaceArgs) -> Result<(), Failure> {
    check_picture_path(&args.out).map_err(Failure::usage)?;
    args.camera.check().map_err(OptionError::from)?;
    let light = args.light.light(1.0).map_err(OptionError::from)?;
    let mut backend = args.backend.open()?;
    let subject = Subject::open(args)?;
    let camera = args
        .camera
        .camera(&box_grid(subject.tree.grid().extent())?, WorldFrame::default(), args.size)
        .map_err(OptionError::from)?;
    let selection = subject.select(args, &camera)?;
    let mesh = Arc::new(surface_mesh(subject.tree.grid(), &selection, args.normals)?);
    let view = MeshView {
        camera,
        size: args.size,
        colors: subject.colors.clone(),
        coloring: if args.gouraud { Coloring::Gouraud } else { Coloring::Values },
        light,
        lines: args.lines.map(|width| MeshLines { width, color: [0.0; 3] }),
    };
    let plan = MeshPlan::new(mesh, view).map_err(Failure::usage)?;
    let frame = backend.render_mesh(&plan)?;
    let mut image = frame.image();
    if args.color_bar {
        let with_bar = show_color_bar(&image, &subject.colors, subject.range, &subject.title());
        if with_bar == image {
            eprintln!("note: --color-bar: there is no room for a bar in the picture, or only one value");
        }
        image = with_bar;
    }
    let attributes = attributes(args, &subject, &selection, &plan);
    write_picture(&args.out, &image, args.background.0, &attributes)?;
    print(&summary(&subject, &selection, &plan, &frame, backend.describe().backend))?;
    check_validation(&backend.validation_messages())
}

/// Colours of values are a transfer function without extinction.
#[derive(Debug, thiserror::Error)]
#[error("--colors: {source}")]
struct ColorsFault {
    source: ReadTransferError,
}

/// Planes of curvilinear grids lie where their nodes are.
#[derive(Debug, thiserror::Error)]
#[error("--exaggeration {factor}: the surface is no terrain, whose values are heights")]
struct NoHeights {
    factor: f64,
}

/// A surface that is ready to be drawn.
struct Subject {
    tree: Arc<QuadTree>,
    field: String,
    unit: Option<String>,
    range: ValueRange,
    colors: TransferFunction,
}

impl Subject {
    fn open(args: &SurfaceArgs) -> Result<Subject, Failure> {
        let (grid, field) = args.input.open()?;
        let surface = zones(&grid, field, args)?;
        let NodeField { name, unit, .. } = &grid.fields()[field];
        let tree = Arc::new(QuadTree::build(surface));
        let range = tree.grid().range().unwrap_or(ValueRange { min: 0.0, max: 0.0 });
        let colors = match &args.colors {
            Some(path) => read_transfer(path).map_err(|source| ColorsFault { source })?,
            None => spectrum(range).map_err(OptionError::from)?,
        };
        Ok(Subject { tree, field: name.clone(), unit: unit.clone(), range, colors })
    }

    fn select(&self, args: &SurfaceArgs, camera: &Camera) -> Result<Selection, Failure> {
        let view = View::new(*camera, args.size).map_err(Failure::usage)?;
        if let Some(n_zones) = args.zones {
            let mut selector = BudgetSelector::new(self.tree.clone());
            selector.update(&view, n_zones as usize);
            let n_drawn = selector.selection().n_leaves();
            if n_drawn > n_zones as usize {
                eprintln!("note: --zones {n_zones}: {n_drawn} are drawn, for zones around holes cannot be coarse");
            }
            return Ok(selector.selection().clone());
        }
        // Zones below no number of pixels are the final ones.
        let mut selector = SizeSelector::new(self.tree.clone(), args.granularity.unwrap_or(f64::MIN_POSITIVE))
            .map_err(Failure::usage)?;
        selector.update(&view);
        Ok(selector.selection().clone())
    }

    fn title(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} ({unit})", self.field),
            None => self.field.clone(),
        }
    }
}

/// The zones of the plane that is asked for; terrain is a height field unless it is to be flat.
fn zones(grid: &StructuredGrid, field: usize, args: &SurfaceArgs) -> Result<CurvilinearGrid, Failure> {
    let plane = args.plane.unwrap_or(IndexPlane::Z(0));
    check_plane(grid, plane)?;
    let is_terrain =
        grid.n_nodes().z == 1 && plane == IndexPlane::Z(0) && matches!(grid.points(), GridPoints::Even { .. });
    match (is_terrain, args.exaggeration) {
        (true, exaggeration) => Ok(CurvilinearGrid::of_heights(grid, field, exaggeration.unwrap_or(1.0))?),
        (false, None) => Ok(CurvilinearGrid::of_plane(grid, plane, field)?),
        (false, Some(factor)) => Err(Failure::usage(NoHeights { factor })),
    }
}

fn attributes(
    args: &SurfaceArgs,
    subject: &Subject,
    selection: &Selection,
    plan: &MeshPlan,
) -> Vec<(&'static str, String)> {
    let file = args.input.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    vec![
        ("file", file),
        ("field", subject.field.clone()),
        ("zones", selection.n_leaves().to_string()),
        ("triangles", plan.mesh().triangles().len().to_string()),
        ("greatest error of a zone", selection.greatest_error(&subject.tree).to_string()),
    ]
}

fn summary(subject: &Subject, selection: &Selection, plan: &MeshPlan, frame: &MeshFrame, backend: &str) -> String {
    let grid = subject.tree.grid();
    let error = f64::from(selection.greatest_error(&subject.tree));
    let width = subject.range.max - subject.range.min;
    let percent = if width > 0.0 { 100.0 * error / width } else { 0.0 };
    format!(
        "{} x {} zones of {}, {} to {}; {} zones drawn, {} triangles, error at most {error} ({percent:.2} % of the range)\n\
         {backend}: {:.1} ms, upload {:.1} ms of {} KiB\n",
        grid.n_columns(),
        grid.n_rows(),
        subject.title(),
        subject.range.min,
        subject.range.max,
        selection.n_leaves(),
        plan.mesh().triangles().len(),
        frame.timing.device_ms.unwrap_or(frame.timing.wall_ms),
        frame.timing.upload_ms,
        frame.uploaded_bytes >> 10,
    )
}
