//! Sizes and speeds of this codec, zstd and pco on bricks of 32^3 of real volumes: `cargo bench -p brickfield-haar`.
//!
//! Needs `BRICKFIELD_DATA`, the folder of the project's volumes. `-- --volume NAME` measures one volume only, `-- --codec TEXT` the
//! codecs with this text in their names.

mod contestants;
mod volumes;

use std::time::{Duration, Instant};

use contestants::{Contestant, contestants};
use rayon::prelude::*;
use volumes::{Bricks, NAMES, bricks_of};

/// Each speed is the fastest of as many turns as fit in this time, three at least.
const TIME: Duration = Duration::from_millis(500);

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let value = |option: &str| args.iter().position(|a| a == option).and_then(|i| args.get(i + 1)).cloned();
    let (volume, codec) = (value("--volume"), value("--codec").unwrap_or_default());
    let Ok(data) = std::env::var("BRICKFIELD_DATA") else {
        println!("BRICKFIELD_DATA is not set: no volume to measure");
        return;
    };
    for name in NAMES.iter().filter(|name| volume.as_deref().is_none_or(|v| v == **name)) {
        match bricks_of(data.as_ref(), name) {
            Ok(Bricks::U8(bricks)) => report(name, &bricks, contestants(), &codec),
            Ok(Bricks::U16(bricks)) => report(name, &bricks, contestants(), &codec),
            Err(error) => println!("{name}: {error}"),
        }
    }
}

fn report<T: brickfield_haar::Sample>(
    name: &str,
    bricks: &[(brickfield_core::glam::UVec3, Vec<T>)],
    contestants: Vec<Contestant<T>>,
    wanted: &str,
) {
    let n_bytes = bricks.iter().map(|(_, samples)| samples.len()).sum::<usize>() * T::TYPE.n_bytes();
    println!("\n{name}: {} bricks, {n_bytes} bytes of {}", bricks.len(), T::TYPE);
    println!("| codec | ratio | encode MB/s | decode MB/s | encode, all cores | decode, all cores |");
    println!("|---|---|---|---|---|---|");
    for contestant in contestants.iter().filter(|c| c.name.contains(wanted)) {
        let encoded: Vec<Vec<u8>> = bricks.iter().map(|(n, samples)| (contestant.encode)(*n, samples)).collect();
        let is_bounded = |(bytes, (_, samples)): (&Vec<u8>, &(_, Vec<T>))| {
            let decoded = (contestant.decode)(bytes);
            samples.iter().zip(&decoded).all(|(a, b)| a.to_i64().abs_diff(b.to_i64()) <= contestant.max_error)
                && decoded.len() == samples.len()
        };
        assert!(encoded.iter().zip(bricks).all(is_bounded), "{} does not return its bricks", contestant.name);
        let n_encoded: usize = encoded.iter().map(Vec::len).sum();
        let speeds = [
            speed(n_bytes, || bricks.iter().map(|(n, samples)| (contestant.encode)(*n, samples).len()).sum()),
            speed(n_bytes, || encoded.iter().map(|bytes| (contestant.decode)(bytes).len()).sum()),
            speed(n_bytes, || bricks.par_iter().map(|(n, samples)| (contestant.encode)(*n, samples).len()).sum()),
            speed(n_bytes, || encoded.par_iter().map(|bytes| (contestant.decode)(bytes).len()).sum()),
        ];
        let [encode, decode, encode_all, decode_all] = speeds.map(|s| format!("{s:.0}"));
        let ratio = n_bytes as f64 / n_encoded as f64;
        println!("| {} | {ratio:.3} | {encode} | {decode} | {encode_all} | {decode_all} |", contestant.name);
    }
}

/// Millions of bytes a second, of the fastest turn.
fn speed(n_bytes: usize, turn: impl Fn() -> usize) -> f64 {
    let begin = Instant::now();
    let mut fastest = Duration::MAX;
    let mut n_turns = 0;
    while n_turns < 3 || begin.elapsed() < TIME {
        let turn_begin = Instant::now();
        std::hint::black_box(turn());
        fastest = fastest.min(turn_begin.elapsed());
        n_turns += 1;
    }
    n_bytes as f64 / 1e6 / fastest.as_secs_f64()
}
