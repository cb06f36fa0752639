//! Contestants of another build: a process that keeps its backends open and renders a frame on request.
//!
//! The process first writes a line of JSON for each contestant ([`Offer`]), and an empty line. Then each line that it reads is
//! a contestant's number, counted from 0; its answer is a line with the milliseconds of a frame. It ends with its input.

use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde::{Deserialize, Serialize};

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
    program: PathBuf,
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    offers: Vec<Offer>,
}

/// Why a server gives no time.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ServerError {
    #[error("{}: {source}", program.display())]
    Io { program: PathBuf, source: io::Error },
    #[error("{}: it wrote {answer:?}, and not {expected}", program.display())]
    Answer { program: PathBuf, answer: String, expected: &'static str },
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
        let io = |source| ServerError::Io { program: program.to_owned(), source };
        let mut command = Command::new(program);
        let mut child = command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().map_err(io)?;
        let requests = child.stdin.take();
        let mut answers = BufReader::new(child.stdout.take().expect("standard output is a pipe"));
        let offers = read_offers(program, &mut answers);
        let mut server = Server { program: program.to_owned(), child, requests, answers, offers: Vec::new() };
        server.offers = offers?;
        Ok(server)
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
        let requests = self.requests.as_mut().expect("standard input is open until the server is dropped");
        ask(&self.program, requests, &mut self.answers, contestant)
    }
}

impl Drop for Server {
    /// Ends the process by ending its input.
    fn drop(&mut self) {
        drop(self.requests.take());
        // Whatever it says now, no time depends on it.
        let _ = self.child.wait();
    }
}

fn read_offers(program: &Path, answers: &mut impl BufRead) -> Result<Vec<Offer>, ServerError> {
    let mut offers = Vec::new();
    loop {
        let line = read_line(program, answers)?;
        if line == "\n" {
            return Ok(offers);
        }
        let offer = serde_json::from_str(&line);
        offers.push(offer.map_err(|_| unexpected(program, &line, "a contestant"))?);
    }
}

fn ask(
    program: &Path,
    requests: &mut impl Write,
    answers: &mut impl BufRead,
    contestant: usize,
) -> Result<f64, ServerError> {
    let asked = writeln!(requests, "{contestant}").and_then(|()| requests.flush());
    asked.map_err(|source| ServerError::Io { program: program.to_owned(), source })?;
    let line = read_line(program, answers)?;
    line.trim().parse().map_err(|_| unexpected(program, &line, "milliseconds"))
}

/// A line with its end; empty where the process has ended.
fn read_line(program: &Path, answers: &mut impl BufRead) -> Result<String, ServerError> {
    let mut line = String::new();
    let read = answers.read_line(&mut line);
    read.map(|_| line).map_err(|source| ServerError::Io { program: program.to_owned(), source })
}

fn unexpected(program: &Path, answer: &str, expected: &'static str) -> ServerError {
    ServerError::Answer { program: program.to_owned(), answer: answer.to_owned(), expected }
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
        let frame = |contestant: usize| Ok::<f64, io::Error>(1.5 + contestant as f64);
        serve(&offers(), "1\n0\n".as_bytes(), &mut answers, frame).unwrap();
        let (program, mut answers, mut requests) = (Path::new("speed"), answers.as_slice(), Vec::new());
        assert_eq!(read_offers(program, &mut answers).unwrap(), offers());
        assert_eq!(ask(program, &mut requests, &mut answers, 1).unwrap(), 2.5);
        assert_eq!(ask(program, &mut requests, &mut answers, 0).unwrap(), 1.5);
        assert_eq!(requests, b"1\n0\n");
        let ended = ask(program, &mut requests, &mut answers, 0).unwrap_err();
        assert_eq!(ended.to_string(), "speed: it wrote \"\", and not milliseconds");
    }

    #[test]
    fn a_request_for_nobody_is_an_error() {
        let frame = |_: usize| Ok::<f64, io::Error>(0.0);
        let error = |request: &str| serve(&offers(), request.as_bytes(), Vec::new(), frame).unwrap_err().to_string();
        assert_eq!(error("2\n"), "\"2\" is no contestant's number");
        assert!(error("x\n").contains("\"x\""));
    }
}
