//! Figure 15: a part of the terrain, six times as large.

use std::sync::Arc;

use brickfield::curvilinear::BudgetSelector;
use brickfield_core::Image;

use super::WynnArgs;
use super::data::{terrains, timed_frame};
use crate::compare::rivals::Rivals;
use crate::metrics::{greatest_difference, median, share_beyond};
use crate::paper::{Missed, PaperError, print};

/// The paper's numbers of zones, and their error in %.
const PAPER: (usize, f64) = (7_956, 2.05);
const ZOOM: f64 = 6.0;
/// Two backends differ by the rounding of f32, the more the more a pixel holds: a quarter of a step of 8 bits. At outlines another
/// triangle may be drawn.
const ROUNDING: f64 = 1e-3;
const OUTLINES: f64 = 0.002;

pub(super) fn run(args: &WynnArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let mut missed = Vec::new();
    for terrain in terrains(args)? {
        let terrain = terrain?;
        let view = terrain.seen_from_above(args.common.size, ZOOM)?;
        let mut selector = BudgetSelector::new(Arc::clone(&terrain.tree));
        selector.update(&view, PAPER.0);
        let selection = selector.selection();
        let error = terrain.percent(selection.greatest_error(&terrain.tree).into());
        print(&format!(
            "{}: {} zones in view, error {error:.2} % (the paper, of other elevations: {} zones, {} %)",
            terrain.name,
            selection.n_leaves(),
            PAPER.0,
            PAPER.1
        ))?;
        let mut pictures: Vec<(&str, Image<f32>)> = Vec::new();
        for backend in &mut rivals.present {
            let mut times = Vec::new();
            let mut drawn = None;
            for _ in 0..=args.common.frames {
                let (_, frame, seconds) = timed_frame(backend.as_mut(), || terrain.plan(&view, selection, None))?;
                times.push(seconds * 1e3);
                drawn = Some(frame.image());
            }
            let name = backend.describe().backend;
            print(&format!("  {name:<5} {:.1} ms a frame", median(times.split_off(1))))?;
            pictures.extend(drawn.map(|image| (name, image)));
        }
        let Some(((_, first), others)) = pictures.split_first() else { continue };
        for (name, other) in others {
            missed.extend(other_picture(&terrain.name, name, first, other)?);
        }
        args.common.write_picture(
            &format!("wynn-zoom-{}", terrain.stem()),
            first,
            &format!("{}, six times as large", terrain.name),
        )?;
    }
    Ok(missed)
}

fn other_picture(
    data: &str,
    backend: &str,
    first: &Image<f32>,
    other: &Image<f32>,
) -> Result<Option<Missed>, PaperError> {
    let share = share_beyond(first, other, ROUNDING);
    print(&format!(
        "  {backend}: greatest difference from the first backend {:.1e}, {:.3} % of pixels above {ROUNDING:.0e}",
        greatest_difference(first, other),
        100.0 * share
    ))?;
    let what = format!("{data}: {:.2} % of the pixels of {backend} differ from the first backend's", 100.0 * share);
    Ok((share > OUTLINES).then(|| Missed::of_pictures(what)))
}
