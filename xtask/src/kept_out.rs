//! Holds each package to the packages that it must not bring, however far away the package that names them.

use std::collections::BTreeSet;

use anyhow::Result;

use crate::spawn::cargo;

/// Which packages no chain of a crate's dependencies may reach. Development dependencies do not count: a user of the crate
/// does not build them.
const KEPT_OUT: &[(&str, &[&[&str]])] = &[
    ("brickfield-core", &[FILES, COLORS, COMMANDS, GRAPHICS]),
    ("brickfield-optics", &[COMMANDS, GRAPHICS]),
    ("brickfield-io", &[COLORS, COMMANDS, GRAPHICS]),
    ("brickfield-bricks", &[FILES, COLORS, COMMANDS, GRAPHICS]),
    ("brickfield-lod", &[FILES, COMMANDS, GRAPHICS]),
    ("brickfield-interp", &[FILES, COLORS, COMMANDS, GRAPHICS]),
    ("brickfield-trim", &[FILES, COLORS, COMMANDS, GRAPHICS]),
    ("brickfield-haar", &[FILES, COLORS, COMMANDS, GRAPHICS]),
    // Zarr's metadata are JSON.
    ("brickfield-haar-zarrs", &[&["exr", "flate2", "image", "tempfile", "toml"], COLORS, COMMANDS, GRAPHICS]),
    ("brickfield-curvilinear", &[FILES, COLORS, COMMANDS, GRAPHICS]),
    // `object_store` brings serde.
    (
        "brickfield-fetch",
        &[&["exr", "flate2", "image", "tempfile", "toml", "reqwest", "rustls"], COLORS, COMMANDS, GRAPHICS],
    ),
    ("brickfield-serve", &[FILES, COLORS, COMMANDS, GRAPHICS, &["object_store"]]),
    ("brickfield-frame", &[FILES, COLORS, COMMANDS, GRAPHICS]),
    ("brickfield-shaders", &[FILES, COLORS, COMMANDS, &["ash", "wgpu"]]),
    ("brickfield-cpu", &[FILES, COLORS, COMMANDS, GRAPHICS]),
    ("brickfield-wgpu", &[FILES, COLORS, COMMANDS]),
    ("brickfield-ash", &[FILES, COLORS, COMMANDS, &["wgpu"]]),
    ("brickfield", &[]),
    ("brickfield-conformance", &[]),
    ("xtask", &[COLORS, GRAPHICS]),
];

const FILES: &[&str] = &["exr", "flate2", "image", "serde", "serde_json", "tempfile", "toml"];
const COLORS: &[&str] = &["palette"];
const COMMANDS: &[&str] = &["clap", "indicatif"];
const GRAPHICS: &[&str] = &["ash", "naga", "wesl", "wgpu"];

/// The forbidden packages that `package` brings, one line each.
pub(crate) fn brought(package: &str) -> Result<Vec<String>> {
    let Some((_, kept_out)) = KEPT_OUT.iter().find(|(name, _)| *name == package) else {
        return Ok(vec![format!("{package} has no row in the table of what is kept out (xtask/src/kept_out.rs)")]);
    };
    Ok(found(package, &kept_out.concat(), &tree(package)?))
}

/// The packages that a build of `package` alone compiles. `cargo metadata` cannot tell: its graph has every feature that any
/// member of the workspace asks for.
fn tree(package: &str) -> Result<String> {
    cargo("tree").args(["--package", package, "--edges", "normal,build", "--prefix", "none"]).output()
}

/// Which of `kept_out` are in a tree, each of whose lines begins with a package's name.
fn found(package: &str, kept_out: &[&str], tree: &str) -> Vec<String> {
    let names: BTreeSet<&str> = tree.lines().filter_map(|line| line.split(' ').next()).collect();
    let found = kept_out.iter().filter(|name| names.contains(*name));
    found.map(|name| format!("{package} brings {name}: see `cargo tree -p {package} -i {name}`")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_far_down_is_found_by_its_whole_name() {
        let tree = "a-wgpu v0.1.0 (/r/a-wgpu)\na-optics v0.1.0 (/r/a-optics)\npalette v0.7.7\ntoml_parser v1.1.5 (*)\n";
        let lines = found("a-wgpu", &["palette", "toml"], tree);
        assert_eq!(lines, ["a-wgpu brings palette: see `cargo tree -p a-wgpu -i palette`"]);
    }

    #[test]
    fn a_new_package_needs_a_row() {
        assert!(brought("brickfield-new").unwrap()[0].contains("has no row"));
    }
}
