//! The results of a comparison, as data (`report.json`), as a table for the terminal and as one self-contained page.

mod front;
mod heat;
mod machine;
mod page;
mod plot;
mod slope;
mod table;

use brickfield_optics::QuadratureRule;
use serde::{Deserialize, Serialize};

pub use front::{Cost, mark_front, on_front};
pub use heat::{HEAT_RANGE, heat, heat_of_share};
pub use machine::{Machine, commit};
pub use page::page;
pub use slope::observed_order;
pub use table::{absences, table};

/// The version of `report.json`: a field that changes its meaning raises it, a new field does not.
pub const REPORT_FORMAT: u32 = 1;

/// The one command that brings a software Vulkan driver to a machine.
pub const SETUP_COMMAND: &str = "cargo xtask setup --yes";

/// Error against run time, of one scene on one machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`REPORT_FORMAT`].
    pub format: u32,
    /// What was rendered.
    pub scene: SceneInfo,
    /// The commit of the source, with `-dirty` where files were changed; `unknown` outside a checkout.
    pub commit: String,
    /// Where it was rendered.
    pub machine: Machine,
    /// The Vulkan drivers that took part, or `none`.
    pub driver: String,
    /// Every backend, present or absent.
    pub backends: Vec<BackendInfo>,
    /// The reference that the errors are taken against.
    pub reference: ReferenceInfo,
    /// The channels that the errors are over.
    #[serde(default)]
    pub channels: Channels,
    /// One row for each backend, mode, rule and step.
    pub rows: Vec<Row>,
    /// The points that were asked for and not measured, and why.
    pub left_out: Vec<LeftOut>,
    /// How long the whole comparison took.
    pub total_seconds: f64,
}

/// The channels of pictures that count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channels {
    /// Colours, and alpha beside them.
    #[default]
    All,
    /// Colours over black: pictures without alpha are among them.
    Colors,
}

impl Channels {
    /// As sentences name them.
    pub const fn words(self) -> &'static str {
        match self {
            Channels::All => "four channels",
            Channels::Colors => "three colour channels, as they are seen over black",
        }
    }
}

/// What was rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneInfo {
    /// `phantom`, or the file's name.
    pub name: String,
    /// Voxels along x, y, z.
    pub dims: [u32; 3],
    /// World units between samples along x, y, z.
    pub spacing: [f64; 3],
    /// The native scalar type.
    pub scalar: String,
    /// Width and height of the picture, in pixels.
    pub size: [u32; 2],
    /// Where the camera stands, in world units.
    pub eye: [f64; 3],
    /// Its unit view direction.
    pub forward: [f64; 3],
    /// Its unit vector to the top of the picture.
    pub up: [f64; 3],
    /// `perspective 27 degrees` or `orthographic 200 units`.
    pub projection: String,
    /// The transfer function, as it can be given to `--transfer`.
    pub transfer: brickfield_core::TransferFunction,
    /// Linear RGB behind the picture; colour differences and PNG files are over it.
    pub background: [f64; 3],
    /// The command, as a shell takes it.
    pub command: String,
}

/// The answer that the errors are taken against.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceInfo {
    /// What it is.
    pub what: String,
    /// The bound on its own error in any channel.
    pub tolerance: f64,
    /// How long it took.
    pub seconds: f64,
    /// Its picture for looking, relative to the report.
    pub png: String,
    /// Its picture for measuring (rounded to f32), relative to the report.
    pub exr: String,
}

/// A backend, and whether it took part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BackendInfo {
    /// `cpu`, `wgpu` or `ash`.
    pub backend: String,
    /// Its adapter, if it took part.
    pub adapter: Option<String>,
    /// The adapter's driver, if it took part.
    pub driver: Option<String>,
    /// Why it did not take part, in a line.
    pub absent: Option<String>,
}

