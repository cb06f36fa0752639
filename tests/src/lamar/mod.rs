//! LaMar, Hamann and Joy 1999 on this project's data: table 1 with its errors, figures 8 and 14, and the paper's other claims.
//!
//! - `selection`: how many tiles the distance filter selects, figures 4 and 5.
//! - `table`: fixed tiles against multiresolution, three proxy geometries and the ray caster, time and error on every backend.
//! - `downsampling`: subsampling against averaging. `memory`: the formula for shared voxels against the stored ones.
//! - `seams`: a constant field, with and without opacity correction. `shells`: tessellated shells against spheres.
//! - `figures`: pictures. `views`: a screen-space error of a pixel, over views of a large volume.

mod args;
mod downsampling;
mod error;
mod figures;
mod measure;
mod memory;
mod scenes;
mod seams;
mod selection;
mod shells;
mod table;
mod views;

pub use args::{ClaimKind, LamarArgs, Part};
pub use error::LamarError;

use crate::compare::rivals::Rivals;
use crate::compare::say;
use crate::turns::Claim;

/// The findings of the parts that were asked for.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Claims that do not hold.
    pub missed: Vec<Missed>,
}

/// A claim that does not hold.
#[derive(Clone, Debug)]
pub struct Missed {
    /// Its subject.
    pub kind: ClaimKind,
    /// The claim and the finding, in words.
    pub what: String,
}

impl Missed {
    fn of_pictures(what: String) -> Missed {
        Missed { kind: ClaimKind::Pictures, what }
    }

    fn of_times(what: String) -> Missed {
        Missed { kind: ClaimKind::Times, what }
    }

    /// A claim about times, if it is missed.
    fn of_claim(claim: &Claim) -> Option<Missed> {
        (!claim.kept).then(|| Missed::of_times(claim.to_string()))
    }
}

/// Runs the parts that `args` ask for, and prints their findings.
///
/// # Errors
/// Data or a folder that cannot be had, a scene that is refused, a backend that fails.
pub fn lamar(args: &LamarArgs) -> Result<Findings, LamarError> {
    scenes::check_data(args)?;
    std::fs::create_dir_all(&args.out).map_err(|source| LamarError::Out { path: args.out.clone(), source })?;
    let mut rivals = Rivals::open(&args.backends, args.adapter.as_deref());
    rivals.check_required(&args.require)?;
    rivals.check_any()?;
    let mut findings = Findings::default();
    for info in &rivals.infos {
        let state = match (&info.adapter, &info.absent) {
            (Some(adapter), _) => format!("{adapter}, {}", info.driver.as_deref().unwrap_or_default()),
            (None, reason) => format!("absent: {}", reason.as_deref().unwrap_or_default()),
        };
        print(&format!("{}: {state}", info.backend))?;
    }
    for part in args.parts() {
        print(&format!("\n## {}\n", part.title()))?;
        let missed = match part {
            Part::Selection => selection::run(args)?,
            Part::Table => table::run(args, &mut rivals)?,
            Part::Downsampling => downsampling::run(args)?,
            Part::Memory => memory::run(args)?,
            Part::Seams => seams::run(args, &mut rivals)?,
            Part::Shells => shells::run(args, &mut rivals)?,
            Part::Figures => figures::run(args, &mut rivals)?,
            Part::Views => views::run(args, &mut rivals)?,
        };
        findings.missed.extend(missed);
    }
    print(&match findings.missed.len() {
        0 => "\nEverything that is claimed of these parts holds.".to_owned(),
        n => format!("\nOf what is claimed, {n} does not hold."),
    })?;
    Ok(findings)
}

/// Rows as a JSON file of the output folder.
fn write_rows<R: serde::Serialize>(args: &LamarArgs, name: &str, rows: &[R]) -> Result<(), LamarError> {
    let path = args.out.join(name);
    let json = serde_json::to_string_pretty(rows).expect("rows are plain data");
    std::fs::write(&path, json).map_err(|source| LamarError::Out { path, source })
}

/// A line on standard output.
fn print(line: &str) -> Result<(), LamarError> {
    say(&format!("{line}\n")).map_err(LamarError::Print)
}
