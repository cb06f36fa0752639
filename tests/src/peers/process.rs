//! A contestant: a process that draws, and what is known of it.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::process::Command;

use super::PeersError;
use super::lineup::Who;
use super::protocol::{Answer, Ask, Drawing, Drawn, Opened, Opening};
use crate::turns::LineProcess;

/// A contestant that is ready.
pub(super) struct Contestant {
    pub(super) who: Who,
    pub(super) opened: Opened,
    process: Process,
}

struct Process {
    lines: LineProcess,
    /// What it writes to its standard error.
    complaints: File,
}

impl Contestant {
    /// Starts a process, and has it read a volume. The inner error says why the contestant is absent.
    pub(super) fn open(
        who: Who,
        mut command: Command,
        opening: Opening,
    ) -> Result<Result<Contestant, String>, PeersError> {
        let complaints = tempfile::tempfile().map_err(PeersError::Temporary)?;
        command.stderr(complaints.try_clone().map_err(PeersError::Temporary)?);
        let mut process = match LineProcess::start(&mut command) {
            Ok(lines) => Process { lines, complaints },
            Err(e) => return Ok(Err(e.to_string())),
        };
        Ok(match process.ask(&Ask::Open(Box::new(opening))) {
            Ok(Answer::Opened(opened)) => Ok(Contestant { who, opened, process }),
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
        match self.process.ask(ask)? {
            Answer::Frame(drawn) => Ok(drawn),
            _ => Err("it did not draw the frame".to_owned()),
        }
    }
}

impl Process {
    /// The error is a line.
    fn ask(&mut self, ask: &Ask) -> Result<Answer, String> {
        let request = serde_json::to_string(ask).expect("a request is plain data");
        let lines = self.lines.lines();
        let answer = lines.ask(&request, "an answer").and_then(|line| {
            let answer = serde_json::from_str(&line);
            answer.map_err(|_| lines.unexpected(&line, "an answer"))
        });
        match answer {
            Ok(Answer::Failed { reason }) => Err(one_line(&reason)),
            Ok(answer) => Ok(answer),
            Err(e) => Err(one_line(&format!("{e}{}", self.last_complaint()))),
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
