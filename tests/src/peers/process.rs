//! A contestant: a process that draws, and what is known of it.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use super::PeersError;
use super::lineup::Who;
use super::protocol::{Answer, Ask, Drawing, Drawn, Opened, Opening, Part};
use crate::turns::{LineProcess, ServerError};

/// A contestant that is ready.
pub(super) struct Contestant {
    pub(super) who: Who,
    pub(super) opened: Opened,
    process: Process,
}

struct Process {
    lines: LineProcess,
    /// How long an answer may take.
    patience: Duration,
    /// What it writes to its standard error.
    complaints: File,
}

/// By how much a process may state more wall time than its answer was waited for: clocks are read one after the other.
const CLOCK_SLACK: f64 = 1.01;

impl Contestant {
    /// Starts a process, and has it read a volume. An answer that takes longer than `patience` is none, and the process is
    /// killed. The inner error says why the contestant is absent.
    pub(super) fn open(
        who: Who,
        mut command: Command,
        opening: Opening,
        patience: Duration,
    ) -> Result<Result<Contestant, String>, PeersError> {
        let complaints = tempfile::tempfile().map_err(PeersError::Temporary)?;
        command.stderr(complaints.try_clone().map_err(PeersError::Temporary)?);
        let mut process = match LineProcess::start(&mut command) {
            Ok(lines) => Process { lines, patience, complaints },
            Err(e) => return Ok(Err(e.to_string())),
        };
        Ok(match process.ask(&Ask::Open(Box::new(opening))) {
            Ok(Answer::Opened(opened)) => opened.checked().map(|opened| Contestant { who, opened, process }),
            Ok(_) => Err("it did not open the scene".to_owned()),
            Err(reason) => Err(reason),
        })
    }

    /// Has a frame drawn.
    pub(super) fn frame(&mut self, drawing: Drawing) -> Result<Drawn, String> {
        self.drawn(&Ask::Frame(drawing))
    }

    /// Has a frame drawn; its picture comes into a file.
    pub(super) fn picture(&mut self, frame: Drawing, path: &Path) -> Result<Drawn, String> {
        self.drawn(&Ask::Picture { frame, path: path.to_owned() })
    }

    fn drawn(&mut self, ask: &Ask) -> Result<Drawn, String> {
        let begin = Instant::now();
        match self.process.ask(ask)? {
            Answer::Frame(drawn) => drawn.checked(begin.elapsed()),
            _ => Err("it did not draw the frame".to_owned()),
        }
    }
}

impl Opened {
    /// The error names what cannot be.
    fn checked(self) -> Result<Opened, String> {
        if !(self.view > 0.0 && self.view <= 1.0) {
            return Err(format!("its field of view is {} of what was asked for, not above 0 and at most 1", self.view));
        }
        parts_checked(&self.phases)?;
        Ok(self)
    }
}

impl Drawn {
    /// The error names what cannot be. A frame takes no longer than its answer was waited for.
    fn checked(self, waited: Duration) -> Result<Drawn, String> {
        let waited = 1e3 * waited.as_secs_f64();
        time_checked("a frame", self.wall_ms)?;
        time_checked("the processor for a frame", self.cpu_ms)?;
        parts_checked(&self.parts)?;
        if self.wall_ms > CLOCK_SLACK * waited {
            return Err(format!("it says that a frame took {} ms, and answered after {waited:.3} ms", self.wall_ms));
        }
        Ok(self)
    }
}

fn parts_checked(parts: &[Part]) -> Result<(), String> {
    let times = |part: &Part| [Some(part.wall_ms), part.cpu_ms].into_iter().flatten().collect::<Vec<_>>();
    parts.iter().try_for_each(|part| times(part).into_iter().try_for_each(|ms| time_checked(&part.name, ms)))
}

fn time_checked(what: &str, ms: f64) -> Result<(), String> {
    let is_time = ms.is_finite() && ms >= 0.0;
    if is_time { Ok(()) } else { Err(format!("it says {ms} ms of {what}, which is no time")) }
}

impl Process {
    /// The error is a line.
    fn ask(&mut self, ask: &Ask) -> Result<Answer, String> {
        let request = serde_json::to_string(ask).expect("a request is plain data");
        let lines = &mut self.lines;
        let answer = lines.ask_within(self.patience, request, "an answer").and_then(|line| {
            let answer = serde_json::from_str(&line);
            answer.map_err(|_| lines.unexpected(&line, "an answer"))
        });
        match answer {
            Ok(Answer::Failed { reason }) => Err(one_line(&reason)),
            Ok(answer) => Ok(answer),
            Err(e) => Err(one_line(&format!("{}{}", self.why(&e), self.last_complaint()))),
        }
    }

    fn why(&mut self, e: &ServerError) -> String {
        match e {
            ServerError::Late { .. } => format!("{e} (--patience), and was killed"),
            ServerError::Ended { .. } | ServerError::Io { .. } => {
                // Its streams end a little earlier than itself.
                let status = self.lines.status(Duration::from_secs(1));
                status.map_or_else(|| e.to_string(), |status| format!("{e} ({status})"))
            }
            ServerError::Answer { .. } => e.to_string(),
        }
    }

    /// The last line of its standard error, if it wrote any.
    fn last_complaint(&mut self) -> String {
        let mut bytes = Vec::new();
        let read = self.complaints.seek(SeekFrom::Start(0)).and_then(|_| self.complaints.read_to_end(&mut bytes));
        let text = String::from_utf8_lossy(&bytes);
        let last = text.lines().rev().find(|line| !line.trim().is_empty());
        last.filter(|_| read.is_ok()).map_or_else(String::new, |line| format!("; {line}"))
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
