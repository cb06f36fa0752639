//! `brickfield convert`.

use brickfield::io::{Compression, SaveOptions, check_save_path, save};

use crate::{ConvertArgs, Failure, print};

pub(crate) fn run(args: &ConvertArgs) -> Result<(), Failure> {
    // As `render`: a path that can be refused is refused before any work is done.
    check_save_path(&args.out).map_err(Failure::usage)?;
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
