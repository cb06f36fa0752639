//! `brickfield info`.

use std::fmt::{self, Write};

use brickfield::bricks::{BrickTree, LevelMemory};
use brickfield::core::glam::DVec3;
use brickfield::core::{Level, Volume};
use brickfield::io::Opened;

use crate::{Failure, InfoArgs, print};

pub(crate) fn run(args: &InfoArgs) -> Result<(), Failure> {
    let opened = args.input.open(&args.file)?;
    let mut text = String::new();
    of_volume(&mut text, &opened)?;
    let notes = opened.notes.clone();
    let even = opened.evenly_spaced(&args.input.limits());
    let mut made = even.notes.iter().filter(|note| !notes.contains(note));
    made.try_for_each(|note| writeln!(text, "rendering   {note}"))?;
    of_tree(&mut text, &args.tree.build(&even.volume)?)?;
    print(&text)
}

fn of_volume(text: &mut String, opened: &Opened) -> fmt::Result {
    let volume: &Volume = &opened.volume;
    let (grid, range) = (volume.grid(), volume.range());
    let (dims, spacing) = (grid.dims(), nine_digits(grid.spacing()));
    let world = grid.world_box();
    writeln!(text, "format      {}", opened.format)?;
    writeln!(text, "dimensions  {} x {} x {}", dims.x, dims.y, dims.z)?;
    writeln!(text, "type        {}", volume.scalar_type())?;
    writeln!(text, "values      {} to {}", range.min, range.max)?;
    let unit = opened.unit.as_deref().unwrap_or("units");
    writeln!(text, "spacing     {} x {} x {} {unit}", spacing.x, spacing.y, spacing.z)?;
    writeln!(text, "world       {} to {} ({:?})", nine_digits(world.min), nine_digits(world.max), opened.frame)?;
    opened.notes.iter().try_for_each(|note| writeln!(text, "note        {note}"))
}

/// Lengths without the last digits, which rounding leaves behind.
fn nine_digits(v: DVec3) -> DVec3 {
    DVec3::from(v.to_array().map(|x| format!("{x:.8e}").parse().unwrap_or(x)))
}

fn of_tree(text: &mut String, tree: &BrickTree) -> fmt::Result {
    writeln!(text, "bricks of {}^3 samples ({:?})", tree.layout().side(), tree.downsampling())?;
    writeln!(text, "level  dimensions         bricks      stored MiB  shared MiB")?;
    let memory = tree.memory();
    (0..).map(Level).zip(&memory.levels).try_for_each(|(level, memory)| of_level(text, tree, level, memory))
}

fn of_level(text: &mut String, tree: &BrickTree, level: Level, memory: &LevelMemory) -> fmt::Result {
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let d = tree.layout().level_dims(level);
    let dims = format!("{} x {} x {}", d.x, d.y, d.z);
    writeln!(
        text,
        "{:5}  {dims:17}  {:10}  {:10.2}  {:10.2}",
        level.0,
        memory.n_bricks,
        mib(memory.stored_bytes),
        mib(memory.shared_bytes)
    )
}
