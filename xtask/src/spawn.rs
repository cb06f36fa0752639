//! Spawning cargo, and the programs of the conformance crate.

use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};

/// A command that is shown before it runs, in the workspace's root.
pub(crate) struct Spawn(Command);

/// A program of the conformance crate.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tool {
    Compare,
    Conformance,
    Frames,
    Gpu,
    Orders,
    Peers,
    Sheet,
    Speed,
}

/// A cargo command.
pub(crate) fn cargo(subcommand: &str) -> Spawn {
    let mut spawn = Spawn::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    spawn.0.arg(subcommand);
    if let Some(data) = data_folder() {
        spawn.0.env("BRICKFIELD_DATA", data);
    }
    spawn
}

/// The workspace's root.
pub(crate) fn root() -> PathBuf {
    let own = env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    Path::new(&own).parent().unwrap_or(Path::new(".")).to_path_buf()
}

impl Spawn {
    pub(crate) fn new(program: impl AsRef<OsStr>) -> Spawn {
        let mut command = Command::new(program);
        command.current_dir(root());
        Spawn(command)
    }

    pub(crate) fn arg(self, argument: impl AsRef<OsStr>) -> Spawn {
        self.args([argument])
    }

    pub(crate) fn args(mut self, arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Spawn {
        self.0.args(arguments);
        self
    }

    pub(crate) fn env(mut self, name: &str, value: &str) -> Spawn {
        self.0.env(name, value);
        self
    }

    /// Runs the command; its exit code is ours.
    pub(crate) fn run(mut self) -> Result<ExitCode> {
        eprintln!("+ {}", self.line());
        let status = self.0.status().with_context(|| format!("cannot start {}", self.line()))?;
        let code = status.code().and_then(|c| u8::try_from(c).ok());
        Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::from(code.unwrap_or(1).max(1)) })
    }

    /// The text that the command writes to its standard output.
    pub(crate) fn output(mut self) -> Result<String> {
        let output = self.0.output().with_context(|| format!("cannot start {}", self.line()))?;
        if !output.status.success() {
            bail!("{} failed: {}", self.line(), String::from_utf8_lossy(&output.stderr).trim());
        }
        String::from_utf8(output.stdout).with_context(|| format!("{} wrote no text", self.line()))
    }

    fn line(&self) -> String {
        let program = Path::new(self.0.get_program()).file_name().unwrap_or_default();
        let words = std::iter::once(program).chain(self.0.get_args());
        words.map(|w| w.to_string_lossy()).collect::<Vec<_>>().join(" ")
    }
}

impl Tool {
    fn name(self) -> &'static str {
        match self {
            Tool::Compare => "compare",
            Tool::Frames => "frames",
            Tool::Conformance => "conformance",
            Tool::Gpu => "gpu",
            Tool::Orders => "orders",
            Tool::Peers => "peers",
            Tool::Sheet => "sheet",
            Tool::Speed => "speed",
        }
    }

    /// Builds and runs the tool. Without `--package`, so that it has the features of the whole workspace, as the tests have:
    /// with others, cargo would compile its dependencies for each.
    pub(crate) fn run(self, arguments: &[String]) -> Result<ExitCode> {
        // `cargo xtask compare -- --help`: the dashes were for us.
        let arguments = arguments.strip_prefix(&["--".to_owned()]).unwrap_or(arguments);
        let run = cargo("run").args(["--bin", self.name(), "--"]).args(arguments);
        match arguments.iter().any(|argument| argument == "--left-out") {
            // Times of pipelines are those of shaders that the driver has not seen: Mesa remembers them.
            true => run.env("MESA_SHADER_CACHE_DISABLE", "true").run(),
            false => run.run(),
        }
    }
}

/// The workspace's metadata, as JSON from cargo.
pub(crate) fn metadata() -> Result<String> {
    cargo("metadata").args(["--no-deps", "--format-version", "1"]).output()
}

/// The folder of real volumes: the one that the environment names, or in CI the one beside the checkout.
fn data_folder() -> Option<PathBuf> {
    if let Some(data) = env::var_os("BRICKFIELD_DATA").filter(|d| !d.is_empty()) {
        return std::path::absolute(data).ok();
    }
    let in_ci = env::var("CI").is_ok_and(|ci| ci == "true");
    Some(root().join("../shared/data")).filter(|d| in_ci && d.is_dir()).and_then(|d| d.canonicalize().ok())
}
