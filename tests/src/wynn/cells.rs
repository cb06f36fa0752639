//! Three dimensions: cells as a volume, planes of the grid as surfaces, and both in one picture.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use brickfield::curvilinear::{CurvilinearGrid, IndexPlane};
use brickfield::frame::{
    Backend, Cells, CellsPlan, CellsView, Coloring, MeshLines, MeshPlan, MeshView, Mode, QuadratureRule, RenderError,
    Sampling,
};
use brickfield::io::{GridOptions, open_grid};
use brickfield::optics::Preset;
use brickfield::{SurfaceNormals, joined_mesh, spectrum};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Image, StructuredGrid, ValueRange};
use serde::Serialize;

use super::WynnArgs;
use crate::compare::rivals::Rivals;
use crate::memory::cpu_seconds;
use crate::metrics::{greatest_difference, median, share_beyond};
use crate::paper::{Missed, PaperError, data_sets, print};

/// A grid of PLOT3D, as paths below the folder of real data.
struct DataSet {
    grid: &'static str,
    values: &'static str,
    /// CPU seconds of VTK 9.7.2 for a picture of 512 x 512, by its unstructured ray cast and by projected tetrahedra, measured on a machine like
    /// this project's.
    vtk: [f64; 2],
}

const DATA: [DataSet; 2] = [
    DataSet { grid: "curvilinear/bluntfinxyz.bin", values: "curvilinear/bluntfinq.bin", vtk: [2.08, 1.51] },
    DataSet { grid: "curvilinear/combxyz.bin", values: "curvilinear/combq.bin", vtk: [2.56, 1.71] },
];
const SIZE: UVec2 = UVec2::new(512, 512);
/// Steps along the diagonal of the box around all cells.
const STEPS: f64 = 200.0;
/// Two backends differ by the roundings of f32; where planes end, another triangle may be drawn.
const ROUNDING: f64 = 1e-4;
const OUTLINES: f64 = 0.005;

/// A picture on a backend.
#[derive(Clone, Debug, Serialize)]
struct CellsRow {
    data: String,
    picture: &'static str,
    backend: &'static str,
    /// From the plan to the picture.
    ms: f64,
    /// Of all threads; `None` where the system does not tell.
    cpu_seconds: Option<f64>,
    /// The greatest difference of a channel from the first backend's picture, and the share of pixels that differ by more than 1e-4.
    difference: f64,
    differing: f64,
}

/// A grid that is ready to be drawn.
struct Subject {
    name: String,
    vtk: [f64; 2],
    camera: Camera,
    /// The surfaces.
    planes: MeshPlan,
    cells: Arc<Cells>,
}

/// Whether the data are there.
pub(super) fn check_data(args: &WynnArgs) -> Result<(), PaperError> {
    let missing = files(args)?.into_iter().flat_map(|f| [f.grid, f.values]).find(|path| !path.exists());
    missing.map_or(Ok(()), |path| Err(PaperError::NoVolume { path }))
}

pub(super) fn run(args: &WynnArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, {STEPS} steps along the diagonal, midpoint, exact. Medians of {} frames; CPU seconds of all threads. VTK 9.7.2: a picture of the same size and data, with a\n\
         camera and colours of its own.\n",
        SIZE.x, SIZE.y, args.common.frames
    ))?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for files in files(args)? {
        let subject = Subject::open(files)?;
        let (n, range) = (subject.cells.n_cells(), subject.cells.range());
        print(&format!(
            "{}: {} x {} x {} cells, {} to {}; VTK: ray cast {} s, projected tetrahedra {} s of CPU",
            subject.name, n.x, n.y, n.z, range.min, range.max, subject.vtk[0], subject.vtk[1]
        ))?;
        for picture in Picture::ALL {
            let mut first: Option<Image<f32>> = None;
            for backend in &mut rivals.present {
                let (image, row) = subject.draw(args, picture, backend.as_mut(), first.as_ref())?;
                print(&line(&row, subject.vtk))?;
                if row.differing > OUTLINES {
                    let what = format!(
                        "{}, {}: {:.2} % of the pixels of {} differ",
                        row.data,
                        row.picture,
                        100.0 * row.differing,
                        row.backend
                    );
                    missed.push(Missed::of_pictures(what));
                }
                let stem =
                    subject.name.rsplit('/').next().unwrap_or(&subject.name).trim_end_matches("xyz.bin").to_owned();
                args.common.write_picture(
                    &format!("wynn-{stem}-{}-{}", row.picture, row.backend),
                    &image,
                    &row.data,
                )?;
                first.get_or_insert(image);
                rows.push(row);
            }
        }
    }
    args.common.write_rows("cells.json", &rows)?;
    Ok(missed)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Picture {
    Volume,
    Surfaces,
    Both,
}

impl Picture {
    const ALL: [Picture; 3] = [Picture::Volume, Picture::Surfaces, Picture::Both];

    const fn name(self) -> &'static str {
        match self {
            Picture::Volume => "volume",
            Picture::Surfaces => "surfaces",
            Picture::Both => "both",
        }
    }
}

/// A data set's files.
struct Files {
    name: String,
    grid: PathBuf,
    values: PathBuf,
    vtk: [f64; 2],
}

