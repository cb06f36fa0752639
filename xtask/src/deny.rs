//! The rules for dependencies: deny.toml, held by cargo-deny.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;

use crate::spawn::{Spawn, cargo};

/// The command: everything that deny.toml says.
pub(crate) fn deny() -> Result<ExitCode> {
    let code = packages()?;
    if !has_database() {
        eprintln!("deny: advisories not checked: no database");
        return Ok(code);
    }
    let known = advisories()?;
    Ok(if code == ExitCode::SUCCESS { known } else { code })
}

/// Holds licences, versions and sources of all dependencies to deny.toml; an exception that nothing needs any more fails, too.
pub(crate) fn packages() -> Result<ExitCode> {
    cargo_deny(&["check", "--deny", "warnings", "bans", "licenses", "sources"]).run()
}

/// Looks all dependencies up in the database of advisories, as it is on this machine.
pub(crate) fn advisories() -> Result<ExitCode> {
    cargo_deny(&["--offline", "check", "advisories"]).run()
}

/// Whether there is a database of advisories: fetched now or, where it cannot be reached, before.
pub(crate) fn has_database() -> bool {
    let fetched = cargo_deny(&["fetch", "db"]).run().is_ok_and(|code| code == ExitCode::SUCCESS);
    fetched || cargo_home().is_some_and(|home| holds_database(&home.join("advisory-dbs")))
}

fn cargo_deny(arguments: &[&str]) -> Spawn {
    cargo("deny").args(arguments)
}

/// Whether one of a folder's folders is a database. cargo-deny puts a hash of the address into its name.
fn holds_database(folder: &Path) -> bool {
    let Ok(entries) = fs::read_dir(folder) else { return false };
    entries.flatten().any(|e| e.path().join("crates").is_dir())
}

fn cargo_home() -> Option<PathBuf> {
    let home = || env::home_dir().map(|home| home.join(".cargo"));
    env::var_os("CARGO_HOME").filter(|c| !c.is_empty()).map(PathBuf::from).or_else(home)
}
