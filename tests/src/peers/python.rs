//! The Python of the peers: where it is, how it is made, how a peer is started.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::PeersError;

/// The environment that `--install` makes, below the workspace's root.
pub(super) const ENVIRONMENT: &str = "target/peers";

const SCRIPTS: [(&str, &str); 6] = [
    ("serve.py", include_str!("../../peers/serve.py")),
    ("scene.py", include_str!("../../peers/scene.py")),
    ("vtk_peer.py", include_str!("../../peers/vtk_peer.py")),
    ("pygfx_peer.py", include_str!("../../peers/pygfx_peer.py")),
    ("vispy_peer.py", include_str!("../../peers/vispy_peer.py")),
    ("requirements.txt", include_str!("../../peers/requirements.txt")),
];

/// An interpreter, and the scripts of the peers in a folder of their own.
pub(super) struct Python {
    program: PathBuf,
    folder: tempfile::TempDir,
}

impl Python {
    /// The interpreter that is named, or else the one that `--install` makes.
    ///
    /// # Errors
    /// A folder that cannot be written to.
    pub(super) fn new(named: Option<&Path>) -> Result<Python, PeersError> {
        let folder = tempfile::tempdir().map_err(PeersError::Temporary)?;
        for (name, text) in SCRIPTS {
            std::fs::write(folder.path().join(name), text).map_err(PeersError::Temporary)?;
        }
        Ok(Python { program: named.map_or_else(installed, Path::to_owned), folder })
    }

    /// The command of a process that serves any peer.
    pub(super) fn serve(&self) -> Command {
        let mut command = Command::new(&self.program);
        command.arg(self.folder.path().join("serve.py"));
        // Pictures without a window: EGL, and no server of a display.
        command.env("EGL_PLATFORM", "surfaceless").env("PYOPENGL_PLATFORM", "egl").env_remove("DISPLAY");
        command.env("PYTHONDONTWRITEBYTECODE", "1");
        if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
            command.env("XDG_RUNTIME_DIR", self.folder.path());
        }
        command
    }

    /// Makes the environment with the system's Python, and installs the peers in it.
    ///
    /// # Errors
    /// A command that fails.
    pub(super) fn install() -> Result<(), PeersError> {
        let python = Python::new(None)?;
        run("python3 -m venv", Command::new("python3").args(["-m", "venv", ENVIRONMENT]))?;
        let requirements = python.folder.path().join("requirements.txt");
        let mut pip = Command::new(installed());
        run("pip install", pip.args(["-m", "pip", "install", "--requirement"]).arg(requirements))
    }

    /// Why there are no peers, if nobody has named an interpreter or made one.
    pub(super) fn missing(&self) -> Option<String> {
        let is_missing = self.program == installed() && !self.program.exists();
        is_missing.then(|| format!("there is no {}: `cargo xtask peers --install` makes it", self.program.display()))
    }
}

fn installed() -> PathBuf {
    let program = if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" };
    Path::new(ENVIRONMENT).join(program)
}

fn run(what: &'static str, command: &mut Command) -> Result<(), PeersError> {
    let reason = match command.status() {
        Ok(status) if status.success() => return Ok(()),
        Ok(status) => format!("{status}; what it says is above"),
        Err(e) => e.to_string(),
    };
    Err(PeersError::Install { what, reason })
}
