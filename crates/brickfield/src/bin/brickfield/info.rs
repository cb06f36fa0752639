//! `brickfield info`.

use std::fmt::{self, Write};

use brickfield::bricks::{BrickTree, LevelMemory};
use brickfield::core::glam::DVec3;
use brickfield::core::{Level, Rescale, Volume};
use brickfield::io::{Choice, Opened};
use serde_json::{Value, json};

use crate::{Failure, InfoArgs, mib, print};

pub(crate) fn run(args: &InfoArgs) -> Result<(), Failure> {
    let opened = args.input.open(&args.file)?;
    let (mut text, mut json) = (String::new(), json(&opened));
    of_volume(&mut text, &opened)?;
    let notes = opened.notes.clone();
    let even = opened.evenly_spaced(&args.input.limits());
    let made = even.notes.iter().filter(|note| !notes.contains(note)).map(ToString::to_string).collect::<Vec<_>>();
    let tree = args.tree.build(&even.volume)?;
    if args.json {
        (json["rendering"], json["bricks"]) = (json!(made), json_of_tree(&tree));
        return print(&format!("{json:#}\n"));
    }
    made.iter().try_for_each(|note| writeln!(text, "rendering   {note}"))?;
    of_tree(&mut text, &tree)?;
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
    if volume.rescale() != Rescale::IDENTITY {
        let (slope, intercept) = (volume.rescale().slope(), volume.rescale().intercept());
        writeln!(text, "rescale     values are {slope} times the stored ones, plus {intercept}")?;
    }
    writeln!(text, "values      {} to {}", range.min, range.max)?;
    let unit = opened.unit.as_deref().unwrap_or("units");
    writeln!(text, "spacing     {} x {} x {} {unit}", spacing.x, spacing.y, spacing.z)?;
    writeln!(text, "world       {} to {} ({:?})", nine_digits(world.min), nine_digits(world.max), opened.frame)?;
    opened.choices.iter().try_for_each(|choice| of_choice(text, choice))?;
    opened.notes.iter().try_for_each(|note| writeln!(text, "note        {note}"))
}

/// The statements of a file, for scripts.
fn json(opened: &Opened) -> Value {
    let volume = &opened.volume;
    let (grid, range, rescale) = (volume.grid(), volume.range(), volume.rescale());
    let (map, world) = (grid.index_to_world(), grid.world_box());
    let directions = [0, 1, 2].map(|axis| (map.matrix3.col(axis) / grid.spacing()[axis]).to_array());
    let choice = |choice: &Choice| {
        json!({
            "kind": choice.kind.name(),
            "entries": choice.n_entries,
            "names": choice.names,
            "read": choice.read,
        })
    };
    json!({
        "format": opened.format.name(),
        "dimensions": grid.dims().to_array(),
        "type": volume.scalar_type().name(),
        "bytes": grid.n_voxels() * volume.scalar_type().n_bytes(),
        "rescale": { "slope": rescale.slope(), "intercept": rescale.intercept() },
        "values": { "min": range.min, "max": range.max },
        "spacing": grid.spacing().to_array(),
        "unit": opened.unit,
        "first_sample": map.transform_point3(DVec3::splat(0.5)).to_array(),
        "directions": directions,
        "world": { "min": world.min.to_array(), "max": world.max.to_array() },
        "frame": format!("{:?}", opened.frame),
        "choices": opened.choices.iter().map(choice).collect::<Vec<_>>(),
        "notes": opened.notes.iter().map(|note| note.to_string()).collect::<Vec<_>>(),
    })
}

fn json_of_tree(tree: &BrickTree) -> Value {
    let memory = tree.memory();
    let level = |(level, memory): (Level, &LevelMemory)| {
        json!({
            "level": level.0,
            "dimensions": tree.layout().level_dims(level).to_array(),
            "bricks": memory.n_bricks,
            "stored_bytes": memory.stored_bytes,
            "shared_bytes": memory.shared_bytes,
        })
    };
    json!({
        "side": tree.layout().side().n_samples(),
        "downsampling": format!("{:?}", tree.downsampling()),
        "levels": (0..).map(Level).zip(&memory.levels).map(level).collect::<Vec<_>>(),
    })
}

/// The entries of a choice, the one that was read marked.
fn of_choice(text: &mut String, choice: &Choice) -> fmt::Result {
    let n_shown = choice.n_entries.min(MAX_SHOWN_ENTRIES);
    for entry in 0..n_shown {
        let (option, mark) = (format!("--{}", choice.kind), if entry == choice.read { " (read)" } else { "" });
        writeln!(text, "{option:11} {}{mark}", choice.label(entry))?;
    }
    match choice.n_entries - n_shown {
        0 => Ok(()),
        _ => writeln!(text, "            ... to {}", choice.label(choice.n_entries - 1)),
    }
}

/// Longer lists are cut.
const MAX_SHOWN_ENTRIES: u64 = 32;

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
