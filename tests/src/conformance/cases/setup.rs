//! How a case states its scene: volume and transfer function, then the settings that differ from the defaults.

use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, BuildOptions, Downsampling, build_blocks, build_tree};
use brickfield::lod::{BlockLevels, Criterion};
use brickfield::{BlockStyle, Scene, TrimmedVolume, Trimming};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{
    Aabb, BlockLayout, BlockSide, BrickSide, Camera, Level, Projection, ScalarType, TransferFunction, Volume,
};
use brickfield_optics::{Light, LightSource, LightTerms, Normals, QuadratureRule, flat_below};

use super::super::case::{Case, Check, FlatBlocks, Mutant, NoData, Oracle, PictureTest, Shows, TrimmedBricks};
use super::super::storage::Storage;

/// A scene in the making.
pub(super) struct Setup {
    volume: Volume,
    side: BrickSide,
    downsampling: Downsampling,
    oracle: OracleKind,
    shows: Shows,
    triangles_at_a_time: Option<u32>,
    storage: Storage,
    blocks: Option<(BlockSide, FlatLevels, BlockStyle)>,
    trimming: Option<Trimming>,
    scene: Scene,
}

/// The levels of flat blocks.
#[derive(Clone, Copy)]
pub(super) enum FlatLevels {
    /// All blocks have this one.
    All(Level),
    /// Random ones, from the finest to one sample.
    Random,
}

impl FlatLevels {
    fn of(self, layout: BlockLayout) -> BlockLevels {
        match self {
            FlatLevels::All(level) => BlockLevels::uniform(layout, level),
            FlatLevels::Random => BlockLevels::random(layout, SEED),
        }
    }
}

/// Of random levels.
const SEED: u64 = 1;

#[derive(Clone, Copy)]
enum OracleKind {
    Volume,
    EveryLevel,
    None,
}

/// Side of most pictures.
pub(super) const PICTURE: UVec2 = UVec2::new(64, 56);
/// From where most cameras look: no axis, no symmetry.
pub(super) const OBLIQUE: DVec3 = DVec3::new(0.6, -1.0, 0.35);

impl Setup {
    /// A volume seen obliquely and whole, in bricks of 16, with the scene's defaults.
    pub(super) fn new(volume: Volume, transfer: TransferFunction) -> Setup {
        let camera = Camera::framing(&volume.grid().world_box(), OBLIQUE, DVec3::Z).expect("a volume has a box");
        Setup {
            side: BrickSide::S16,
            downsampling: Downsampling::Average,
            oracle: OracleKind::Volume,
            shows: Shows::Something,
            triangles_at_a_time: None,
            storage: Storage::default(),
            blocks: None,
            trimming: None,
            scene: Scene::new(camera, PICTURE, transfer),
            volume,
        }
    }

    /// With the scene changed.
    pub(super) fn with(mut self, change: impl FnOnce(&mut Scene)) -> Setup {
        change(&mut self.scene);
        self
    }

    /// There is nothing to see.
    pub(super) fn blank(self) -> Setup {
        Setup { shows: Shows::Nothing, ..self }
    }

    /// Draws polygons in batches of so many triangles.
    pub(super) fn triangles_at_a_time(self, n: u32) -> Setup {
        Setup { triangles_at_a_time: Some(n), ..self }
    }

    /// Stores the samples another way; averages reproduce a linear field.
    pub(super) fn stored(self, storage: Storage) -> Setup {
        let oracle = if storage == Storage::Averages { OracleKind::EveryLevel } else { self.oracle };
        Setup { storage, oracle, ..self }
    }

    /// Draws flat blocks; the volume's own samples know of those at full resolution.
    pub(super) fn blocks(self, side: BlockSide, levels: FlatLevels, style: BlockStyle) -> Setup {
        let oracle = match levels {
            FlatLevels::All(Level(0)) => self.oracle,
            _ => OracleKind::None,
        };
        Setup { oracle, blocks: Some((side, levels, style)), ..self }
    }

    /// Draws trimmed bricks.
    pub(super) fn trimmed(self, trimming: Trimming) -> Setup {
        Setup { trimming: Some(trimming), ..self }
    }

    /// In the light; surfaces begin at a gradient of a 64th of the values' range in the least spacing.
    pub(super) fn lit(self, source: LightSource, terms: LightTerms) -> Setup {
        let flat_below = flat_below(self.volume.range(), self.volume.grid().spacing().min_element());
        let light = Light::new(source, terms, flat_below).expect("a case's light is one");
        self.with(|s| s.light = Some(light))
    }

    /// On normals of stored gradients, of which the volume's own samples know nothing; for flat blocks.
    pub(super) fn stored_normals(self) -> Setup {
        let setup = self.with(|s| s.light = s.light.map(|light| light.on_normals(Normals::Stored)));
        Setup { oracle: OracleKind::None, ..setup }
    }

    /// On normals of surface voxels; for flat blocks.
    pub(super) fn surface_normals(self) -> Setup {
        self.with(|s| s.light = s.light.map(|light| light.on_normals(Normals::Surface)))
    }

