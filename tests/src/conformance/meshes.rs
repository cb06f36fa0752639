//! Cases of meshes: a selection of a curvilinear grid, and how it is seen.

use std::sync::Arc;

use brickfield::cpu::{MeshAnswer, mesh_answer};
use brickfield::curvilinear::{CurvilinearGrid, Selection, SurrogateMesh, surrogate_mesh};
use brickfield::frame::{Coloring, MeshPlan, MeshView};
use brickfield::{SurfaceNormals, mesh_of};
use brickfield_core::Image;

use super::candidate::Candidate;
use super::case::Mutant;
use super::check::{Judged, failed};
use super::rule::{Complaint, Tolerance};

/// The surface of a case.
pub struct MeshTest {
    /// The grid.
    pub grid: CurvilinearGrid,
    /// The zones that are drawn.
    pub selection: Selection,
    /// How they are seen.
    pub view: MeshView,
    /// Where normals come from.
    pub normals: SurfaceNormals,
    /// Which pixels show the surface.
    pub covers: Covers,
}

/// Which pixels a surface covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Covers {
    /// Some.
    Part,
    /// All: a pixel without the surface is a crack.
    Everything,
    /// None.
    Nothing,
}

/// A mesh case's plan, its reference, and how far a picture may be from it.
pub(super) struct PreparedMesh {
    pub(super) test: MeshTest,
    pub(super) surrogate: SurrogateMesh,
    pub(super) plan: MeshPlan,
    pub(super) answer: MeshAnswer,
    tolerance: Tolerance,
}

impl MeshTest {
    /// The plan of other triangles of the grid, seen in another way.
    pub(super) fn plan(&self, surrogate: &SurrogateMesh, view: MeshView) -> MeshPlan {
        let mesh = mesh_of(&self.grid, surrogate, self.normals).expect("a case's mesh is small");
        MeshPlan::new(Arc::new(mesh), view).expect("a case's view is one")
    }
}

impl PreparedMesh {
    /// Makes the plan and its answer.
    ///
    /// # Errors
    /// A reference with cracks, or without anything.
    pub(super) fn of(test: MeshTest) -> Result<PreparedMesh, Complaint> {
        let surrogate = surrogate_mesh(&test.grid, &test.selection).expect("a case's selection is the grid's");
        let plan = test.plan(&surrogate, test.view.clone());
        let answer = mesh_answer(&plan);
        let n_bare = answer.pixels.pixels().iter().filter(|pixel| pixel[3] == 0.0).count();
        let n_pixels = answer.pixels.pixels().len();
        match test.covers {
            Covers::Everything if n_bare > 0 => return Err(Complaint::Cracks { n_bare, n_pixels }),
            Covers::Part if n_bare == 0 || n_bare == n_pixels => {
                return Err(Complaint::Blank { found: "all or nothing", stated: "a part" });
            }
            Covers::Nothing if n_bare < n_pixels => {
                return Err(Complaint::Blank { found: "something", stated: "nothing" });
            }
            Covers::Part | Covers::Everything | Covers::Nothing => {}
        }
        let tolerance = Tolerance::of_ambiguity(&answer.ambiguity);
        Ok(PreparedMesh { test, surrogate, plan, answer, tolerance })
    }

    pub(super) fn run(&self, on: &mut Candidate, mutant: Option<&Mutant>) -> Judged {
        let plan = match mutant {
            Some(Mutant::Mesh(mutant)) => mutant.apply(self),
            _ => self.plan.clone(),
        };
        let image = match on.render_mesh(&plan) {
            None => return Judged::Absent,
            Some(Err(e)) => return failed(e),
            Some(Ok(frame)) => in_reach(frame.pixels, self.plan.reach()),
        };
        let mut verdict = self.tolerance.judge(&image, &self.answer.pixels);
        let n_bare = image.pixels().iter().filter(|pixel| pixel[3] == 0.0).count();
        let cracks = Complaint::Cracks { n_bare, n_pixels: image.pixels().len() };
        let has_cracks = self.test.covers == Covers::Everything && n_bare > 0;
        verdict.complaint =
            verdict.complaint.or(has_cracks.then_some(cracks)).or_else(|| self.tolerance.empty_promise(mutant));
        Judged::Picture(image, verdict)
    }

    pub(super) fn describe(&self) -> String {
        let (size, n) = (self.plan.size(), self.plan.mesh().triangles().len());
        let coloring = match self.plan.coloring() {
            Coloring::Values => "values",
            Coloring::Gouraud => "Gouraud colours",
        };
        format!("{} x {} pixels, {n} triangles, {coloring}", size.x, size.y)
    }
}

/// Pixels with distances in units of a reach.
fn in_reach(mut pixels: Image<f32>, reach: f64) -> Image<f32> {
    for pixel in pixels.pixels_mut() {
        pixel[3] = (f64::from(pixel[3]) / reach) as f32;
    }
    pixels
}
