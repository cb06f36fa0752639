//! A process that answers each line with a line. It ends with its input.

use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Requests to a program and its answers.
pub(crate) struct Lines<W, R> {
    pub(super) program: PathBuf,
    pub(super) requests: W,
    pub(super) answers: R,
}

/// A process, and the lines to and from it.
pub(crate) struct LineProcess {
    child: Child,
    /// Until it is dropped.
    lines: Option<Lines<ChildStdin, BufReader<ChildStdout>>>,
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

impl<W: Write, R: BufRead> Lines<W, R> {
    /// Writes a request, and returns the next line, without its end.
    pub(crate) fn ask(&mut self, request: &str, expected: &'static str) -> Result<String, ServerError> {
        let asked = writeln!(self.requests, "{request}").and_then(|()| self.requests.flush());
        asked.map_err(|source| self.failed(source))?;
        self.line(expected)
    }

    /// The next line, without its end.
    pub(crate) fn line(&mut self, expected: &'static str) -> Result<String, ServerError> {
        let mut line = String::new();
        let read = self.answers.read_line(&mut line).map_err(|source| self.failed(source))?;
        match read {
            0 => Err(self.unexpected(&line, expected)),
            _ => Ok(line.trim_end_matches(['\n', '\r']).to_owned()),
        }
    }

    /// An answer that is none.
    pub(crate) fn unexpected(&self, answer: &str, expected: &'static str) -> ServerError {
        ServerError::Answer { program: self.program.clone(), answer: answer.to_owned(), expected }
    }

    fn failed(&self, source: io::Error) -> ServerError {
        ServerError::Io { program: self.program.clone(), source }
    }
}

impl LineProcess {
    /// Starts a command.
    pub(crate) fn start(command: &mut Command) -> Result<LineProcess, ServerError> {
        let program = Path::new(command.get_program()).to_owned();
        let started = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut child = started.map_err(|source| ServerError::Io { program: program.clone(), source })?;
        let requests = child.stdin.take().expect("standard input is a pipe");
        let answers = BufReader::new(child.stdout.take().expect("standard output is a pipe"));
        Ok(LineProcess { child, lines: Some(Lines { program, requests, answers }) })
    }

    pub(crate) fn lines(&mut self) -> &mut Lines<ChildStdin, BufReader<ChildStdout>> {
        self.lines.as_mut().expect("the streams are open until the process is dropped")
    }
}

impl Drop for LineProcess {
    /// Ends the process by ending its input.
    fn drop(&mut self) {
        self.lines = None;
        // Whatever it says now, no time depends on it.
        let _ = self.child.wait();
    }
}
