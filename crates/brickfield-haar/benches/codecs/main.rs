//! Sizes and speeds of this codec, zstd and pco on bricks of 32^3 of real volumes: `cargo bench -p brickfield-haar`.
//!
//! Needs `BRICKFIELD_DATA`, the folder of the project's volumes. `-- --volume NAME` measures one volume only, `-- --raw FILE --dims NXxNYxNZ
//! --type TYPE` a file of samples (u8, i8, u16, i16, little-endian, x fastest; signed ones are counted from the least), `-- --codec TEXT` the
//! codecs with this text in their names. Each speed is measured in as many turns as fit in half a second, or in `-- --seconds S`, three at
//! least.

mod contestants;
mod volumes;

use std::time::{Duration, Instant};

use contestants::{Contestant, contestants};
use rayon::prelude::*;
use volumes::{Bricks, NAMES, bricks_of, bricks_of_raw};

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let value = |option: &str| args.iter().position(|a| a == option).and_then(|i| args.get(i + 1)).cloned();
    let (volume, codec) = (value("--volume"), value("--codec").unwrap_or_default());
    let seconds = value("--seconds").map_or(Ok(0.5), |s| s.parse()).expect("--seconds takes a number");
    let time = Duration::from_secs_f64(seconds);
    if let Some(file) = value("--raw") {
        let (dims, kind) = (value("--dims").unwrap_or_default(), value("--type").unwrap_or_default());
        report_all(&file, bricks_of_raw(file.as_ref(), &dims, &kind), &codec, time);
        return;
    }
    let Ok(data) = std::env::var("BRICKFIELD_DATA") else {
        println!("BRICKFIELD_DATA is not set: no volume to measure");
        return;
    };
    for name in NAMES.iter().filter(|name| volume.as_deref().is_none_or(|v| v == **name)) {
        report_all(name, bricks_of(data.as_ref(), name), &codec, time);
    }
}

fn report_all(name: &str, bricks: Result<Bricks, String>, codec: &str, time: Duration) {
    match bricks {
        Ok(Bricks::U8(bricks)) => report(name, &bricks, contestants(), codec, time),
        Ok(Bricks::U16(bricks)) => report(name, &bricks, contestants(), codec, time),
        Err(error) => println!("{name}: {error}"),
    }
}

fn report<T: brickfield_haar::Sample>(
    name: &str,
    bricks: &[(brickfield_core::glam::UVec3, Vec<T>)],
    contestants: Vec<Contestant<T>>,
    wanted: &str,
    time: Duration,
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
            alone(time, n_bytes, bricks, |(n, samples)| (contestant.encode)(*n, samples).len()),
            alone(time, n_bytes, &encoded, |bytes| (contestant.decode)(bytes).len()),
            together(time, n_bytes, bricks, |(n, samples)| (contestant.encode)(*n, samples).len()),
            together(time, n_bytes, &encoded, |bytes| (contestant.decode)(bytes).len()),
        ];
        let [encode, decode, encode_all, decode_all] = speeds.map(|s| format!("{s:.0}"));
        let ratio = n_bytes as f64 / n_encoded as f64;
        println!("| {} | {ratio:.3} | {encode} | {decode} | {encode_all} | {decode_all} |", contestant.name);
    }
}

/// Millions of bytes a second on one core: each brick's fastest turn counts, so that other programs on the machine count little.
fn alone<I>(time: Duration, n_bytes: usize, items: &[I], run: impl Fn(&I) -> usize) -> f64 {
    let mut fastest = vec![Duration::MAX; items.len()];
    turns(time, || {
        for (item, fastest) in items.iter().zip(&mut fastest) {
            let begin = Instant::now();
            std::hint::black_box(run(item));
            *fastest = begin.elapsed().min(*fastest);
        }
    });
    n_bytes as f64 / 1e6 / fastest.iter().sum::<Duration>().as_secs_f64()
}

/// Millions of bytes a second on all cores, of the fastest turn.
fn together<I: Sync>(time: Duration, n_bytes: usize, items: &[I], run: impl Fn(&I) -> usize + Sync) -> f64 {
    let mut fastest = Duration::MAX;
    turns(time, || {
        let begin = Instant::now();
        std::hint::black_box(items.par_iter().map(&run).sum::<usize>());
        fastest = begin.elapsed().min(fastest);
    });
    n_bytes as f64 / 1e6 / fastest.as_secs_f64()
}

/// As many turns as fit in a time, three at least.
fn turns(time: Duration, mut turn: impl FnMut()) {
    let begin = Instant::now();
    let mut n_turns = 0;
    while n_turns < 3 || begin.elapsed() < time {
        turn();
        n_turns += 1;
    }
}
