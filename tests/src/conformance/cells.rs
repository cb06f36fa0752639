//! Cases of curvilinear cells.

use std::sync::Arc;

use brickfield::cpu::{DiscreteCells, discrete_cells};
use brickfield::frame::{Cells, CellsPlan, CellsView, Sampling};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Image, Knot, TransferFunction};

use super::candidate::Candidate;
use super::case::{Mutant, Shows};
use super::check::{Judged, failed};
use super::rule::{Complaint, Tolerance};

/// The cells of a case, and how they are seen.
pub struct CellsTest {
    /// Cells along each axis; positions and values of their nodes, and which of them are holes.
    pub n_cells: UVec3,
    #[allow(missing_docs)]
    pub positions: Vec<DVec3>,
    #[allow(missing_docs)]
    pub values: Vec<f32>,
    #[allow(missing_docs)]
    pub holes: Option<Vec<bool>>,
    /// How they are seen.
    pub view: CellsView,
}

/// One thing wrong with the plan of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CellsMutant {
    /// The step is 5 % too large.
    StepScaled,
    /// Each node has the value of the next one.
    ValuesShifted,
    /// Holes are cells like others.
    HolesIgnored,
    /// The surface amid the cells hides nothing behind it.
    SurfaceIgnored,
    /// The surface is a tenth farther away.
    SurfaceBehind,
    /// A knot of the transfer function is moved.
    KnotMoved,
    /// A node in the middle is moved by a tenth of a cell.
    NodeMoved,
}

impl CellsMutant {
    /// All of them.
    pub const ALL: [CellsMutant; 7] = [
        CellsMutant::StepScaled,
        CellsMutant::ValuesShifted,
        CellsMutant::HolesIgnored,
        CellsMutant::SurfaceIgnored,
        CellsMutant::SurfaceBehind,
        CellsMutant::KnotMoved,
        CellsMutant::NodeMoved,
    ];

    /// The mutant's name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            CellsMutant::StepScaled => "cells/step-scaled",
            CellsMutant::ValuesShifted => "cells/values-shifted",
            CellsMutant::HolesIgnored => "cells/holes-ignored",
            CellsMutant::SurfaceIgnored => "cells/surface-ignored",
            CellsMutant::SurfaceBehind => "cells/surface-behind",
            CellsMutant::KnotMoved => "cells/knot-moved",
            CellsMutant::NodeMoved => "cells/node-moved",
        }
    }

    /// The plan with this thing wrong.
    fn apply(self, test: &CellsTest) -> CellsPlan {
        let CellsTest { n_cells, positions, values, holes, view } = test;
        let (mut positions, mut values, mut view) = (positions.clone(), values.clone(), view.clone());
        let mut holes = holes.clone();
        match self {
            CellsMutant::StepScaled => view.sampling = scaled(&view.sampling, 1.05),
            CellsMutant::ValuesShifted => values.rotate_left(1),
            CellsMutant::HolesIgnored => holes = None,
            CellsMutant::SurfaceIgnored => view.behind = None,
            CellsMutant::SurfaceBehind => view.behind = view.behind.map(|image| Arc::new(farther(&image))),
            CellsMutant::KnotMoved => view.transfer = moved(&view.transfer),
            CellsMutant::NodeMoved => {
                let middle = positions.len() / 2;
                positions[middle] = positions[middle].lerp(positions[middle + 1], 0.1);
            }
        }
        plan(*n_cells, &positions, &values, holes.as_deref(), view)
    }
}

fn plan(n_cells: UVec3, positions: &[DVec3], values: &[f32], holes: Option<&[bool]>, view: CellsView) -> CellsPlan {
    let cells = Cells::new(n_cells, positions, values, holes).expect("a case's cells are sound");
    CellsPlan::new(Arc::new(cells), view).expect("a case's view is one")
}

fn scaled(sampling: &Sampling, by: f64) -> Sampling {
    Sampling::new(sampling.step_world() * by, sampling.rule(), sampling.mode()).expect("a step above 0")
}

fn farther(image: &Image<f32>) -> Image<f32> {
    let mut image = image.clone();
    image.pixels_mut().iter_mut().for_each(|pixel| pixel[3] *= 1.1);
    image
}

fn moved(transfer: &TransferFunction) -> TransferFunction {
    let mut knots: Vec<Knot> = transfer.knots().to_vec();
    let i = knots.len() / 2;
    let room = knots[i].value - knots[i - 1].value;
    knots[i].value -= 0.1 * room;
    TransferFunction::new(knots).expect("knots stay in order")
}

/// A case's plan, its reference, and how far a picture may be from it.
pub(super) struct PreparedCells {
    test: CellsTest,
    plan: CellsPlan,
    pub(super) reference: DiscreteCells,
    tolerance: Tolerance,
}

impl PreparedCells {
    /// Makes the plan and its answer.
    ///
    /// # Errors
    /// A reference that shows nothing.
    pub(super) fn of(test: CellsTest) -> Result<PreparedCells, Complaint> {
        let CellsTest { n_cells, positions, values, holes, view } = &test;
        let plan = plan(*n_cells, positions, values, holes.as_deref(), view.clone());
        let reference = discrete_cells(&plan);
        if reference.n_samples == 0 {
            return Err(Complaint::Blank { found: Shows::Nothing.name(), stated: Shows::Something.name() });
        }
        let tolerance = Tolerance::of_ambiguity(&reference.ambiguity);
        Ok(PreparedCells { test, plan, reference, tolerance })
    }

    pub(super) fn run(&self, on: &mut Candidate, mutant: Option<&Mutant>) -> Judged {
        let plan = match mutant {
            Some(Mutant::Cells(mutant)) => mutant.apply(&self.test),
            _ => self.plan.clone(),
        };
        let image = match on.render_cells(&plan) {
            None => return Judged::Absent,
            Some(Err(e)) => return failed(e),
            Some(Ok(image)) => image,
        };
        let mut verdict = self.tolerance.judge(&image, &self.reference.image);
        verdict.complaint = verdict.complaint.or_else(|| self.tolerance.empty_promise(mutant));
        Judged::Picture(image, verdict)
    }

    pub(super) fn describe(&self) -> String {
        let (size, n, sampling) = (self.plan.size(), self.plan.cells().n_cells(), self.plan.sampling());
        let (rule, mode) = (sampling.rule().name(), sampling.mode().name());
        format!("{} x {} pixels, {} x {} x {} cells, {rule}, {mode}", size.x, size.y, n.x, n.y, n.z)
    }
}
