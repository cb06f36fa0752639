//! The requirements of a machine beyond Rust, the missing ones among them, and how they are installed.

use std::env;
use std::fs;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use anyhow::Result;

use crate::spawn::Spawn;

/// Whether to install without asking.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Consent {
    Given,
    Ask,
}

/// Something a machine needs.
struct Need {
    name: &'static str,
    purpose: &'static str,
    is_there: fn() -> bool,
    from: Source,
}

/// Where it comes from.
enum Source {
    /// Packages of Debian and Ubuntu, Fedora, Arch Linux, Homebrew.
    System {
        debian: &'static str,
        fedora: &'static str,
        arch: &'static str,
        homebrew: &'static str,
    },
    Rustup {
        component: &'static str,
    },
    /// Built from crates.io.
    Cargo {
        package: &'static str,
        version: &'static str,
    },
}

const NEEDS: [Need; 6] = [
    Need {
        name: "Vulkan loader",
        purpose: "the wgpu and ash backends",
        is_there: has_loader,
        from: Source::System {
            debian: "libvulkan1",
            fedora: "vulkan-loader",
            arch: "vulkan-icd-loader",
            homebrew: "vulkan-loader",
        },
    },
    Need {
        name: "Vulkan driver",
        purpose: "the wgpu and ash backends (lavapipe needs no graphics card)",
        is_there: || finds("icd.d", |name| name.ends_with(".json")) || names_a_driver(),
        from: Source::System {
            debian: "mesa-vulkan-drivers",
            fedora: "mesa-vulkan-drivers",
            arch: "vulkan-swrast",
            homebrew: "molten-vk",
        },
    },
    Need {
        name: "Vulkan validation layer",
        purpose: "checking every call of the backends",
        is_there: || finds("explicit_layer.d", |name| name.starts_with("VkLayer_khronos_validation")),
        from: Source::System {
            debian: "vulkan-validationlayers",
            fedora: "vulkan-validation-layers",
            arch: "vulkan-validation-layers",
            homebrew: "vulkan-validationlayers",
        },
    },
    Need {
        name: "rustfmt",
        purpose: "cargo xtask ci",
        is_there: || answers("rustfmt"),
        from: Source::Rustup { component: "rustfmt" },
    },
    Need {
        name: "clippy",
        purpose: "cargo xtask ci",
        is_there: || answers("cargo-clippy"),
        from: Source::Rustup { component: "clippy" },
    },
    Need {
        name: "cargo-deny",
        purpose: "cargo xtask ci",
        is_there: || answers("cargo-deny"),
        from: Source::Cargo { package: "cargo-deny", version: "0.20.2" },
    },
];

/// Tools run for seconds: it is their build that should be quick.
const QUICK_BUILD: [&str; 6] = [
    "--config",
    "profile.release.lto=false",
    "--config",
    "profile.release.codegen-units=16",
    "--config",
    "profile.release.opt-level=1",
];

/// The command.
pub(crate) fn setup(consent: Consent) -> Result<ExitCode> {
    let missing: Vec<&Need> = NEEDS.iter().filter(|n| !(n.is_there)()).collect();
    if missing.is_empty() {
        eprintln!("setup: nothing is missing");
        return Ok(ExitCode::SUCCESS);
    }
    for need in &missing {
        eprintln!("setup: no {} (for {})", need.name, need.purpose);
    }
    let commands = commands(&missing);
    if !answers("apt-get") && missing.iter().any(|n| n.debian().is_some()) {
        name_packages(&missing);
        return Ok(ExitCode::FAILURE);
    }
    for command in &commands {
        eprintln!("setup: to install, run: {}", command.join(" "));
    }
    if consent == Consent::Ask && !agreed()? {
        eprintln!("setup: nothing installed; `cargo xtask setup --yes` installs without asking");
        return Ok(ExitCode::FAILURE);
    }
    install(&commands, &missing)
}

impl Need {
    fn debian(&self) -> Option<&'static str> {
        match self.from {
            Source::System { debian, .. } => Some(debian),
            Source::Rustup { .. } | Source::Cargo { .. } => None,
        }
    }

    fn component(&self) -> Option<&'static str> {
        match self.from {
            Source::Rustup { component } => Some(component),
            Source::System { .. } | Source::Cargo { .. } => None,
        }
    }

    /// The command that builds it.
    fn cargo_install(&self) -> Option<Vec<String>> {
        match self.from {
            Source::Cargo { package, version } => {
                let words = ["cargo", "install", "--locked", package, "--version", version];
                Some(words.iter().chain(&QUICK_BUILD).map(|w| (*w).to_owned()).collect())
            }
            Source::System { .. } | Source::Rustup { .. } => None,
        }
    }
}

/// The commands that install the missing requirements.
fn commands(missing: &[&Need]) -> Vec<Vec<String>> {
    let words = |fixed: &[&str], names: &[&str]| fixed.iter().chain(names).map(|w| (*w).to_owned()).collect::<Vec<_>>();
    let packages: Vec<&str> = missing.iter().filter_map(|n| n.debian()).collect();
    let components: Vec<&str> = missing.iter().filter_map(|n| n.component()).collect();
    let mut commands = vec![];
    if !packages.is_empty() {
        let sudo: &[&str] = if is_root() { &[] } else { &["sudo"] };
        commands.push(words(&[sudo, &["apt-get", "update"]].concat(), &[]));
        let install =
            ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "install", "--yes", "--no-install-recommends"];
        commands.push(words(&[sudo, &install].concat(), &packages));
    }
    if !components.is_empty() {
        commands.push(words(&["rustup", "component", "add"], &components));
    }
    commands.extend(missing.iter().filter_map(|n| n.cargo_install()));
    commands
}

