//! The scenes: two real volumes, with and without skipping, and in bricks of every side.

use brickfield::bricks::{BrickTree, BuildOptions, Downsampling, build_tree};
use brickfield::frame::Mode;
use brickfield::io::{OpenOptions, WorldFrame, open};
use brickfield::optics::automatic;
use brickfield::{BackendKind, Residency, Scene, Skipping, Viewpoint, prepare};
use brickfield_conformance::turns::{Contestant, Offer};
use brickfield_core::glam::UVec2;
use brickfield_core::{BrickSide, TransferFunction, Volume};

use crate::{Arguments, Backends};

/// The contestant whose transfer function shows nothing.
pub(crate) const NOTHING_TO_SEE: &str = "nothing to see";

/// Name, path below the data folder, and how many times as fast skipping must be in fast mode.
const VOLUMES: [(&str, &str, f64); 2] = [("engine", "ct/engine.vti", 2.0), ("aneurism", "ct/aneurism.vti", 4.0)];

/// A volume and its octrees.
pub(crate) struct TimedVolume {
    pub(crate) name: &'static str,
    /// How many times as fast skipping must be in fast mode.
    pub(crate) skipping_gains: f64,
    volume: Volume,
    trees: Vec<(BrickSide, BrickTree)>,
}

/// Contestants that are timed together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    /// With and without skipping in both modes, and a scene that shows nothing, in bricks of 32.
    Skipping,
    /// Brick sides in both modes.
    Sides,
}

/// A contestant on a backend.
pub(crate) struct Entrant<'a> {
    pub(crate) what: String,
    /// Its place among the open backends.
    pub(crate) backend: usize,
    pub(crate) contestant: Contestant<'a>,
}

/// Reads the volumes one by one.
pub(crate) fn read(options: &Arguments) -> impl Iterator<Item = anyhow::Result<TimedVolume>> {
    VOLUMES.into_iter().map(|(name, path, skipping_gains)| {
        let volume = open(&options.data.join(path), &OpenOptions::default())?.volume;
        let trees = BrickSide::ALL.into_iter().map(|side| Ok((side, tree(&volume, side)?)));
        let trees = trees.collect::<anyhow::Result<_>>()?;
        Ok(TimedVolume { name, skipping_gains, volume, trees })
    })
}

pub(crate) fn tree(volume: &Volume, side: BrickSide) -> anyhow::Result<BrickTree> {
    Ok(build_tree(volume, &BuildOptions { side, downsampling: Downsampling::Average, max_bytes: None })?)
}

impl TimedVolume {
    /// The contestants of a group on each of the backends, as far as they are asked for.
    pub(crate) fn entrants(
        &self,
        options: &Arguments,
        group: Group,
        backends: &[BackendKind],
    ) -> anyhow::Result<Vec<Entrant<'_>>> {
        let scenes = match group {
            Group::Skipping => self.skipping(options)?,
            Group::Sides => self.sides(options)?,
        };
        let wanted = |what: &String| options.only.as_ref().is_none_or(|only| what.contains(only));
        let entrants = scenes.into_iter().filter(|(what, ..)| wanted(what)).flat_map(|(what, tree, scene)| {
            let on = move |backend| Entrant {
                what: what.clone(),
                backend,
                contestant: Contestant::new(tree, scene.clone()),
            };
            (0..backends.len()).map(on)
        });
        Ok(entrants.collect())
    }

    /// The scene in a mode.
    pub(crate) fn scene(&self, options: &Arguments, mode: Mode, skipping: Skipping) -> anyhow::Result<Scene> {
        let size = UVec2::splat(options.size);
        let camera = Viewpoint::default().camera(self.volume.grid(), WorldFrame::Plain, size)?;
        Ok(Scene { mode, skipping, step_voxels: 0.5, ..Scene::new(camera, size, automatic(&self.volume)) })
    }

    /// The octree of bricks of 32.
    pub(crate) fn middle(&self) -> &BrickTree {
        let middle = self.trees.iter().find(|(side, _)| *side == BrickSide::S32);
        &middle.expect("octrees of all sides").1
    }

    fn skipping(&self, options: &Arguments) -> anyhow::Result<Vec<(String, &BrickTree, Scene)>> {
        let with = |mode, skipping| self.scene(options, mode, skipping);
        let invisible = TransferFunction::constant(0.0, [1.0; 3])?;
        let scenes = [
            ("fast, skipping", with(Mode::FAST, Skipping::On)?),
            ("fast, no skipping", with(Mode::FAST, Skipping::Off)?),
            ("exact, skipping", with(Mode::Exact, Skipping::On)?),
            ("exact, no skipping", with(Mode::Exact, Skipping::Off)?),
            (NOTHING_TO_SEE, Scene { transfer: invisible, ..with(Mode::FAST, Skipping::On)? }),
        ];
        let named = |(what, scene)| (format!("{}, {what}", self.name), self.middle(), scene);
        Ok(scenes.map(named).into())
    }

    fn sides(&self, options: &Arguments) -> anyhow::Result<Vec<(String, &BrickTree, Scene)>> {
        let mut scenes = Vec::new();
        for (side, tree) in &self.trees {
            for (mode, mode_name) in [(Mode::FAST, "fast"), (Mode::Exact, "exact")] {
                let scene = self.scene(options, mode, Skipping::On)?;
                if mode == Mode::Exact && !options.serve {
                    self.say_resident(*side, tree, &scene)?;
                }
                scenes.push((format!("{}, {mode_name}, bricks of {side}", self.name), tree, scene));
            }
        }
        Ok(scenes)
    }

    fn say_resident(&self, side: BrickSide, tree: &BrickTree, scene: &Scene) -> anyhow::Result<()> {
        let plan = prepare(tree, scene, &mut Residency::default())?;
        let slots = plan.field().slots();
        let megabytes = slots.n_bytes() as f64 / 1e6;
        println!("{}, bricks of {side}: {} resident, {megabytes:.1} MB", self.name, slots.n_filled());
        Ok(())
    }
}

impl Entrant<'_> {
    pub(crate) fn offer(&self, backends: &Backends) -> Offer {
        Offer { what: self.what.clone(), backend: backends[self.backend].0.name().to_owned() }
    }
}
