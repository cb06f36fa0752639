//! `brickfield info`.

use brickfield::bricks::{BrickTree, LevelMemory};
use brickfield::core::{Level, Volume};
use brickfield::io::Opened;

use crate::{Failure, InfoArgs};

pub(crate) fn run(args: &InfoArgs) -> Result<(), Failure> {
    let opened = args.input.open(&args.file)?;
    print_volume(&opened);
    print_tree(&args.tree.build(&opened.volume)?);
    Ok(())
}

fn print_volume(opened: &Opened) {
    let volume: &Volume = &opened.volume;
    let (grid, range) = (volume.grid(), volume.range());
    let (dims, spacing) = (grid.dims(), grid.spacing());
    let world = grid.world_box();
    println!("format      {}", opened.format);
    println!("dimensions  {} x {} x {}", dims.x, dims.y, dims.z);
    println!("type        {}", volume.scalar_type());
    println!("values      {} to {}", range.min, range.max);
    let unit = opened.unit.as_deref().unwrap_or("units");
    println!("spacing     {} x {} x {} {unit}", spacing.x, spacing.y, spacing.z);
    println!("world       {} to {} ({:?})", world.min, world.max, opened.frame);
    for note in &opened.notes {
        println!("note        {note}");
    }
}

fn print_tree(tree: &BrickTree) {
    println!("bricks of {}^3 samples ({:?})", tree.layout().side(), tree.downsampling());
    println!("level  dimensions         bricks      stored MiB  shared MiB");
    let memory = tree.memory();
    for (level, memory) in (0..).map(Level).zip(&memory.levels) {
        print_level(tree, level, memory);
    }
}

fn print_level(tree: &BrickTree, level: Level, memory: &LevelMemory) {
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let d = tree.layout().level_dims(level);
    let dims = format!("{} x {} x {}", d.x, d.y, d.z);
    println!(
        "{:5}  {dims:17}  {:10}  {:10.2}  {:10.2}",
        level.0,
        memory.n_bricks,
        mib(memory.stored_bytes),
        mib(memory.shared_bytes)
    );
}
