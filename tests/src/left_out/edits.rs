//! How long frames wait for a compiler after an edit that needs another shader.

use std::time::Instant;

use brickfield::frame::{Backend, FramePlan, ShaderChoice};
use brickfield_core::{Image, Knot, TransferFunction};
use serde::Serialize;

use super::{LeftOutArgs, open};
use crate::metrics::median;
use crate::paper::{PaperError, frame_of, print};

/// Frames after an edit.
const N_FRAMES: usize = 16;
/// Sessions of each choice, which take turns.
const N_SESSIONS: usize = 3;

/// Edits with a choice of shaders on a backend.
#[derive(Clone, Debug, Serialize)]
pub(super) struct EditsRow {
    backend: &'static str,
    choice: &'static str,
    /// For each edit of each session, the first frame after it over the median of the frames that follow, in milliseconds; and the longest one.
    first_ms: Vec<f64>,
    longest_ms: Vec<f64>,
    /// Of all frames, those that a general shader drew.
    n_general: usize,
    n_frames: usize,
    is_equal: bool,
}

/// Transfer functions that look alike: ever more knots on the same lines, so that each needs another search.
pub(super) fn finer_and_finer(transfer: &TransferFunction) -> Vec<TransferFunction> {
    let cut = |n: usize| {
        let between = |pair: &[Knot]| {
            let [low, high] = [pair[0], pair[1]];
            let on_line = move |i: usize| {
                let f = i as f64 / n as f64;
                let mix = |a: f64, b: f64| a + (b - a) * f;
                let color = std::array::from_fn(|c| mix(low.color[c], high.color[c]));
                Knot { value: mix(low.value, high.value), extinction: mix(low.extinction, high.extinction), color }
            };
            (0..if low.value < high.value { n } else { 1 }).map(on_line).collect::<Vec<_>>()
        };
        let knots = transfer.knots();
        let all = knots.windows(2).flat_map(between).chain(knots.last().copied()).collect();
        TransferFunction::new(all).expect("knots on the lines between knots")
    };
    [1, 2, 4, 8, 16, 32].map(cut).to_vec()
}

/// Draws the plans of a session of edits with each choice on each backend that has shaders.
pub(super) fn edits(
    args: &LeftOutArgs,
    backends: &[&'static str],
    plans: &[FramePlan],
) -> Result<Vec<EditsRow>, PaperError> {
    print(&format!(
        "\n{} edits, each with another shader, {N_FRAMES} frames after each, {N_SESSIONS} sessions, backends new each time. Wait: the first frame after an edit, and the longest one, over the median of the\n\
         frames that follow: median and greatest of the edits but the first, for which every session waits.",
        plans.len()
    ))?;
    let mut rows = Vec::new();
    for name in backends {
        let choices = [(ShaderChoice::Own, "own"), (ShaderChoice::Quickest, "quickest")];
        let mut of_backend = choices.map(|(_, choice)| EditsRow {
            backend: name,
            choice,
            first_ms: Vec::new(),
            longest_ms: Vec::new(),
            n_general: 0,
            n_frames: 0,
            is_equal: true,
        });
        let mut expected: Vec<Option<Image<f32>>> = vec![None; plans.len()];
        for _ in 0..N_SESSIONS {
            for ((choice, _), row) in choices.iter().zip(&mut of_backend) {
                let mut backend = open(args, name)?;
                backend.choose_shaders(*choice);
                session(backend.as_mut(), plans, &mut expected, row)?;
            }
        }
        for row in of_backend {
            print(&row.line())?;
            rows.push(row);
        }
    }
    Ok(rows)
}

fn session(
    backend: &mut dyn Backend,
    plans: &[FramePlan],
    expected: &mut [Option<Image<f32>>],
    row: &mut EditsRow,
) -> Result<(), PaperError> {
    for (edit, (plan, expected)) in plans.iter().zip(expected).enumerate() {
        let mut ms = Vec::new();
        for _ in 0..N_FRAMES {
            let begin = Instant::now();
            let frame = frame_of(backend, plan)?;
            ms.push(begin.elapsed().as_secs_f64() * 1e3);
            row.n_general += usize::from(frame.is_general);
            row.n_frames += 1;
            row.is_equal &= *expected.get_or_insert_with(|| frame.image.clone()) == frame.image;
        }
        if edit > 0 {
            let usual = median(ms[1..].to_vec());
            row.first_ms.push(ms[0] - usual);
            row.longest_ms.push(ms.iter().copied().fold(0.0, f64::max) - usual);
        }
    }
    Ok(())
}

impl EditsRow {
    /// What is wrong with the pictures.
    pub(super) fn complaint(&self) -> Option<String> {
        let of = format!("edits, {}, {}", self.backend, self.choice);
        let is_general_expected = self.choice == "quickest";
        if !self.is_equal {
            return Some(format!("{of}: pictures differ"));
        }
        (is_general_expected != (self.n_general > 0))
            .then(|| format!("{of}: {} frames by a general shader", self.n_general))
    }

    fn line(&self) -> String {
        let of = |ms: &[f64]| {
            let greatest = ms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            format!("{:>6.1} (most {:>6.1})", median(ms.to_vec()), greatest)
        };
        format!(
            "{:<5} {:<9} wait of the first frame {} ms, of the longest {} ms; {} of {} frames by the general shader; {}",
            self.backend,
            self.choice,
            of(&self.first_ms),
            of(&self.longest_ms),
            self.n_general,
            self.n_frames,
            if self.is_equal { "all pictures equal to the bit" } else { "pictures differ" },
        )
    }
}
