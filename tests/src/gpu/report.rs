//! The results of a measurement, as data: `gpu.json`.

use serde::{Deserialize, Serialize};

use super::budget::Unmeasured;
use super::devices::DeviceInfo;
use crate::report::Machine;
use crate::turns::Spread;

/// The version of `gpu.json`: a field that changes its meaning raises it, a new field does not.
pub const GPU_FORMAT: u32 = 1;

/// Everything that was measured on one device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GpuReport {
    /// [`GPU_FORMAT`].
    pub format: u32,
    /// When it began, in UTC.
    pub date: String,
    /// `short` or `long`.
    pub form: String,
    /// The seconds that were allowed.
    pub seconds_allowed: f64,
    /// The seconds that it took.
    pub seconds: f64,
    /// Of what.
    pub versions: Versions,
    /// On which machine.
    pub machine: Machine,
    /// Main memory that was free when it began, where the system tells it.
    pub memory_bytes: Option<u64>,
    /// On which device, by each GPU backend.
    pub devices: Vec<DeviceInfo>,
    /// How long each part took, and the measurements that it left out.
    pub parts: Vec<Part>,
    /// The failures; empty if all is well.
    pub failures: Vec<String>,
    /// Both backends against the f64 answer, and against each other.
    pub conformance: Conformance,
    /// Exact and fast mode against the f64 answer.
    pub errors: Vec<ModeError>,
    /// How finely the device's filter weighs.
    pub filters: Vec<FilterBits>,
    /// Frames by turns.
    pub contest: Vec<Times>,
    /// The octree's build, in millions of voxels a second.
    pub octree_mvoxels_per_s: Option<f64>,
    /// The volumes of the steady frames.
    pub volumes: Vec<VolumeInfo>,
    /// Frame after frame with resident bricks.
    pub steady: Vec<Steady>,
    /// How fast the device reads trilinear values.
    pub textures: Vec<TextureRate>,
}

/// Versions of the measured program and libraries.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Versions {
    pub brickfield: String,
    /// As stated by the caller or by git; `unknown` if neither does.
    pub commit: String,
    pub wgpu: String,
    pub ash: String,
    pub naga: String,
}

/// A part of the measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Part {
    pub name: String,
    pub seconds: f64,
    pub left_out: Vec<Unmeasured>,
}

/// The outcome of conformance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Conformance {
    pub n_cases: usize,
    pub n_cases_run: usize,
    /// For each backend, and for the pair of both, which must be equal to the bit.
    pub counts: Vec<CaseCounts>,
}

/// Outcomes of one backend, or of the pair (`wgpu=ash`).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct CaseCounts {
    pub backend: String,
    pub passed: usize,
    pub failed: usize,
    /// Unsupported by the device, no device, or no data.
    pub skipped: usize,
}

/// How far a mode's picture is from the sum that it stands for, in f64.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ModeError {
    pub backend: String,
    /// Type of the voxels.
    pub scalar: String,
    /// `exact`, `fast without a floor` (the filter's error alone) or `fast`.
    pub mode: String,
    pub rmse: f64,
    pub max: f64,
    pub p999: f64,
    /// The greatest error in units of the rule's bound in its pixel.
    pub of_bound: f64,
    /// Why the rule is broken, if it is.
    pub complaint: Option<String>,
}

/// Bits of a filter's weight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct FilterBits {
    pub backend: String,
    /// Type of the voxels.
    pub scalar: String,
    /// The bits that the backend states (`subTexelPrecisionBits`), or assumes.
    pub stated: u32,
    /// The binary logarithm of the steps between two samples; no more than the positions that were looked at tell apart.
    pub measured: f64,
}

/// Times of one contestant, in milliseconds: from the scene to the picture in memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Times {
    pub what: String,
    pub backend: String,
    pub n_rounds: u32,
    pub ms: Spread,
}

/// A volume of steady frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct VolumeInfo {
    /// Along each side.
    pub voxels: u32,
    /// Next to nothing where an earlier part had made it.
    pub generate_s: f64,
    pub build_s: f64,
    pub volume_bytes: u64,
    pub tree_bytes: u64,
    /// Bricks and their bytes on the device with skipping.
    pub visible_bricks: u32,
    pub visible_bytes: u64,
    /// Bricks and their bytes on the device without skipping, if they were drawn.
    pub all_bricks: Option<u32>,
    pub all_bytes: Option<u64>,
    /// The most main memory that the process held until then, where the system tells it.
    pub peak_host_bytes: Option<u64>,
}

