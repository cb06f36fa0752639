//! The backend that draws.

use brickfield::frame::Backend;
use brickfield::{BackendError, BackendKind, BackendStatus, Validation, backends, open_backend};
use clap::Args;

use crate::Failure;

/// Which backend draws, and on what.
#[derive(Args)]
pub(crate) struct BackendOptions {
    /// auto (the first GPU, else the CPU; drivers in software are not GPUs), cpu, wgpu or ash
    #[arg(long, default_value = "auto")]
    backend: String,
    /// Adapter: its number or a part of its name, as `brickfield backends` lists them
    #[arg(long)]
    adapter: Option<String>,
    /// Check all calls by the driver's validation layer (ash); what it says is printed and fails the command
    #[arg(long)]
    validation: bool,
}

/// Calls are checked through ash only.
#[derive(Debug, thiserror::Error)]
#[error("--validation: backend {kind} has no validation layer; take --backend ash")]
struct ValidationNeedsAsh {
    kind: BackendKind,
}

impl BackendOptions {
    /// Opens the first candidate that opens; the last one's error if none does.
    pub(crate) fn open(&self) -> Result<Box<dyn Backend>, Failure> {
        let validation = if self.validation { Validation::On } else { Validation::Off };
        let mut last: Option<BackendError> = None;
        for kind in self.candidates()? {
            match open_backend(kind, self.adapter.as_deref(), validation) {
                Ok(backend) => return Ok(backend),
                Err(e) => last = Some(e),
            }
        }
        Err(Failure::Backend(last.expect("at least one candidate")))
    }

    /// The backends to try, in order.
    fn candidates(&self) -> Result<Vec<BackendKind>, Failure> {
        if self.backend != "auto" {
            let kind: BackendKind = self.backend.parse().map_err(Failure::usage)?;
            if self.validation && kind != BackendKind::Ash {
                return Err(Failure::usage(ValidationNeedsAsh { kind }));
            }
            return Ok(vec![kind]);
        }
        if self.validation {
            return Ok(vec![BackendKind::Ash]);
        }
        if self.adapter.is_some() {
            return Ok(vec![BackendKind::Ash, BackendKind::Wgpu, BackendKind::Cpu]);
        }
        // A driver in software is slower than the CPU backend: it is for those who ask for it.
        let is_gpu = |status: &BackendStatus| matches!(&status.adapters, Ok(a) if a.iter().any(|a| !a.is_software));
        let mut kinds: Vec<_> = backends().iter().filter(|status| is_gpu(status)).map(|status| status.kind).collect();
        // `backends` lists ash last; here it comes first.
        kinds.reverse();
        kinds.push(BackendKind::Cpu);
        Ok(kinds)
    }
}

/// Prints what the validation layer has said.
pub(crate) fn check_validation(messages: &[String]) -> Result<(), Failure> {
    messages.iter().for_each(|m| eprintln!("validation: {m}"));
    match messages.len() {
        0 => Ok(()),
        n_messages => Err(Failure::Validation { n_messages }),
    }
}
