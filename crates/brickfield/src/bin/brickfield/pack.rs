//! `brickfield pack`.

use brickfield::io::SaveError;
use brickfield::options::progress_bar;
use brickfield::{PackError, pack};

use crate::{Failure, PackArgs, print};

pub(crate) fn run(args: &PackArgs) -> Result<(), Failure> {
    let bar = progress_bar("packing");
    let mut told = |p: brickfield::PackProgress| {
        bar.set_length(p.n_total);
        bar.set_position(p.n_done);
    };
    let packed = pack(&args.file, &mut || args.input.open_slices(&args.file), &args.out, args.codec, &mut told);
    bar.finish_and_clear();
    let packed = packed.map_err(|e| match e {
        PackError::Save(e @ (SaveError::IsThere { .. } | SaveError::NoFolder { .. })) => Failure::usage(e),
        e @ (PackError::NotZarr { .. } | PackError::IntoInput { .. } | PackError::Floats { .. }) => Failure::usage(e),
        other => other.into(),
    })?;
    packed.facts.notes.iter().for_each(|note| eprintln!("note: {note}"));
    packed.notes.iter().for_each(|note| eprintln!("note: {note}"));
    let (dims, scalar, coarsest) = (packed.facts.grid.dims(), packed.scalar, packed.coarsest.0);
    print(&format!(
        "{}: {} x {} x {} voxels of {scalar}, levels 0 to {coarsest}\n",
        args.out.display(),
        dims.x,
        dims.y,
        dims.z
    ))
}
