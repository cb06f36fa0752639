//! Contestants of another build: a process that keeps its backends open and renders a frame on request.
//!
//! The process first writes a line of JSON for each contestant ([`Offer`]), and an empty line. Then each line that it reads is
//! a contestant's number, counted from 0; its answer is a line with the milliseconds of a frame. It ends with its input.

use std::ffi::OsString;
use std::io::{self, BufRead, Write};
use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::lines::{LineProcess, Lines, ServerError};

/// A contestant of a server.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Offer {
    /// The scene.
    pub what: String,
    /// The backend's name.
    pub backend: String,
}

/// A process that serves frames.
pub struct Server {
    process: LineProcess,
    offers: Vec<Offer>,
}

/// Serves frames over `requests` and `answers` until the requests end; `frame` renders a frame of a contestant and returns its
/// milliseconds.
///
/// # Errors
/// A stream that fails, a request that is no contestant's number, an error of `frame`.
pub fn serve<E: From<io::Error>>(
    offers: &[Offer],
    requests: impl BufRead,
    mut answers: impl Write,
    mut frame: impl FnMut(usize) -> Result<f64, E>,
) -> Result<(), E> {
    for offer in offers {
        writeln!(answers, "{}", serde_json::to_string(offer).expect("an offer is plain data"))?;
    }
    writeln!(answers)?;
    answers.flush()?;
    for line in requests.lines() {
        let line = line?;
        let contestant = line.trim().parse().ok().filter(|i| *i < offers.len());
        let contestant = contestant.ok_or_else(|| io::Error::other(format!("{line:?} is no contestant's number")))?;
        writeln!(answers, "{}", frame(contestant)?)?;
        answers.flush()?;
    }
    Ok(())
}

impl Server {
    /// Starts a program, and waits until its contestants are ready.
    ///
    /// # Errors
    /// A program that cannot be started, or that offers no contestants.
    pub fn start(program: &Path, arguments: &[OsString]) -> Result<Server, ServerError> {
        let mut process = LineProcess::start(Command::new(program).args(arguments))?;
        let offers = read_offers(process.lines())?;
        Ok(Server { process, offers })
    }

    /// The contestants.
    pub fn offers(&self) -> &[Offer] {
        &self.offers
    }

    /// Has a frame of a contestant rendered; milliseconds.
    ///
    /// # Errors
    /// A process that has ended, or that answers no time.
    pub fn frame(&mut self, contestant: usize) -> Result<f64, ServerError> {
        frame(self.process.lines(), contestant)
    }
}

fn read_offers<W: Write, R: BufRead>(lines: &mut Lines<W, R>) -> Result<Vec<Offer>, ServerError> {
    let mut offers = Vec::new();
    loop {
        let line = lines.line("a contestant")?;
        if line.is_empty() {
            return Ok(offers);
        }
        let offer = serde_json::from_str(&line);
        offers.push(offer.map_err(|_| lines.unexpected(&line, "a contestant"))?);
    }
}

fn frame<W: Write, R: BufRead>(lines: &mut Lines<W, R>, contestant: usize) -> Result<f64, ServerError> {
    let line = lines.ask(&contestant.to_string(), "milliseconds")?;
    line.trim().parse().map_err(|_| lines.unexpected(&line, "milliseconds"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offers() -> Vec<Offer> {
        ["cpu", "wgpu"].map(|backend| Offer { what: "engine, \"fast\"".into(), backend: backend.into() }).into()
    }

    #[test]
    fn a_server_says_what_it_offers_and_answers_each_request() {
        let mut answers = Vec::new();
        let served = |contestant: usize| Ok::<f64, io::Error>(1.5 + contestant as f64);
        serve(&offers(), "1\n0\n".as_bytes(), &mut answers, served).unwrap();
        let mut lines = Lines { program: "speed".into(), requests: Vec::new(), answers: answers.as_slice() };
        assert_eq!(read_offers(&mut lines).unwrap(), offers());
        assert_eq!(frame(&mut lines, 1).unwrap(), 2.5);
        assert_eq!(frame(&mut lines, 0).unwrap(), 1.5);
        assert_eq!(lines.requests, b"1\n0\n");
        let ended = frame(&mut lines, 0).unwrap_err();
        assert_eq!(ended.to_string(), "speed: it ended before it wrote milliseconds");
    }

    #[test]
    fn a_request_for_nobody_is_an_error() {
        let frame = |_: usize| Ok::<f64, io::Error>(0.0);
        let error = |request: &str| serve(&offers(), request.as_bytes(), Vec::new(), frame).unwrap_err().to_string();
        assert_eq!(error("2\n"), "\"2\" is no contestant's number");
        assert!(error("x\n").contains("\"x\""));
    }
}
