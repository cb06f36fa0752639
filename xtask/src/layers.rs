//! Holds the workspace's packages to the arrows of ARCHITECTURE.md, and to the packages that they must not bring.

use std::collections::BTreeSet;
use std::fs;
use std::process::ExitCode;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::architecture::crates_in_table;
use crate::kept_out::brought;
use crate::spawn::{metadata, root};

/// Which packages of the workspace a package may name, dev- and build-dependencies included. The only such table.
const ALLOWED: &[(&str, &[&str])] = &[
    ("brickfield-core", &[]),
    ("brickfield-optics", &["core"]),
    ("brickfield-io", &["core", "optics", "haar"]),
    ("brickfield-bricks", &["core", "optics"]),
    ("brickfield-lod", &["core", "optics"]),
    ("brickfield-interp", &["core", "optics"]),
    ("brickfield-trim", &["core", "optics"]),
    ("brickfield-haar", &["core"]),
    ("brickfield-haar-zarrs", &["core", "haar"]),
    ("brickfield-curvilinear", &["core"]),
    // It is tested against the server.
    ("brickfield-fetch", &["core", "serve"]),
    ("brickfield-serve", &[]),
    ("brickfield-frame", &["core", "optics", "haar"]),
    ("brickfield-shaders", &["core", "optics", "frame"]),
    ("brickfield-cpu", &["core", "optics", "interp", "curvilinear", "frame"]),
    ("brickfield-wgpu", &["core", "frame", "shaders"]),
    ("brickfield-ash", &["core", "frame", "shaders"]),
    ("brickfield", BELOW),
    ("brickfield-conformance", ALL),
    ("xtask", &[]),
];

/// Everything below the tests, the front door first; a name without prefix is short for `brickfield-` and that name, "" for `brickfield`.
const ALL: &[&str] = &[
    "",
    "core",
    "optics",
    "io",
    "bricks",
    "lod",
    "interp",
    "trim",
    "haar",
    "curvilinear",
    "fetch",
    "serve",
    "frame",
    "shaders",
    "cpu",
    "wgpu",
    "ash",
];

/// Everything below the front door.
const BELOW: &[&str] = ALL.split_at(1).1;

/// Outside packages that only one package may name.
const OWNED: &[(&str, &str)] = &[
    ("wgpu", "brickfield-wgpu"),
    ("wgpu-core", "brickfield-wgpu"),
    ("wgpu-hal", "brickfield-wgpu"),
    ("wgpu-types", "brickfield-wgpu"),
    ("ash", "brickfield-ash"),
    ("object_store", "brickfield-fetch"),
];

/// A package of the workspace: its name, its folder, and the names of its dependencies of all kinds.
#[derive(Debug)]
struct Package {
    name: String,
    folder: String,
    dependencies: BTreeSet<String>,
}

