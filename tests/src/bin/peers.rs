//! `peers`: Brickfield next to VTK, pygfx and vispy, in one alternating run.

use std::process::ExitCode;

use brickfield_conformance::compare::say;
use brickfield_conformance::peers::{parse, peers};

fn main() -> ExitCode {
    let args = parse(std::env::args_os().collect()).unwrap_or_else(|e| e.exit());
    let mut told = Ok(());
    let measured = peers(&args, &mut |text| {
        let said = say(text);
        if told.is_ok() {
            told = said;
        }
    });
    match (measured, told) {
        (Err(e), _) => {
            eprintln!("peers: {}", e.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
            ExitCode::from(e.status())
        }
        (_, Err(e)) => {
            eprintln!("peers: {e}");
            ExitCode::FAILURE
        }
        (Ok(_), Ok(())) => ExitCode::SUCCESS,
    }
}