fn install(commands: &[Vec<String>], missing: &[&Need]) -> Result<ExitCode> {
    for command in commands {
        let code = Spawn::new(&command[0]).args(&command[1..]).run()?;
        if code != ExitCode::SUCCESS {
            eprintln!("setup: {} failed", command.join(" "));
            return Ok(ExitCode::FAILURE);
        }
    }
    let still: Vec<&str> = missing.iter().filter(|n| !(n.is_there)()).map(|n| n.name).collect();
    if still.is_empty() {
        eprintln!("setup: done");
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("setup: installed, but still not found: {}", still.join(", "));
    Ok(ExitCode::FAILURE)
}

/// For systems without apt-get.
fn name_packages(missing: &[&Need]) {
    for need in missing {
        match need.from {
            Source::System { debian, fedora, arch, homebrew } => eprintln!(
                "setup: {} is in the package {debian} (Debian, Ubuntu), {fedora} (Fedora), {arch} (Arch Linux), \
                 {homebrew} (Homebrew); on Windows it comes with the graphics driver or the Vulkan SDK",
                need.name
            ),
            Source::Rustup { component } => eprintln!("setup: rustup component add {component}"),
            Source::Cargo { package, .. } => eprintln!("setup: cargo install --locked {package}"),
        }
    }
}

/// Asks on a terminal; no terminal means no.
fn agreed() -> io::Result<bool> {
    if !io::stdin().is_terminal() {
        return Ok(false);
    }
    eprint!("setup: install now? [y/N] ");
    io::stderr().flush()?;
    let mut answer = String::new();
    io::stdin().lock().read_line(&mut answer)?;
    Ok(["y", "yes"].contains(&answer.trim().to_ascii_lowercase().as_str()))
}

fn is_root() -> bool {
    let id = Command::new("id").arg("-u").output();
    id.is_ok_and(|o| o.stdout.trim_ascii() == b"0")
}

/// Whether a program can be started.
fn answers(program: &str) -> bool {
    let quiet = Command::new(program)
        .arg("--version")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    quiet.is_ok_and(|s| s.success())
}

fn has_loader() -> bool {
    let library =
        |name: &str| name.starts_with("libvulkan.so") || name.starts_with("libvulkan.") && name.ends_with("dylib");
    let listed =
        Command::new("ldconfig").arg("-p").output().or_else(|_| Command::new("/sbin/ldconfig").arg("-p").output());
    if listed.is_ok_and(|o| String::from_utf8_lossy(&o.stdout).contains("libvulkan.so.1")) {
        return true;
    }
    let named = env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    let system = ["/usr/lib", "/usr/local/lib", "/opt/homebrew/lib"].map(PathBuf::from);
    let windows = Path::new("C:\\Windows\\System32\\vulkan-1.dll").exists();
    windows || env::split_paths(&named).chain(system).any(|folder| holds(&folder, library))
}

/// Whether one of the loader's folders for drivers or layers holds a file.
fn finds(kind: &str, wanted: fn(&str) -> bool) -> bool {
    let data = env::var("XDG_DATA_DIRS").ok().filter(|d| !d.is_empty()).unwrap_or("/usr/local/share:/usr/share".into());
    let home = env::var("HOME").unwrap_or_default();
    let sdk = env::var("VULKAN_SDK").map(|s| format!("{s}/share"));
    let bases = ["/etc".to_owned(), "/usr/share".into(), "/opt/homebrew/share".into(), format!("{home}/.local/share")];
    let all = bases.into_iter().chain(sdk).chain(data.split(':').map(str::to_owned));
    all.map(|base| Path::new(&base).join("vulkan").join(kind)).any(|folder| holds(&folder, wanted))
}

/// The environment may name drivers itself.
fn names_a_driver() -> bool {
    ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"]
        .into_iter()
        .filter_map(env::var_os)
        .any(|v| env::split_paths(&v).any(|p| p.is_file()))
}

fn holds(folder: &Path, wanted: impl Fn(&str) -> bool) -> bool {
    let Ok(entries) = fs::read_dir(folder) else { return false };
    entries.flatten().any(|e| e.file_name().to_str().is_some_and(&wanted))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_name_all_that_is_missing_and_nothing_else() {
        let all: Vec<&Need> = NEEDS.iter().collect();
        let lines: Vec<String> = commands(&all).iter().map(|c| c.join(" ")).collect();
        assert!(lines[1].ends_with("libvulkan1 mesa-vulkan-drivers vulkan-validationlayers"), "{lines:?}");
        assert_eq!(lines[2], "rustup component add rustfmt clippy");
        assert!(lines[3].starts_with("cargo install --locked cargo-deny --version 0.20.2"), "{lines:?}");
        assert_eq!(commands(&all[3..5]).len(), 1);
        assert_eq!(commands(&[]).len(), 0);
    }
}