    /// Surfaces begin at another gradient.
    pub(super) fn flat_below_times(self, factor: f64) -> Setup {
        let scaled = |light: Light| Light::new(light.source(), light.terms(), light.flat_below() * factor);
        self.with(|s| s.light = s.light.map(|light| scaled(light).expect("a case's light is one")))
    }

    pub(super) fn rule(self, rule: QuadratureRule) -> Setup {
        self.with(|s| s.rule = rule)
    }

    pub(super) fn step(self, voxels: f64) -> Setup {
        self.with(|s| s.step_voxels = voxels)
    }

    pub(super) fn side(mut self, side: BrickSide) -> Setup {
        self.side = side;
        self
    }

    /// Draws from coarser levels, of which the volume's own samples know nothing.
    pub(super) fn detail(mut self, detail: Criterion, downsampling: Downsampling) -> Setup {
        self.oracle = OracleKind::None;
        self.downsampling = downsampling;
        self.with(|s| s.detail = vec![detail])
    }

    /// Draws from coarser levels a field that they reproduce.
    pub(super) fn detail_reproduced(self, detail: Criterion) -> Setup {
        Setup { oracle: OracleKind::EveryLevel, ..self.detail(detail, Downsampling::Subsample) }
    }

    pub(super) fn clip(self, min: [f64; 3], max: [f64; 3]) -> Setup {
        self.with(|s| s.clip = Some(Aabb { min: min.into(), max: max.into() }))
    }

    /// Looks from a world position to another, through a wide lens.
    pub(super) fn eye(self, eye: DVec3, target: DVec3) -> Setup {
        self.lens(eye, target, 1.2)
    }

    /// Looks from a world position to another; `fov_y` in radians.
    pub(super) fn lens(self, eye: DVec3, target: DVec3, fov_y: f64) -> Setup {
        let projection = Projection::Perspective { fov_y };
        let up = if (target - eye).normalize_or_zero().z.abs() > 0.9 { DVec3::Y } else { DVec3::Z };
        let camera = Camera::look_at(eye, target, up, projection).expect("a case's camera is one");
        self.with(|s| s.camera = camera)
    }

    /// An odd number of pixels along both sides: the ray of the middle one runs along the view direction.
    pub(super) fn odd(self) -> Setup {
        self.with(|s| s.size = PICTURE + 1)
    }

    /// Parallel rays in `direction` through the volume's centre; the picture is `height` world units high.
    pub(super) fn parallel(self, direction: DVec3, height: f64) -> Setup {
        let center = self.volume.grid().world_box().center();
        let distance = self.volume.grid().world_box().diagonal();
        let up = if direction.normalize_or_zero().z.abs() > 0.9 { DVec3::Y } else { DVec3::Z };
        let projection = Projection::Orthographic { height };
        let camera = Camera::look_at(center - direction.normalize_or_zero() * distance, center, up, projection);
        self.with(|s| s.camera = camera.expect("a case's camera is one"))
    }

    /// The subject: builds the octree.
    pub(super) fn build(self) -> PictureTest {
        let options = BuildOptions { side: self.side, downsampling: self.downsampling, max_bytes: None };
        let tree = build_tree(&self.volume, &options).expect("a case's octree fits");
        let blocks = self.blocks.map(|(side, levels, style)| {
            let volume = build_blocks(Arc::new(self.volume.clone()), &BlockOptions { side, ..BlockOptions::default() });
            let volume = volume.expect("a case's blocks fit");
            FlatBlocks { levels: levels.of(*volume.layout()).levels().to_vec(), volume, style }
        });
        let trimmed = self.trimming.map(|trimming| {
            let volume = TrimmedVolume::new(Arc::new(self.volume.clone()), self.side);
            TrimmedBricks { volume, trimming }
        });
        let volume = Box::new(self.volume);
        let oracle = match self.oracle {
            OracleKind::Volume => Oracle::Volume(volume),
            OracleKind::EveryLevel => Oracle::EveryLevel(volume),
            OracleKind::None => Oracle::None,
        };
        let Setup { scene, shows, triangles_at_a_time, storage, .. } = self;
        PictureTest { tree, scene, oracle, shows, triangles_at_a_time, storage, blocks, trimmed }
    }
}

/// A picture case.
pub(super) fn picture(
    name: impl Into<String>,
    mutants: Vec<Mutant>,
    setup: impl Fn() -> Setup + Send + Sync + 'static,
) -> Case {
    fallible_picture(name, mutants, move || Ok(setup()))
}

/// A picture case whose data may be missing.
pub(super) fn fallible_picture(
    name: impl Into<String>,
    mutants: Vec<Mutant>,
    setup: impl Fn() -> Result<Setup, NoData> + Send + Sync + 'static,
) -> Case {
    let check = Check::Picture(Box::new(move || Ok(setup()?.build())));
    Case { name: name.into(), check, mutants }
}

/// A list of mutants of both kinds.
macro_rules! catches {
    ($($m:expr),* $(,)?) => { vec![$(crate::conformance::case::Mutant::from($m)),*] };
}
pub(super) use catches;

/// The name of a scalar type as a case's part.
pub(super) fn type_name(scalar: ScalarType) -> &'static str {
    scalar.name()
}
