//! The options of `compare`.

use std::ffi::OsString;
use std::path::PathBuf;

use brickfield::frame::Mode;
use brickfield::optics::QuadratureRule;
use brickfield::options::{InputOptions, TreeOptions, ViewOptions, values};
use clap::builder::ArgPredicate;
use clap::parser::ValueSource;
use clap::{CommandFactory, FromArgMatches, Parser};

use super::rivals::RivalArgs;

/// Renders a scene on every backend over steps, rules and modes, and reports error against run time.
///
/// The error is against the continuous answer: the integral itself in f64. Exit status: 0 done, 1 failed (one line on
/// standard error says why), 2 unusable arguments, 3 a required backend is absent, 4 --reach was missed.
#[derive(Parser, Clone, Debug)]
#[command(
    name = "compare",
    after_help = "Examples:
  compare
  compare engine.vti --transfer ct-bone --camera \"front zoom=1.2\" --out engine
  compare --backends cpu,ash --rules midpoint,gauss2 --steps 1,1/2,1/4 --seconds 20

A paper's own comparisons have other options:
  compare --paper lamar --help
  compare --paper lamar --part selection,seams

What the shader of a scene leaves out, and what that saves:
  compare --left-out"
)]
pub struct CompareArgs {
    /// Volume file or folder; without it, the built-in phantom
    pub file: Option<PathBuf>,
    /// Folder that receives report.json, index.html and images/
    #[arg(long, value_name = "DIR", default_value = "target/compare")]
    pub out: PathBuf,
    /// Steps in units of the least voxel spacing, as decimals or fractions; by default 2 to 1/4 in fast mode, 2 to 1/8 or
    /// 1/16 (by the rule's order) in exact mode, and on until the best rule's RMSE is below 1e-5
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::step)]
    pub steps: Vec<f64>,
    /// Quadrature rules
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::rule,
          default_value = "left-riemann,left-exponential,midpoint,pre-integrated,gauss2")]
    pub rules: Vec<QuadratureRule>,
    /// Modes
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::mode, default_value = "exact,fast")]
    pub modes: Vec<Mode>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub rivals: RivalArgs,
    /// RMSE that the exact mode of every backend must come below (else status 4)
    #[arg(long, value_name = "RMSE", value_parser = values::positive)]
    pub reach: Option<f64>,
    /// Seconds that the comparison may take; by default 100 for the phantom, 300 for a file
    #[arg(long, value_parser = values::positive)]
    pub seconds: Option<f64>,
    /// Most timed frames of each measurement, after one that warms up
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub input: InputOptions,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub tree: TreeOptions,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewOptions,
    /// Whether the phantom is seen from where it was meant to be: no `--camera` was given.
    #[arg(skip)]
    pub default_camera: bool,
    /// The command line, for the report.
    #[arg(skip)]
    pub command: String,
}

/// The options of a command line; the first argument is the command's name.
///
/// # Errors
/// clap's message, to be printed by its `exit`.
pub fn parse(arguments: Vec<OsString>) -> Result<CompareArgs, clap::Error> {
    let command = typed("cargo xtask compare", &arguments);
    // Small enough that fine steps end in time; all rows of a report share one size.
    let size = |a: clap::Arg| {
        let a = a.help("Size of the picture in pixels; of a file 256x256 unless stated");
        a.default_value("128x128").default_value_if("file", ArgPredicate::IsPresent, "256x256")
    };
    let mut matches = CompareArgs::command().mut_arg("size", size).try_get_matches_from(arguments)?;
    let default_camera = matches.value_source("camera") == Some(ValueSource::DefaultValue);
    let args = CompareArgs::from_arg_matches_mut(&mut matches)?;
    let (rules, modes) = (each_once(&args.rules), each_once(&args.modes));
    Ok(CompareArgs { rules, modes, default_camera, command, ..args })
}

/// A list without its repetitions.
pub(crate) fn each_once<T: Copy + PartialEq>(list: &[T]) -> Vec<T> {
    let is_first = |(i, x): &(usize, &T)| !list[..*i].contains(x);
    list.iter().enumerate().filter(is_first).map(|(_, x)| *x).collect()
}

/// A command line as a shell takes it; its first word is replaced.
pub(crate) fn typed(command: &str, arguments: &[OsString]) -> String {
    let words = arguments.iter().skip(1).map(|a| quoted(&a.to_string_lossy()));
    std::iter::once(command.to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,=:".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use brickfield::BackendKind;

    use super::*;

    fn args(words: &str) -> Result<CompareArgs, clap::Error> {
        parse(std::iter::once("compare").chain(words.split_whitespace()).map(OsString::from).collect())
    }

    #[test]
    fn without_options_everything_is_compared_on_the_phantom() {
        let a = args("").unwrap();
        assert_eq!((a.file.as_ref(), a.rivals.backends.len(), a.rules.len(), a.modes.len()), (None, 3, 5, 2));
        assert_eq!((a.view.size.to_array(), a.default_camera), ([128, 128], true));
        assert!(!args("--camera front").unwrap().default_camera);
        assert_eq!(args("x.vti").unwrap().view.size.to_array(), [256, 256]);
    }

    #[test]
    fn lists_and_fractions() {
        let a =
            args("x.vti --steps 1,0.5,1/8 --rules gauss2,gauss2 --modes fast --backends ash,cpu --size 64x32").unwrap();
        assert_eq!((a.steps.as_slice(), a.rules.len()), (&[1.0, 0.5, 0.125][..], 1));
        assert_eq!((a.rules[0], a.rivals.backends[1], a.view.size.y), (QuadratureRule::Gauss2, BackendKind::Cpu, 32));
        assert!(a.command.starts_with("cargo xtask compare x.vti --steps 1,0.5,1/8"));
        assert_eq!(quoted("it's front"), r"'it'\''s front'");
    }

    #[test]
    fn unusable_arguments_are_refused_with_status_2() {
        for bad in ["--steps 0", "--steps 1/0", "--rules simpson", "--modes slow", "--backends metal", "--seconds -1"] {
            assert_eq!(args(bad).unwrap_err().exit_code(), 2, "{bad}");
        }
    }
}
