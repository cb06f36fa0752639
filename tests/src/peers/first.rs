//! From a file to the first picture: a new process each time, so that nothing is read, built or compiled before.
//!
//! The file is in the system's cache, and drivers may have kept compiled shaders on disk: a round that is not timed comes first.
//! Its pictures are held to the answers.

use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::answers::Answers;
use super::lineup::{Exhibit, Lineup, Who};
use super::measure::{ContestantInfo, contestants};
use super::process::Contestant;
use super::protocol::{Drawing, Part};
use super::scenes::Subject;
use super::{PeersArgs, PeersError, table};
use crate::turns::{Spread, take_turns};

/// What a process does before it has a file to read: Python's modules, say.
const BEFORE_THE_FILE: &str = "import";

/// First pictures of a scene.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct FirstReport {
    pub name: String,
    pub dims: [u32; 3],
    pub scalar: String,
    pub step_voxels: f64,
    pub pictures: Vec<FirstPicture>,
    /// Who did not take part, or did not every time.
    pub absent: Vec<ContestantInfo>,
}

/// A contestant's first pictures, in milliseconds.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct FirstPicture {
    pub contestant: String,
    /// From the file to the picture.
    pub wall: Spread,
    pub cpu: Spread,
    /// From the start of the process to the picture.
    pub process: Spread,
    pub n_processes: usize,
    /// Of the picture, over all pixels and three colour channels, against the answer of its domain.
    pub rmse: f64,
    /// In their order; those of the frame where they are known, else `frame`.
    pub parts: Vec<(String, Spread)>,
}

/// A contestant's processes.
#[derive(Default)]
struct Runs {
    rmse: f64,
    timed: Vec<Run>,
}

/// One process.
struct Run {
    parts: Vec<Part>,
    wall_ms: f64,
    cpu_ms: f64,
    process_ms: f64,
}

/// Measures a scene at the first of the steps.
pub(super) fn first(
    args: &PeersArgs,
    lineup: &Lineup,
    subject: Subject,
    say: &mut dyn FnMut(&str),
) -> Result<FirstReport, PeersError> {
    let exhibit = Exhibit::new(args, subject)?;
    // Who is there at all; the processes end here.
    let infos = contestants(args, lineup, &exhibit)?.1;
    let (mut present, mut absent): (Vec<_>, Vec<_>) = infos.into_iter().partition(|info| info.absent.is_none());
    let mut runs: Vec<Runs> = present.iter().map(|_| Runs::default()).collect();
    let mut answers = Answers::new(&exhibit.subject, args.view.size);
    let drawing = exhibit.drawing(args.steps[0], 0.0);
    take_turns::<PeersError>(present.len(), args.frames, |turn| {
        let (info, runs) = (&mut present[turn.contestant], &mut runs[turn.contestant]);
        if info.absent.is_some() {
            return Ok(f64::NAN);
        }
        let done = if turn.warms_up() {
            error(&exhibit, lineup, info.who, drawing, &mut answers)?.map(|rmse| runs.rmse = rmse)
        } else {
            run(&exhibit, lineup, info.who, drawing)?.and_then(|run| runs.add(run))
        };
        info.absent = done.err();
        Ok(runs.timed.last().map_or(f64::NAN, |run| run.wall_ms))
    })?;
    let (mut pictures, volume) = (Vec::new(), &exhibit.subject.volume);
    for (info, runs) in present.into_iter().zip(runs) {
        match info.absent {
            None => pictures.push(picture(info.name, &runs)),
            Some(_) => absent.push(info),
        }
    }
    let report = FirstReport {
        name: exhibit.subject.name.clone(),
        dims: volume.grid().dims().to_array(),
        scalar: volume.scalar_type().to_string(),
        step_voxels: drawing.step_voxels,
        pictures,
        absent,
    };
    say(&table::first(&report));
    Ok(report)
}