/// One measurement: a backend, a mode, a rule and a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// `cpu`, `wgpu`, `ash`, or a peer's name.
    pub backend: String,
    /// The adapter's name.
    pub adapter: String,
    /// `exact` or `fast`.
    pub mode: String,
    /// The quadrature rule's name; `peer` for a peer's own.
    pub rule: String,
    /// Length of a segment, in units of the least voxel spacing.
    pub step_voxels: f64,
    /// Nodes of all segments in the domain, over all rays: the number of evaluations without skipping.
    pub samples: u64,
    /// Median wall time of rendering, without upload and read-back.
    pub median_ms: f64,
    /// Least wall time.
    pub min_ms: f64,
    /// Greatest wall time.
    pub max_ms: f64,
    /// Median time by the device's own clock, where it has one.
    pub device_ms: Option<f64>,
    /// The first frame's upload and pipeline building.
    pub upload_ms: f64,
    /// Number of timed frames; the first, which warms up, is not among them unless it is the only one.
    pub n_frames: u32,
    /// Root mean square difference over all pixels and the report's channels.
    pub rmse: f64,
    /// Greatest difference of any channel.
    pub max_abs: f64,
    /// Where: column and row.
    pub worst_pixel: [u32; 2],
    /// 99.9 % of the pixels differ by at most this much in every channel.
    pub p999: f64,
    /// Mean colour difference (CIE 1976 L*u*v*) over the scene's background.
    pub delta_e_mean: f64,
    /// 95 % of the pixels have at most this colour difference.
    pub delta_e_p95: f64,
    /// No other row has both less error (rmse) and less time (median).
    pub on_front: bool,
    /// The picture for measuring, relative to the report.
    pub exr: String,
    /// The picture for looking.
    pub png: String,
    /// Picture less reference, signed, for measuring.
    pub difference_exr: String,
    /// The same for looking: each pixel's greatest difference on the logarithmic colour scale of [`heat`].
    pub difference_png: String,
}

/// A measurement that was not taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct LeftOut {
    pub backend: String,
    pub mode: String,
    pub rule: String,
    pub step_voxels: f64,
    pub reason: String,
}

/// The settings that the points of one curve share.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct CurveKey {
    pub mode: String,
    pub rule: String,
    pub backend: String,
    pub adapter: String,
}

impl Row {
    /// The curve that the row lies on.
    pub fn curve(&self) -> CurveKey {
        let (mode, rule) = (self.mode.clone(), self.rule.clone());
        CurveKey { mode, rule, backend: self.backend.clone(), adapter: self.adapter.clone() }
    }
}

impl CurveKey {
    fn rank(&self) -> (String, usize, usize, String) {
        let rules = QuadratureRule::ALL.map(|r| r.name());
        let place = |list: &[&str], name: &str| list.iter().position(|n| *n == name).unwrap_or(list.len());
        let backend = place(&["cpu", "wgpu", "ash"], &self.backend);
        (self.mode.clone(), place(&rules, &self.rule), backend, self.adapter.clone())
    }
}

impl Report {
    /// The curves, by mode, rule (coarsest first) and backend, each with its rows from the largest step to the smallest.
    pub fn curves(&self) -> Vec<(CurveKey, Vec<&Row>)> {
        let mut keys: Vec<CurveKey> = Vec::new();
        for key in self.rows.iter().map(Row::curve) {
            if !keys.contains(&key) {
                keys.push(key);
            }
        }
        keys.sort_by_key(CurveKey::rank);
        let rows = |key: &CurveKey| {
            let mut rows: Vec<&Row> = self.rows.iter().filter(|r| r.curve() == *key).collect();
            rows.sort_by(|a, b| b.step_voxels.total_cmp(&a.step_voxels));
            rows
        };
        keys.into_iter().map(|key| (key.clone(), rows(&key))).collect()
    }
}

