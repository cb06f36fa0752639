//! A process that answers each line with a line. It ends with its input.

use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

/// How long a process may take to end, once its input has ended.
const GRACE: Duration = Duration::from_secs(20);
/// Characters of a wrong answer that are repeated.
const QUOTED: usize = 120;

/// Requests to a program and its answers.
pub(crate) struct Lines<W, R> {
    pub(super) program: PathBuf,
    pub(super) requests: W,
    pub(super) answers: R,
}

/// A process, and the lines to and from it.
pub(crate) struct LineProcess {
    program: PathBuf,
    child: Child,
    /// Until an answer comes too late, or the process is dropped.
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
    #[error("{}: it ended before it wrote {expected}", program.display())]
    Ended { program: PathBuf, expected: &'static str },
    #[error("{}: it did not write {expected} within {} s", program.display(), patience.as_secs_f64())]
    Late { program: PathBuf, expected: &'static str, patience: Duration },
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
            0 => Err(ServerError::Ended { program: self.program.clone(), expected }),
            _ => Ok(line.trim_end_matches(['\n', '\r']).to_owned()),
        }
    }

    /// An answer that is none.
    pub(crate) fn unexpected(&self, answer: &str, expected: &'static str) -> ServerError {
        unexpected(&self.program, answer, expected)
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
        Ok(LineProcess { lines: Some(Lines { program: program.clone(), requests, answers }), program, child })
    }

    /// The lines of a process whose answers are waited for as long as they take.
    pub(crate) fn lines(&mut self) -> &mut Lines<ChildStdin, BufReader<ChildStdout>> {
        self.lines.as_mut().expect("the streams are open until an answer comes too late")
    }

    /// Writes a request, and returns the next line, without its end. A process that takes longer than `patience` is killed.
    pub(crate) fn ask_within(
        &mut self,
        patience: Duration,
        request: String,
        expected: &'static str,
    ) -> Result<String, ServerError> {
        let ended = || ServerError::Ended { program: self.program.clone(), expected };
        let mut lines = self.lines.take().ok_or_else(ended)?;
        let (send, receive) = mpsc::channel();
        // Both writing and reading may wait for ever.
        thread::spawn(move || {
            let answer = lines.ask(&request, expected);
            // Nobody receives an answer that is late.
            let _ = send.send((lines, answer));
        });
        let Ok((lines, answer)) = receive.recv_timeout(patience) else {
            self.kill();
            return Err(ServerError::Late { program: self.program.clone(), expected, patience });
        };
        self.lines = Some(lines);
        answer
    }

    /// An answer that is none.
    pub(crate) fn unexpected(&self, answer: &str, expected: &'static str) -> ServerError {
        unexpected(&self.program, answer, expected)
    }

    /// How the process ended, if it does within `patience`.
    pub(crate) fn status(&mut self, patience: Duration) -> Option<ExitStatus> {
        let begin = Instant::now();
        loop {
            match self.child.try_wait() {
                Ok(None) if begin.elapsed() < patience => thread::sleep(Duration::from_millis(2)),
                status => return status.ok().flatten(),
            }
        }
    }

    fn kill(&mut self) {
        // One that has ended cannot be killed, and needs not be.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn unexpected(program: &Path, answer: &str, expected: &'static str) -> ServerError {
    ServerError::Answer { program: program.to_owned(), answer: answer.chars().take(QUOTED).collect(), expected }
}

impl Drop for LineProcess {
    /// Ends the process by ending its input; one that does not end so is killed.
    fn drop(&mut self) {
        self.lines = None;
        if self.status(GRACE).is_none() {
            self.kill();
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str) -> LineProcess {
        LineProcess::start(Command::new("sh").args(["-c", script])).unwrap()
    }

    fn ask(process: &mut LineProcess, milliseconds: u64) -> Result<String, String> {
        let answer = process.ask_within(Duration::from_millis(milliseconds), "hello".to_owned(), "an answer");
        answer.map_err(|e| e.to_string())
    }

    #[test]
    fn a_process_that_never_answers_is_killed() {
        // The second one's child, which is not killed, keeps the streams open.
        for script in ["exec sleep 60", "sleep 3; true"] {
            let (begin, mut process) = (Instant::now(), shell(script));
            assert_eq!(ask(&mut process, 200).unwrap_err(), "sh: it did not write an answer within 0.2 s");
            assert_eq!(ask(&mut process, 200).unwrap_err(), "sh: it ended before it wrote an answer");
            assert!(!process.status(Duration::ZERO).unwrap().success());
            drop(process);
            assert!(begin.elapsed() < Duration::from_secs(2), "{script}");
        }
    }

    #[test]
    fn a_process_that_reads_nothing_is_killed() {
        let mut process = shell("exec sleep 60");
        let large = "x".repeat(1 << 20);
        let e = process.ask_within(Duration::from_millis(200), large, "an answer").unwrap_err();
        assert!(matches!(e, ServerError::Late { .. }), "{e}");
    }

    #[test]
    fn a_process_that_ends_says_how() {
        let mut process = shell("read line; echo \"$line\" again; read line; exit 7");
        assert_eq!(ask(&mut process, 10_000).unwrap(), "hello again");
        assert_eq!(ask(&mut process, 10_000).unwrap_err(), "sh: it ended before it wrote an answer");
        assert_eq!(process.status(GRACE).unwrap().code(), Some(7));
    }
}
