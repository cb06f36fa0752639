//! Reports as rows of README.md's table "Measured on".

use super::report::{GpuReport, Steady};

const HEADER: &str = "\
| card, driver | date, form | backend | conformance | fast mode: RMSE, of the rule's bound | steady frame, fast / exact, ms of the device | \
texture reads, filter / gathers, M/s | march of them, fast / exact |
|---|---|---|---|---|---|---|---|
";

/// Two rows for each report, one a backend, and the header.
pub fn table(reports: &[GpuReport]) -> String {
    reports.iter().fold(HEADER.to_owned(), |text, report| text + &rows(report))
}

fn rows(report: &GpuReport) -> String {
    let row = |info: &super::DeviceInfo| {
        let (backend, card) = (info.backend.as_str(), info.adapter.as_deref().unwrap_or("absent"));
        let cells = [
            format!("{card}, {}", info.driver.as_deref().unwrap_or("no driver")),
            format!("{}, {}", report.date.split(' ').next().unwrap_or_default(), report.form),
            backend.to_owned(),
            conformance(report, backend),
            error(report, backend),
            sizes(report, |voxels| frames(report, backend, voxels)),
            sizes(report, |voxels| textures(report, backend, voxels)),
            sizes(report, |voxels| shares(report, backend, voxels)),
        ];
        format!("| {} |\n", cells.join(" | "))
    };
    report.devices.iter().map(row).collect()
}

fn conformance(report: &GpuReport, backend: &str) -> String {
    let counts = |name: &str| report.conformance.counts.iter().find(|c| c.backend == name);
    let own =
        counts(backend).map_or("-".to_owned(), |c| format!("{} of {} within the rules", c.passed, c.passed + c.failed));
    let pair = counts("wgpu=ash").map(|c| format!(", wgpu = ash in {} of {}", c.passed, c.passed + c.failed));
    own + &pair.unwrap_or_default()
}

/// The worst of all formats.
fn error(report: &GpuReport, backend: &str) -> String {
    let fast = || report.errors.iter().filter(|e| e.backend == backend && e.mode == "fast");
    let worst = |of: fn(&super::ModeError) -> f64| fast().map(of).fold(0.0, f64::max);
    match fast().next() {
        Some(_) => format!("{:.1e}, {:.2}", worst(|e| e.rmse), worst(|e| e.of_bound)),
        None => "-".to_owned(),
    }
}

/// A cell with something for each size of volume that was measured.
fn sizes(report: &GpuReport, of: impl Fn(u32) -> Option<String>) -> String {
    let each = report.volumes.iter().filter_map(|v| of(v.voxels).map(|text| format!("{}^3: {text}", v.voxels)));
    let each: Vec<String> = each.collect();
    if each.is_empty() { "-".to_owned() } else { each.join("; ") }
}

fn steady<'a>(report: &'a GpuReport, backend: &str, voxels: u32, mode: &str, skipping: bool) -> Option<&'a Steady> {
    let of =
        |s: &&Steady| (s.backend.as_str(), s.voxels, s.mode.as_str(), s.skipping) == (backend, voxels, mode, skipping);
    report.steady.iter().find(of)
}

fn frames(report: &GpuReport, backend: &str, voxels: u32) -> Option<String> {
    let ms = |mode| steady(report, backend, voxels, mode, true)?.device_ms.map(|ms| digits(ms.median));
    Some(format!("{} / {}", ms("fast")?, ms("exact")?))
}

fn textures(report: &GpuReport, backend: &str, voxels: u32) -> Option<String> {
    let rate = |fetch: &str| {
        let of = report.textures.iter().find(|t| {
            (t.backend.as_str(), t.texels, t.fetch.as_str(), t.bytes_per_texel) == (backend, voxels, fetch, 1)
        });
        of.map(|t| digits(t.msamples_per_s))
    };
    Some(format!("{} / {}", rate("filtered")?, rate("gathered")?))
}

fn shares(report: &GpuReport, backend: &str, voxels: u32) -> Option<String> {
    let share = |mode| steady(report, backend, voxels, mode, false)?.of_texture_rate.map(|share| format!("{share:.2}"));
    Some(format!("{} / {}", share("fast without a floor")?, share("exact")?))
}

/// Three digits.
fn digits(value: f64) -> String {
    let n_decimals = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 3);
    format!("{value:.*}", n_decimals as usize)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    /// The table in README.md is the table of the saved reports.
    #[test]
    fn the_readme_shows_the_saved_reports() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let mut files: Vec<_> =
            fs::read_dir(root.join("fixtures")).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.retain(|file| file.file_name().is_some_and(|n| n.to_string_lossy().starts_with("gpu-")));
        files.sort();
        let report = |file: &std::path::PathBuf| GpuReport::parse(&fs::read_to_string(file).unwrap()).unwrap();
        let reports: Vec<GpuReport> = files.iter().map(report).collect();
        let readme = fs::read_to_string(root.join("README.md")).unwrap();
        assert!(!reports.is_empty());
        assert!(readme.contains(&table(&reports)), "README.md must hold this table:\n{}", table(&reports));
    }

    #[test]
    fn numbers_have_three_digits() {
        let numbers = [(0.01234, "0.012"), (1.2345, "1.23"), (12.345, "12.3"), (1234.5, "1234"), (0.0, "0.000")];
        numbers.iter().for_each(|(value, text)| assert_eq!(digits(*value), *text));
    }
}
