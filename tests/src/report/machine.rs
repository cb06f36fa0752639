//! Which machine, which source.

use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

/// Where something was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor's name, as the system states it.
    pub cpu: String,
    /// Threads that this process may run at once.
    pub n_threads: usize,
    /// Operating system and architecture.
    pub os: String,
    /// `optimized`, or `checked`: with debug assertions, and times that say little.
    pub build: String,
}

impl Machine {
    /// The machine that this process runs on.
    pub fn here() -> Machine {
        Machine {
            cpu: cpu_name().unwrap_or_else(|| "unknown".to_owned()),
            n_threads: std::thread::available_parallelism().map_or(1, |n| n.get()),
            os: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            build: if cfg!(debug_assertions) { "checked" } else { "optimized" }.to_owned(),
        }
    }
}

/// The commit of this source, with `-dirty` where files differ from it; `unknown` if git cannot tell.
pub fn commit() -> String {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let described = Command::new("git")
        .args(["describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"])
        .current_dir(here)
        .stderr(std::process::Stdio::null())
        .output();
    match described {
        Ok(out) if out.status.success() => String::from_utf8_lossy(&out.stdout).trim().to_owned(),
        _ => "unknown".to_owned(),
    }
}

fn cpu_name() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    line.split_once(':').map(|(_, name)| name.trim().to_owned())
}