/// Steady frames of one scene on one backend.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Steady {
    /// Voxels along each side.
    pub voxels: u32,
    /// Pixels along both sides.
    pub pixels: u32,
    /// `exact`, `fast`, or `fast without a floor`.
    pub mode: String,
    /// Whether bricks, macrocells and rays beside them are skipped.
    pub skipping: bool,
    pub backend: String,
    pub n_frames: u32,
    /// Of the frame that brought the bricks, its shader included; `None` where another mode had brought them.
    pub first_upload_ms: Option<f64>,
    pub prepare_ms: Spread,
    pub upload_ms: Spread,
    /// `None` where the device has no timestamps.
    pub device_ms: Option<Spread>,
    pub wall_ms: Spread,
    pub read_back_ms: Spread,
    /// From the scene to the picture in memory.
    pub whole_ms: Spread,
    /// Values that a frame samples: known without skipping.
    pub n_samples: Option<u64>,
    /// The same, by the device's time.
    pub msamples_per_s: Option<f64>,
    /// That over the rate at which the device reads textures of this size ([`TextureRate`]): two gathers for exact mode, the
    /// filter for fast mode.
    pub of_texture_rate: Option<f64>,
}

/// Trilinear values along rays through a texture, and nothing else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct TextureRate {
    pub backend: String,
    /// `filtered` or `gathered` (two gathers of four texels).
    pub fetch: String,
    pub bytes_per_texel: usize,
    /// Along each side.
    pub texels: u32,
    /// Along both sides.
    pub rays: u32,
    pub n_samples: u64,
    pub n_runs: u32,
    /// `None` where the device has no timestamps.
    pub device_ms: Option<Spread>,
    pub wall_ms: Spread,
    /// `device`, or `wait` where the device's timestamps are missing or contradict the time that the caller waited.
    pub timed_by: String,
    pub msamples_per_s: f64,
}

impl GpuReport {
    /// A report's JSON.
    ///
    /// # Errors
    /// Text that is none, or one of another format.
    pub fn parse(text: &str) -> Result<GpuReport, String> {
        let value: serde_json::Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
        match value["format"].as_u64() {
            Some(format) if format == u64::from(GPU_FORMAT) => serde_json::from_value(value).map_err(|e| e.to_string()),
            format => Err(format!("format {format:?}; this program reads {GPU_FORMAT}")),
        }
    }
}

impl Versions {
    /// The versions of this build; `commit` is the one that the caller states.
    pub(super) fn here(commit: Option<&str>) -> Versions {
        let of = |name: &str| {
            locked(include_str!(env!("BRICKFIELD_LOCK_FILE")), name).unwrap_or_else(|| "unknown".to_owned())
        };
        Versions {
            brickfield: env!("CARGO_PKG_VERSION").to_owned(),
            commit: commit.map_or_else(crate::report::commit, str::to_owned),
            wgpu: of("wgpu"),
            ash: of("ash"),
            naga: of("naga"),
        }
    }
}

/// A package's version in a lock file.
fn locked(lock: &str, name: &str) -> Option<String> {
    let mut lines = lock.lines().skip_while(|l| *l != format!("name = \"{name}\""));
    let version = lines.nth(1)?.strip_prefix("version = \"")?.strip_suffix('"')?;
    Some(version.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_those_of_the_lock_file() {
        let lock = "[[package]]\nname = \"wgpu-hal\"\nversion = \"1.0.0\"\n\n[[package]]\nname = \"wgpu\"\nversion = \"30.0.1\"\n";
        assert_eq!(locked(lock, "wgpu").as_deref(), Some("30.0.1"));
        assert_eq!(locked(lock, "gpu"), None);
        let here = Versions::here(Some("abc"));
        assert!([&here.wgpu, &here.ash, &here.naga].iter().all(|v| v.split('.').count() >= 3), "{here:?}");
        assert_eq!(here.commit, "abc");
    }

    #[test]
    fn another_format_is_refused() {
        assert!(GpuReport::parse("{\"format\": 99}").unwrap_err().starts_with("format Some(99)"));
        assert!(GpuReport::parse("nothing").is_err());
    }
}
