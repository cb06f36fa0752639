//! Terrains, how they are seen, and how they are drawn.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use brickfield::curvilinear::{CurvilinearGrid, QuadTree, Selection, View};
use brickfield::frame::{Backend, Coloring, MeshFrame, MeshLines, MeshPlan, MeshView};
use brickfield::io::{GridOptions, open_grid};
use brickfield::{SurfaceNormals, spectrum, surface_mesh};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Projection, TransferFunction, ValueRange};

use super::WynnArgs;
use crate::paper::PaperError;

/// The terrains, as paths below the folder of real data.
const DATA: [&str; 2] = ["dem/N00E010.hgt", "dem/SainteHelens.dem"];

/// A surface with its hierarchy.
pub(super) struct Terrain {
    pub(super) name: String,
    pub(super) tree: Arc<QuadTree>,
    pub(super) range: ValueRange,
    pub(super) colors: TransferFunction,
}

/// Whether the data that the parts need are there.
pub(super) fn check_data(args: &WynnArgs) -> Result<(), PaperError> {
    args.common.check_data(&DATA, args.parts().into_iter().any(|part| part.needs_data()))
}

/// The terrains that are asked for, one by one.
pub(super) fn terrains(args: &WynnArgs) -> Result<impl Iterator<Item = Result<Terrain, PaperError>>, PaperError> {
    Ok(args.common.named(&DATA)?.into_iter().map(|(name, path)| Terrain::of_file(name, &path)))
}

impl Terrain {
    fn of_file(name: String, path: &Path) -> Result<Terrain, PaperError> {
        let grids = open_grid(path, &GridOptions::default())?.grids;
        let not_terrain = || PaperError::NotTerrain { path: path.to_owned() };
        let grid = grids.first().ok_or_else(not_terrain)?;
        Ok(Terrain::new(name, CurvilinearGrid::of_heights(grid, 0, 1.0).map_err(|_| not_terrain())?))
    }

    pub(super) fn new(name: String, grid: CurvilinearGrid) -> Terrain {
        let range = grid.range().unwrap_or(ValueRange { min: 0.0, max: 0.0 });
        let colors = spectrum(range).expect("values are finite");
        Terrain { name, tree: Arc::new(QuadTree::build(grid)), range, colors }
    }

    /// The name in names of pictures.
    pub(super) fn stem(&self) -> String {
        self.name.rsplit('/').next().unwrap_or(&self.name).replace('.', "-")
    }

    /// An error in per cent of the values' range.
    pub(super) fn percent(&self, error: f64) -> f64 {
        100.0 * error / (self.range.max - self.range.min)
    }

    /// All of it from above, by parallel rays, in a square picture; `zoom` times as large, its middle in the middle.
    pub(super) fn seen_from_above(&self, size: UVec2, zoom: f64) -> Result<View, PaperError> {
        let extent = self.tree.extent(self.tree.layout().root());
        let (middle, around) = (extent.center(), extent.extent());
        let height = around.x.max(around.y) * 1.02 / zoom;
        let eye = middle + DVec3::Z * around.length();
        let camera = Camera::look_at(eye, middle, DVec3::Y, Projection::Orthographic { height })?;
        Ok(View::new(camera, size).expect("a picture has pixels"))
    }

    /// How a selection is drawn for a view.
    pub(super) fn plan(
        &self,
        view: &View,
        selection: &Selection,
        lines: Option<MeshLines>,
    ) -> Result<MeshPlan, PaperError> {
        let mesh = surface_mesh(self.tree.grid(), selection, SurfaceNormals::Triangles)?;
        let view = MeshView {
            camera: *view.camera(),
            size: view.size(),
            colors: self.colors.clone(),
            // As in the paper.
            coloring: Coloring::Gouraud,
            light: None,
            lines,
        };
        Ok(MeshPlan::new(Arc::new(mesh), view).expect("a picture has pixels, and lines have a width"))
    }
}

/// A frame of a mesh, and the seconds from the selection to the picture.
pub(super) fn timed_frame(
    backend: &mut dyn Backend,
    plan: impl FnOnce() -> Result<MeshPlan, PaperError>,
) -> Result<(MeshPlan, MeshFrame, f64), PaperError> {
    let begin = Instant::now();
    let plan = plan()?;
    let name = backend.describe().backend;
    let frame = backend.render_mesh(&plan).map_err(|source| PaperError::Render { backend: name, source })?;
    Ok((plan, frame, begin.elapsed().as_secs_f64()))
}