impl Runs {
    /// The error: processes of a contestant do the same.
    fn add(&mut self, run: Run) -> Result<(), String> {
        let names = |run: &Run| run.parts.iter().map(|part| part.name.clone()).collect::<Vec<_>>();
        if let Some(before) = self.timed.first().filter(|before| names(before) != names(&run)) {
            return Err(format!("its parts were {:?}, and now are {:?}", names(before), names(&run)));
        }
        self.timed.push(run);
        Ok(())
    }
}

/// The error of the picture of a process that is not timed. The inner error says why there is none.
fn error(
    exhibit: &Exhibit,
    lineup: &Lineup,
    who: Who,
    drawing: Drawing,
    answers: &mut Answers,
) -> Result<Result<f64, String>, PeersError> {
    let picture = exhibit.folder.path().join("first.f32");
    let mut rmse = |mut contestant: Contestant, picture: &Path| {
        contestant.picture(drawing, picture)?;
        answers.rmse(picture, &contestant.opened)
    };
    Ok(exhibit.open(lineup, who)?.and_then(|contestant| rmse(contestant, &picture)))
}

/// A process from its start to its first picture. The inner error says why there is none.
fn run(exhibit: &Exhibit, lineup: &Lineup, who: Who, drawing: Drawing) -> Result<Result<Run, String>, PeersError> {
    let begin = Instant::now();
    let mut contestant = match exhibit.open(lineup, who)? {
        Ok(contestant) => contestant,
        Err(reason) => return Ok(Err(reason)),
    };
    let drawn = match contestant.frame(drawing) {
        Ok(drawn) => drawn,
        Err(reason) => return Ok(Err(reason)),
    };
    let process_ms = begin.elapsed().as_secs_f64() * 1e3;
    let once = contestant.opened.phases.iter().filter(|part| part.name != BEFORE_THE_FILE);
    let wall_ms = once.clone().map(|part| part.wall_ms).sum::<f64>() + drawn.wall_ms;
    let cpu_ms = once.filter_map(|part| part.cpu_ms).sum::<f64>() + drawn.cpu_ms;
    let frame = Part { name: "frame".to_owned(), wall_ms: drawn.wall_ms, cpu_ms: Some(drawn.cpu_ms) };
    let parts = if drawn.parts.is_empty() { vec![frame] } else { drawn.parts };
    let parts = contestant.opened.phases.iter().cloned().chain(parts).collect();
    Ok(Ok(Run { parts, wall_ms, cpu_ms, process_ms }))
}

fn picture(contestant: String, Runs { rmse, timed: runs }: &Runs) -> FirstPicture {
    let of = |ms: &dyn Fn(&Run) -> f64| Spread::of(&runs.iter().map(ms).collect::<Vec<_>>());
    let part = |i: usize| (runs[0].parts[i].name.clone(), of(&|run| run.parts[i].wall_ms));
    FirstPicture {
        contestant,
        wall: of(&|run| run.wall_ms),
        cpu: of(&|run| run.cpu_ms),
        process: of(&|run| run.process_ms),
        n_processes: runs.len(),
        rmse: *rmse,
        parts: (0..runs[0].parts.len()).map(part).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_first_pictures_are_medians_over_processes() {
        let run = |ms: f64| Run {
            parts: vec![Part { name: "read".to_owned(), wall_ms: 0.1 * ms, cpu_ms: None }],
            wall_ms: ms,
            cpu_ms: 2.0 * ms,
            process_ms: 3.0 * ms,
        };
        let mut runs = Runs { rmse: 1e-3, timed: Vec::new() };
        [10.0, 40.0, 20.0].into_iter().for_each(|ms| runs.add(run(ms)).unwrap());
        let found = picture("vispy".to_owned(), &runs);
        assert_eq!((found.wall.median, found.cpu.median, found.process.max), (20.0, 40.0, 120.0));
        assert_eq!((found.n_processes, found.parts[0].0.as_str(), found.parts[0].1.median), (3, "read", 2.0));
        let other = Run { parts: Vec::new(), ..run(10.0) };
        assert_eq!(runs.add(other).unwrap_err(), "its parts were [\"read\"], and now are []");
    }
}
