//! One measurement of a GPU: conformance, the error of fast mode, its speed, and that speed against the rate of its texture units.
//!
//! For a machine with a card and without a toolchain: the program `gpu` needs no file beside it. A measurement that finds no time or no
//! memory is left out and listed; nothing else is.
//!
//! - [`measure`]: all parts, one after the other, into a [`GpuReport`].
//! - [`table`]: reports as rows of README.md.

mod budget;
mod contest;
mod date;
mod devices;
mod errors;
mod hold;
mod phantoms;
mod report;
mod steady;
mod table;
mod texture;

use std::path::PathBuf;
use std::time::Instant;

use budget::{Budget, Deadline};
use phantoms::Phantoms;

pub use budget::Unmeasured;
pub use devices::DeviceInfo;
pub use report::{
    CaseCounts, Conformance, FilterBits, GPU_FORMAT, GpuReport, ModeError, Part, Steady, TextureRate, Times, Versions,
    VolumeInfo,
};
pub use table::table;

use crate::report::Machine;

/// The measurement that is asked for.
#[derive(Clone, Debug)]
pub struct GpuArgs {
    /// How much.
    pub form: Form,
    /// In how many seconds, about.
    pub seconds: f64,
    /// A part of the adapter's name, or its number; `None` is each backend's choice.
    pub adapter: Option<String>,
    /// The folder of real volumes.
    pub data: Option<PathBuf>,
    /// The commit, where git does not tell.
    pub commit: Option<String>,
    /// Where pictures of failing cases go.
    pub pictures: PathBuf,
}

/// How much is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// Little, for a software driver: whether the program works.
    Short,
    /// As much as a card is worth.
    #[default]
    Long,
}

/// How large everything is.
struct Sizes {
    /// Voxels along a side and pixels along a side.
    errors: (u32, u32),
    contest: (u32, u32),
    /// Voxels along a side.
    octree: u32,
    steady: &'static [u32],
    /// Pixels along a side of steady frames; most rays along a side of texture reads.
    pixels: u32,
    /// Runs of texture reads.
    runs: usize,
}

impl Form {
    /// The name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Form::Short => "short",
            Form::Long => "long",
        }
    }

    /// About so many seconds are asked for unless the caller says more or fewer.
    pub const fn seconds(self) -> f64 {
        match self {
            Form::Short => 60.0,
            Form::Long => 450.0,
        }
    }

    const fn sizes(self) -> Sizes {
        match self {
            Form::Short => {
                Sizes { errors: (40, 64), contest: (64, 128), octree: 128, steady: &[64, 128], pixels: 128, runs: 2 }
            }
            Form::Long => Sizes {
                errors: (96, 128),
                contest: (256, 512),
                octree: 512,
                steady: &[256, 512, 1024],
                pixels: 512,
                runs: 5,
            },
        }
    }
}

/// The results of a part, the measurements that it left out, and a line for each of these.
struct PartResult<T> {
    found: T,
    left_out: Vec<Unmeasured>,
    line: String,
}

/// Shares of the time at which parts must end: the time that a part leaves goes to the next ones.
const CONFORMANCE: f64 = 0.3;
const ERRORS: f64 = 0.4;
const CONTEST: f64 = 0.55;
const ALL: f64 = 0.97;

/// Measures everything; `say` gets a line for each part.
pub fn measure(args: &GpuArgs, say: &mut dyn FnMut(&str)) -> GpuReport {
    let budget = Budget::new(args.seconds);
    let adapter = args.adapter.as_deref();
    let (mut devices, infos) = devices::open(adapter);
    infos.iter().for_each(|info| say(&describe(info)));
    let mut parts = Parts { budget, done: Vec::new(), say };
    let (date, memory_bytes) = (date::now(), crate::memory::available());
    let (mut failures, mut phantoms) = (Vec::new(), Phantoms::default());
    let conformance = parts.run("conformance", CONFORMANCE, |deadline| {
        hold::hold(args.form, adapter, &args.pictures, deadline, &mut failures)
    });
    let errors =
        parts.run("errors", ERRORS, |deadline| errors::errors(args.form, &mut devices, deadline, &mut failures));
    let filters = parts.run("filters", ERRORS, |_| errors::filters(&mut devices));
    let (contest, octree_mvoxels_per_s) = parts.run("contest", CONTEST, |deadline| {
        contest::contest(args.form, adapter, args.data.as_deref(), &mut phantoms, deadline)
    });
    let steady = parts.run("steady frames and texture reads", ALL, |deadline| {
        steady::steady(args.form, &mut devices, &mut phantoms, deadline, &mut failures)
    });
    GpuReport {
        format: GPU_FORMAT,
        date,
        form: args.form.name().to_owned(),
        seconds_allowed: args.seconds,
        seconds: budget.seconds(),
        versions: Versions::here(args.commit.as_deref()),
        machine: Machine::here(),
        memory_bytes,
        devices: infos,
        parts: parts.done,
        failures,
        conformance,
        errors,
        filters,
        contest,
        octree_mvoxels_per_s,
        volumes: steady.volumes,
        steady: steady.frames,
        textures: steady.textures,
    }
}

/// The parts that are done.
struct Parts<'a> {
    budget: Budget,
    done: Vec<Part>,
    say: &'a mut dyn FnMut(&str),
}

impl Parts<'_> {
    fn run<T>(&mut self, name: &str, share: f64, part: impl FnOnce(Deadline) -> PartResult<T>) -> T {
        let begin = Instant::now();
        let PartResult { found, left_out, line } = part(self.budget.until(share));
        let seconds = begin.elapsed().as_secs_f64();
        let without = if left_out.is_empty() { String::new() } else { format!("; {} left out", left_out.len()) };
        (self.say)(&format!("{name}: {line}{without} ({seconds:.1} s)"));
        self.done.push(Part { name: name.to_owned(), seconds, left_out });
        found
    }
}

fn describe(info: &DeviceInfo) -> String {
    match (&info.absent, &info.adapter, &info.driver) {
        (None, Some(adapter), Some(driver)) => format!("{}: {adapter}, {driver}", info.backend),
        (absent, ..) => format!("{}: absent: {}", info.backend, absent.as_deref().unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_the_time_in_their_order_and_say_what_they_left_out() {
        let shares = [CONFORMANCE, ERRORS, CONTEST, ALL];
        assert!(shares.is_sorted() && shares[0] > 0.0 && shares[3] < 1.0);
        let mut lines = Vec::new();
        let mut say = |line: &str| lines.push(line.to_owned());
        let mut parts = Parts { budget: Budget::new(100.0), done: Vec::new(), say: &mut say };
        let found = parts.run("a part", 0.5, |deadline| {
            assert!(deadline.seconds_left() > 49.0);
            PartResult { found: 7, left_out: vec![Unmeasured::new("a frame", "no time")], line: "three frames".into() }
        });
        let Parts { done, .. } = parts;
        assert_eq!((found, done[0].name.as_str(), done[0].left_out[0].reason.as_str()), (7, "a part", "no time"));
        assert!(lines[0].starts_with("a part: three frames; 1 left out ("), "{lines:?}");
    }
}
