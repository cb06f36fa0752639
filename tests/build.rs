//! Finds the lock file that states the versions of dependencies: a package has its own, the workspace has one beside the folder.

use std::env;
use std::path::PathBuf;

fn main() {
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let lock = [package.join("Cargo.lock"), package.join("../Cargo.lock")].into_iter().find(|path| path.is_file());
    println!("cargo::rerun-if-changed=build.rs");
    if let Some(lock) = lock {
        println!("cargo::rerun-if-changed={}", lock.display());
        println!("cargo::rustc-env=BRICKFIELD_LOCK_FILE={}", lock.display());
    }
}