/// The command.
pub(crate) fn layers() -> Result<ExitCode> {
    let packages = packages(&metadata()?)?;
    let path = root().join("ARCHITECTURE.md");
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut found = violations(&packages, &crates_in_table(&text));
    for package in &packages {
        found.extend(brought(&package.name)?);
    }
    for violation in &found {
        eprintln!("layers: {violation}");
    }
    if found.is_empty() {
        eprintln!("layers: {} packages keep to the arrows", packages.len());
    }
    Ok(if found.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn packages(metadata: &str) -> Result<Vec<Package>> {
    let metadata: Value = serde_json::from_str(metadata).context("cargo metadata is not JSON")?;
    let list = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    list.iter().map(package).collect()
}

fn package(value: &Value) -> Result<Package> {
    let text =
        |v: &Value, what: &str| v.as_str().map(str::to_owned).with_context(|| format!("a package without {what}"));
    let manifest = text(&value["manifest_path"], "manifest_path")?;
    let folder = manifest.replace('\\', "/").rsplit('/').nth(1).unwrap_or_default().to_owned();
    let dependencies = value["dependencies"].as_array().context("a package without dependencies")?;
    Ok(Package {
        name: text(&value["name"], "name")?,
        folder,
        dependencies: dependencies
            .iter()
            .map(|d| text(&d["name"], "a name in its dependencies"))
            .collect::<Result<_>>()?,
    })
}

/// All that is wrong, one line each.
fn violations(packages: &[Package], table: &BTreeSet<String>) -> Vec<String> {
    let names: BTreeSet<String> = packages.iter().map(|p| p.name.clone()).collect();
    let edges = packages.iter().flat_map(|p| p.dependencies.iter().filter_map(|d| edge(p, d, &names)));
    let folders = packages.iter().filter_map(folder);
    let unlisted = names.difference(table).map(|n| format!("{n} is missing from the crate table of ARCHITECTURE.md"));
    let gone =
        table.difference(&names).map(|n| format!("the crate table of ARCHITECTURE.md lists {n}, which does not exist"));
    edges.chain(folders).chain(unlisted).chain(gone).collect()
}

/// The fault of one dependency, if it has one.
fn edge(package: &Package, dependency: &str, workspace: &BTreeSet<String>) -> Option<String> {
    let name = &package.name;
    if let Some((_, owner)) = OWNED.iter().find(|(d, owner)| *d == dependency && owner != name) {
        return Some(format!("{name} names {dependency}; only {owner} may"));
    }
    if !workspace.contains(dependency) {
        return None;
    }
    let Some((_, allowed)) = ALLOWED.iter().find(|(n, _)| n == name) else {
        return Some(format!("{name} has no row in the table of allowed arrows (xtask/src/layers.rs)"));
    };
    let short = dependency.strip_prefix("brickfield").map(|d| d.trim_start_matches('-'));
    let ok = short.is_some_and(|short| allowed.contains(&short));
    (!ok).then(|| format!("{name} depends on {dependency}; ARCHITECTURE.md has no such arrow"))
}

/// Directory = package name; but the conformance package lives in `tests/`.
fn folder(package: &Package) -> Option<String> {
    let expected = if package.name == "brickfield-conformance" { "tests" } else { &package.name };
    (package.folder != expected).then(|| format!("{} lies in {}/, not in {expected}/", package.name, package.folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Made-up metadata: name, folder, dependencies.
    fn check(made_up: &[(&str, &str, &[&str])]) -> Vec<String> {
        let package = |(name, folder, dependencies): &(&str, &str, &[&str])| {
            let dependencies: Vec<Value> =
                dependencies.iter().map(|d| serde_json::json!({ "name": d, "kind": "dev" })).collect();
            let manifest_path = format!("/somewhere/{folder}/Cargo.toml");
            serde_json::json!({ "name": name, "manifest_path": manifest_path, "dependencies": dependencies })
        };
        let list: Vec<Value> = made_up.iter().map(package).collect();
        let metadata = serde_json::json!({ "packages": list }).to_string();
        let table = made_up.iter().map(|(name, ..)| (*name).to_owned()).collect();
        violations(&packages(&metadata).unwrap(), &table)
    }

    const CORE: (&str, &str, &[&str]) = ("brickfield-core", "brickfield-core", &["glam"]);
    const CPU: (&str, &str, &[&str]) = ("brickfield-cpu", "brickfield-cpu", &["brickfield-core", "rayon"]);

    #[test]
    fn good_arrows_are_silent() {
        let wgpu: (&str, &str, &[&str]) = ("brickfield-wgpu", "brickfield-wgpu", &["brickfield-core", "wgpu"]);
        let all: (&str, &str, &[&str]) = ("brickfield", "brickfield", &["brickfield-cpu", "brickfield-wgpu"]);
        let tests: (&str, &str, &[&str]) = ("brickfield-conformance", "tests", &["brickfield", "brickfield-cpu"]);
        assert_eq!(check(&[CORE, CPU, wgpu, all, tests]), [""; 0]);
    }

    #[test]
    fn an_arrow_backwards_or_sideways_is_found() {
        let core: (&str, &str, &[&str]) = ("brickfield-core", "brickfield-core", &["brickfield-cpu"]);
        assert_eq!(
            check(&[core, CPU]),
            ["brickfield-core depends on brickfield-cpu; ARCHITECTURE.md has no such arrow"]
        );
        let shaders: (&str, &str, &[&str]) = ("brickfield-shaders", "brickfield-shaders", &[]);
        let cpu: (&str, &str, &[&str]) = ("brickfield-cpu", "brickfield-cpu", &["brickfield-shaders"]);
        assert_eq!(check(&[cpu, shaders]).len(), 1, "cpu never sees shaders");
    }

    #[test]
    fn only_the_owner_names_a_library_that_it_hides() {
        let ash: (&str, &str, &[&str]) = ("brickfield-ash", "brickfield-ash", &["ash", "wgpu-hal"]);
        assert_eq!(check(&[ash]), ["brickfield-ash names wgpu-hal; only brickfield-wgpu may"]);
    }

    #[test]
    fn an_unknown_package_and_a_wrong_folder_are_found() {
        let new: (&str, &str, &[&str]) = ("brickfield-new", "new", &["brickfield-core"]);
        let found = check(&[CORE, new]);
        assert!(found[0].contains("no row in the table") && found[1].contains("lies in new/"), "{found:?}");
    }

    #[test]
    fn the_table_lists_exactly_the_packages() {
        let metadata =
            r#"{"packages": [{"name": "xtask", "manifest_path": "/r/xtask/Cargo.toml", "dependencies": []}]}"#;
        let table = BTreeSet::from(["brickfield-core".to_owned()]);
        let found = violations(&packages(metadata).unwrap(), &table);
        assert_eq!(found.len(), 2);
        assert!(found[0].starts_with("xtask is missing") && found[1].contains("lists brickfield-core"), "{found:?}");
    }

    #[test]
    fn metadata_of_another_shape_is_an_error() {
        assert!(packages("{}").is_err() && packages("no").is_err());
    }
}