/// A step as people write it: 2, 1, 1/2, 1/64, else a decimal.
pub fn step_label(step_voxels: f64) -> String {
    let inverse = 1.0 / step_voxels;
    if step_voxels < 1.0 && inverse.fract() == 0.0 { format!("1/{inverse}") } else { step_voxels.to_string() }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use brickfield_core::TransferFunction;

    /// A row of a curve with error ~ step^order.
    pub(crate) fn row(backend: &str, rule: &str, mode: &str, step: f64, ms: f64, rmse: f64) -> Row {
        let name = format!("{backend}-{mode}-{rule}-{step}");
        Row {
            backend: backend.to_owned(),
            adapter: format!("{backend} adapter"),
            mode: mode.to_owned(),
            rule: rule.to_owned(),
            step_voxels: step,
            samples: (1e6 / step) as u64,
            median_ms: ms,
            min_ms: 0.9 * ms,
            max_ms: 1.3 * ms,
            device_ms: None,
            upload_ms: 3.0,
            n_frames: 5,
            rmse,
            max_abs: 10.0 * rmse,
            worst_pixel: [1, 2],
            p999: 5.0 * rmse,
            delta_e_mean: 100.0 * rmse,
            delta_e_p95: 300.0 * rmse,
            on_front: false,
            exr: format!("images/{name}.exr"),
            png: format!("images/{name}.png"),
            difference_exr: format!("images/{name}-difference.exr"),
            difference_png: format!("images/{name}-difference.png"),
        }
    }

    pub(crate) fn report() -> Report {
        let mut rows = Vec::new();
        for (b, (backend, speed)) in [("cpu", 1.0f64), ("wgpu", 0.6), ("ash", 0.5)].into_iter().enumerate() {
            for (rule, order, factor) in [
                ("left-exponential", 1, 2e-2f64),
                ("midpoint", 2, 4e-3),
                ("pre-integrated", 2, 1e-3),
                ("gauss2", 2, 2e-3),
            ] {
                for k in 0..8 {
                    let step = 2.0 / f64::from(1 << k);
                    let ms = speed * (4.0 + 3.0 * factor.log10().abs() / step) + 0.1 * b as f64;
                    rows.push(row(backend, rule, "exact", step, ms, (factor * step.powi(order)).max(4e-7)));
                    if k < 4 {
                        rows.push(row(backend, rule, "fast", step, 0.5 * ms, factor * step.powi(order) + 2e-3));
                    }
                }
            }
        }
        mark_front(&mut rows);
        let absent = BackendInfo {
            backend: "ash".to_owned(),
            adapter: None,
            driver: None,
            absent: Some("no Vulkan <driver> & no loader".to_owned()),
        };
        let present = BackendInfo {
            backend: "cpu".to_owned(),
            adapter: Some("2 threads".to_owned()),
            driver: Some("none".to_owned()),
            absent: None,
        };
        Report {
            format: REPORT_FORMAT,
            scene: SceneInfo {
                name: "phantom".to_owned(),
                dims: [112, 128, 120],
                spacing: [1.6, 1.6, 1.8],
                scalar: "u8".to_owned(),
                size: [128, 128],
                eye: [1.0, 2.0, 3.0],
                forward: [0.0, 1.0, 0.0],
                up: [0.0, 0.0, 1.0],
                projection: "perspective 27 degrees".to_owned(),
                transfer: TransferFunction::constant(0.5, [1.0, 0.5, 0.25]).unwrap(),
                background: [0.0; 3],
                command: "compare".to_owned(),
            },
            commit: "0123456789ab".to_owned(),
            machine: Machine::here(),
            driver: "llvmpipe".to_owned(),
            backends: vec![present, absent],
            reference: ReferenceInfo {
                what: "continuous f64".to_owned(),
                tolerance: 1e-9,
                seconds: 3.0,
                png: "images/reference.png".to_owned(),
                exr: "images/reference.exr".to_owned(),
            },
            channels: Channels::All,
            rows,
            left_out: vec![],
            total_seconds: 100.0,
        }
    }

    #[test]
    fn report_json_survives_a_round_trip_and_has_its_fields() {
        let json = serde_json::to_string(&report()).unwrap();
        assert_eq!(serde_json::from_str::<Report>(&json).unwrap(), report());
        let value: serde_json::Value = serde_json::from_str(&json).unwrap();
        for field in ["scene", "commit", "machine", "driver"] {
            assert!(!value[field].is_null(), "{field}");
        }
        let fields = "backend adapter mode rule step_voxels samples median_ms min_ms max_ms rmse max_abs delta_e_mean \
                      delta_e_p95 on_front";
        for field in fields.split_whitespace() {
            assert!(!value["rows"][0][field].is_null(), "{field}");
        }
    }

    #[test]
    fn curves_share_backend_rule_and_mode_and_run_to_small_steps() {
        let report = report();
        let curves = report.curves();
        assert_eq!(curves.len(), 3 * 4 * 2);
        assert_eq!(curves.iter().map(|c| c.1.len()).sum::<usize>(), report.rows.len());
        assert!(curves.iter().all(|c| c.1.windows(2).all(|w| w[0].step_voxels > w[1].step_voxels)));
    }

    #[test]
    fn steps_are_written_as_fractions() {
        assert_eq!([2.0, 1.0, 0.5, 0.015625, 0.3].map(step_label), ["2", "1", "1/2", "1/64", "0.3"]);
    }
}
