//! Makes the packages as a registry would get them.

use std::process::ExitCode;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::spawn::{Spawn, cargo, metadata};

/// The fields of a package that a registry shows. Licence and readme are also files, which go with it.
const FIELDS: [&str; 6] = ["description", "license", "readme", "documentation", "keywords", "categories"];

/// The files of every package.
const FILES: [&str; 3] = ["LICENSE-APACHE", "LICENSE-MIT", "README.md"];

/// The command: packs every publishable crate, builds none. `cargo package --workspace` builds them, too.
pub(crate) fn package() -> Result<ExitCode> {
    let (published, kept) = packages(&metadata()?)?;
    let mut lacks = vec![];
    for package in &published {
        let name = package["name"].as_str().context("a package without name")?;
        lacks.extend(lacking_fields(package).map(|field| format!("{name} has no {field} in its Cargo.toml")));
        let list = pack(&["--list", "--package", name]).output()?;
        lacks.extend(lacking_files(&list).map(|file| format!("{name} comes without {file}")));
    }
    for lack in &lacks {
        eprintln!("package: {lack}");
    }
    let excluded = kept.iter().flat_map(|p| ["--exclude", p["name"].as_str().unwrap_or_default()]);
    let packed = pack(&["--workspace", "--no-verify"]).args(excluded).run()?;
    Ok(if lacks.is_empty() { packed } else { ExitCode::FAILURE })
}

/// The names of the packages that may be published.
pub(crate) fn published() -> Result<Vec<String>> {
    let (published, _) = packages(&metadata()?)?;
    Ok(published.iter().filter_map(|p| p["name"].as_str().map(str::to_owned)).collect())
}

/// `cargo package`, of the working tree as it is.
fn pack(arguments: &[&str]) -> Spawn {
    cargo("package").arg("--allow-dirty").args(arguments)
}

/// The packages that may be published, and the packages that may not.
fn packages(metadata: &str) -> Result<(Vec<Value>, Vec<Value>)> {
    let mut metadata: Value = serde_json::from_str(metadata).context("cargo metadata is not JSON")?;
    let Value::Array(all) = metadata["packages"].take() else { anyhow::bail!("cargo metadata lists no packages") };
    Ok(all.into_iter().partition(|p| p["publish"].is_null()))
}

fn lacking_fields(package: &Value) -> impl Iterator<Item = &'static str> {
    let empty = |v: &Value| v.is_null() || v.as_array().is_some_and(Vec::is_empty);
    FIELDS.into_iter().filter(move |field| empty(&package[*field]))
}

fn lacking_files(list: &str) -> impl Iterator<Item = &'static str> {
    FILES.into_iter().filter(move |file| !list.lines().any(|line| line == *file))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_package_lacks_is_named() {
        let package = serde_json::json!({
            "name": "a", "description": "A", "license": "MIT", "readme": "README.md",
            "documentation": null, "keywords": [], "categories": ["graphics"]
        });
        assert_eq!(lacking_fields(&package).collect::<Vec<_>>(), ["documentation", "keywords"]);
        assert_eq!(lacking_files("LICENSE-MIT\nsrc/README.md\nLICENSE-APACHE\n").collect::<Vec<_>>(), ["README.md"]);
    }

    #[test]
    fn what_is_not_published_is_told_apart() {
        let metadata = r#"{"packages": [{"name": "a", "publish": null}, {"name": "xtask", "publish": []}]}"#;
        let (published, kept) = packages(metadata).unwrap();
        assert_eq!((&published[0]["name"], &kept[0]["name"]), (&"a".into(), &"xtask".into()));
    }
}
