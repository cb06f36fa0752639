//! The backends that are compared, and the backends that are absent.

use brickfield::frame::{Backend, Description};
use brickfield::{BackendError, BackendKind, Validation, open_backend};
use clap::Args;

use super::CompareError;
use crate::report::BackendInfo;

/// The backends that could be opened, and a line for each that was asked for.
pub(crate) struct Rivals {
    pub(crate) present: Vec<Box<dyn Backend>>,
    pub(crate) infos: Vec<BackendInfo>,
}

/// The backends that a comparison is made of.
#[derive(Args, Clone, Debug)]
pub struct RivalArgs {
    /// Backends to compare
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "cpu,wgpu,ash")]
    pub backends: Vec<BackendKind>,
    /// Adapter of wgpu and ash: its number or a part of its name, as `brickfield backends` lists them
    #[arg(long)]
    pub adapter: Option<String>,
    /// Backends without which the comparison fails (status 3)
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub require: Vec<BackendKind>,
}

impl RivalArgs {
    /// Opens the backends.
    ///
    /// # Errors
    /// If a required one is absent, or all are.
    pub(crate) fn open(&self) -> Result<Rivals, CompareError> {
        let rivals = Rivals::open(&self.backends, self.adapter.as_deref());
        rivals.check_required(&self.require)?;
        rivals.check_any()?;
        Ok(rivals)
    }
}

impl Rivals {
    /// Opens each kind once; one that cannot be opened is absent, which is no error.
    pub(crate) fn open(kinds: &[BackendKind], adapter: Option<&str>) -> Rivals {
        let mut rivals = Rivals { present: Vec::new(), infos: Vec::new() };
        let mut kinds = kinds.to_vec();
        kinds.sort();
        kinds.dedup();
        for kind in kinds {
            let adapter = adapter.filter(|_| kind != BackendKind::Cpu);
            match open_backend(kind, adapter, Validation::Off) {
                Ok(backend) => {
                    rivals.infos.push(present(backend.describe()));
                    rivals.present.push(backend);
                }
                // The report names the backend itself.
                Err(BackendError::Unavailable { reason, .. }) => rivals.infos.push(absent(kind, reason)),
                Err(e) => rivals.infos.push(absent(kind, e.to_string())),
            }
        }
        rivals
    }

    /// # Errors
    /// If no backend is there at all: why each is absent.
    pub(crate) fn check_any(&self) -> Result<(), CompareError> {
        if !self.present.is_empty() {
            return Ok(());
        }
        let reason = |i: &BackendInfo| format!("{}: {}", i.backend, i.absent.as_deref().unwrap_or_default());
        Err(CompareError::NoBackend { reasons: self.infos.iter().map(reason).collect::<Vec<_>>().join("; ") })
    }

    /// # Errors
    /// The first kind of `required` that is absent or was not asked for.
    pub(crate) fn check_required(&self, required: &[BackendKind]) -> Result<(), CompareError> {
        for kind in required {
            let info = self.infos.iter().find(|i| i.backend == kind.name());
            let reason = match info {
                Some(BackendInfo { absent: None, .. }) => continue,
                Some(BackendInfo { absent: Some(reason), .. }) => reason.clone(),
                None => "it is not among --backends".to_owned(),
            };
            return Err(CompareError::Required { backend: kind.to_string(), reason });
        }
        Ok(())
    }
}

fn present(d: &Description) -> BackendInfo {
    let (adapter, driver) = (Some(d.adapter.clone()), Some(d.driver.clone()));
    BackendInfo { backend: d.backend.to_owned(), adapter, driver, absent: None }
}

fn absent(kind: BackendKind, reason: String) -> BackendInfo {
    let reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
    BackendInfo { backend: kind.name().to_owned(), adapter: None, driver: None, absent: Some(reason) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_required_backend_that_is_absent_is_an_error() {
        let rivals = Rivals { present: vec![], infos: vec![absent(BackendKind::Ash, "no\n driver".to_owned())] };
        let error = |kind| rivals.check_required(&[kind]).unwrap_err().to_string();
        assert_eq!(rivals.check_any().unwrap_err().to_string(), "no backend to compare: ash: no driver");
        assert_eq!(error(BackendKind::Ash), "ash is required and absent: no driver");
        assert_eq!(error(BackendKind::Cpu), "cpu is required and absent: it is not among --backends");
        let cpu = Rivals::open(&[BackendKind::Cpu, BackendKind::Cpu], None);
        assert_eq!((cpu.present.len(), cpu.check_required(&[BackendKind::Cpu]).is_ok()), (1, true));
    }
}