fn files(args: &WynnArgs) -> Result<Vec<Files>, PaperError> {
    let folder = args.common.data.as_ref();
    let named = data_sets(folder, args.common.only.as_deref(), &DATA.map(|set| set.grid))?;
    let with_values = |(name, grid): (String, PathBuf)| {
        let DataSet { values, vtk, .. } = DATA.into_iter().find(|set| set.grid == name)?;
        Some(Files { name, grid, values: folder?.join(values), vtk })
    };
    Ok(named.into_iter().filter_map(with_values).collect())
}

impl Subject {
    fn open(files: Files) -> Result<Subject, PaperError> {
        let mut options = GridOptions::default();
        options.solution = Some(files.values);
        let grid = open_grid(&files.grid, &options)?.grids.swap_remove(0);
        let cells = Arc::new(Cells::of_grid(&grid, 0)?);
        let camera = Camera::framing(&cells.extent(), DVec3::new(0.6, -1.0, 0.5), DVec3::Z)?;
        let planes = planes(&grid, cells.range(), camera)?;
        Ok(Subject { name: files.name, vtk: files.vtk, camera, planes, cells })
    }

    fn draw(
        &self,
        args: &WynnArgs,
        picture: Picture,
        backend: &mut dyn Backend,
        first: Option<&Image<f32>>,
    ) -> Result<(Image<f32>, CellsRow), PaperError> {
        let name = backend.describe().backend;
        let fault = |source: RenderError| PaperError::Render { backend: name, source };
        let (mut ms, mut seconds, mut image) = (Vec::new(), Vec::new(), None);
        for _ in 0..=args.common.frames {
            let (begin, cpu) = (Instant::now(), cpu_seconds());
            let behind = match picture {
                Picture::Volume => None,
                Picture::Surfaces | Picture::Both => Some(backend.render_mesh(&self.planes).map_err(fault)?),
            };
            image = Some(match (picture, behind) {
                (Picture::Surfaces, Some(frame)) => frame.image(),
                (_, behind) => {
                    let plan = self.volume(behind.map(|frame| Arc::new(frame.pixels)))?;
                    backend.render_cells(&plan).map_err(fault)?.image
                }
            });
            ms.push(begin.elapsed().as_secs_f64() * 1e3);
            seconds.extend(cpu_seconds().zip(cpu).map(|(after, before)| after - before));
        }
        let image = image.expect("at least one frame");
        let row = CellsRow {
            data: self.name.clone(),
            picture: picture.name(),
            backend: name,
            ms: median(ms.split_off(1)),
            cpu_seconds: (seconds.len() > 1).then(|| median(seconds.split_off(1))),
            difference: first.map_or(0.0, |first| greatest_difference(first, &image)),
            differing: first.map_or(0.0, |first| share_beyond(first, &image, ROUNDING)),
        };
        Ok((image, row))
    }

    fn volume(&self, behind: Option<Arc<Image<f32>>>) -> Result<CellsPlan, PaperError> {
        let length = self.cells.extent().diagonal();
        let transfer = Preset::from_name("linear")
            .expect("a preset")
            .transfer(self.cells.range(), length)
            .expect("a finite range");
        let sampling = Sampling::new(length / STEPS, QuadratureRule::MidpointExponential, Mode::Exact).expect("a step");
        let view = CellsView { camera: self.camera, size: SIZE, sampling, transfer, behind };
        Ok(CellsPlan::new(Arc::clone(&self.cells), view)?)
    }
}

/// The planes at a third of the grid along i and k, with their outlines.
fn planes(grid: &StructuredGrid, range: ValueRange, camera: Camera) -> Result<MeshPlan, PaperError> {
    let n = grid.n_nodes();
    let planes = [IndexPlane::X(n.x / 3), IndexPlane::Z(n.z / 3)];
    let grids = planes.map(|plane| CurvilinearGrid::of_plane(grid, plane, 0).expect("a plane of the grid"));
    let view = MeshView {
        camera,
        size: SIZE,
        colors: spectrum(range).expect("values are finite"),
        coloring: Coloring::Values,
        light: None,
        lines: Some(MeshLines { width: 0.7, color: [0.0; 3] }),
    };
    let mesh = joined_mesh(grids, SurfaceNormals::Triangles)?;
    Ok(MeshPlan::new(Arc::new(mesh), view).expect("a picture has pixels, and lines have a width"))
}

fn line(row: &CellsRow, vtk: [f64; 2]) -> String {
    let seconds = match row.cpu_seconds {
        Some(seconds) if row.picture == Picture::Volume.name() => {
            format!("{seconds:.2} s of CPU, {:.2} and {:.2} of VTK's", seconds / vtk[0], seconds / vtk[1])
        }
        Some(seconds) => format!("{seconds:.2} s of CPU"),
        None => "CPU unknown".to_owned(),
    };
    format!(
        "  {:<8} {:<5} {:>8.1} ms, {seconds}; greatest difference from the first backend {:.1e}, {:.3} % of pixels above {ROUNDING:.0e}",
        row.picture,
        row.backend,
        row.ms,
        row.difference,
        100.0 * row.differing
    )
}
