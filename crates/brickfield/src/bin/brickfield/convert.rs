//! `brickfield convert`.

use brickfield::io::{Compression, SaveOptions, save};

use crate::{ConvertArgs, Failure, print};

pub(crate) fn run(args: &ConvertArgs) -> Result<(), Failure> {
    let opened = args.input.open(&args.file)?;
    opened.notes.iter().for_each(|note| eprintln!("note: {note}"));
    let mut options = SaveOptions::default();
    options.frame = opened.frame;
    options.unit = opened.unit;
    options.compression = if args.unpacked { Compression::None } else { Compression::Lossless };
    let saved = save(&args.out, &opened.volume, &options)?;
    saved.notes.iter().for_each(|note| eprintln!("note: {note}"));
    let (dims, scalar) = (opened.volume.grid().dims(), saved.scalar);
    print(&format!("{}: {} x {} x {} voxels of {scalar}\n", args.out.display(), dims.x, dims.y, dims.z))
}
