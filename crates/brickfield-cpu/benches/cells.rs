//! Pictures of curvilinear data: `cargo bench -p brickfield-cpu --profile dev --bench cells`. `BRICKFIELD_DATA` names the folder of
//! `curvilinear/bluntfinxyz.bin` and others (PLOT3D, NASA; as VTK's test data has them).

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, Camera, Knot, TransferFunction};
use brickfield_cpu::{CpuBackend, discrete_cells};
use brickfield_frame::{Cells, CellsBackend, CellsPlan, CellsView, Mode, QuadratureRule, Sampling};

fn main() {
    let Some(folder) = std::env::var_os("BRICKFIELD_DATA").map(PathBuf::from) else {
        println!("no data: BRICKFIELD_DATA names no folder");
        return;
    };
    for name in ["bluntfin", "comb"] {
        match read(&folder.join("curvilinear"), name) {
            Some(cells) => report(name, &Arc::new(cells)),
            None => println!("{name}: no data"),
        }
    }
}

/// Density of a PLOT3D grid and its solution: one grid, big-endian f32, without record marks.
fn read(folder: &Path, name: &str) -> Option<Cells> {
    let file = |kind: &str| std::fs::read(folder.join(format!("{name}{kind}.bin"))).ok();
    let (grid, solution) = (file("xyz")?, file("q")?);
    let word = |bytes: &[u8], i: usize| bytes[4 * i..4 * i + 4].try_into().map(u32::from_be_bytes).unwrap_or(0);
    let n = UVec3::new(word(&grid, 0), word(&grid, 1), word(&grid, 2));
    let n_nodes = n.element_product() as usize;
    let number = |bytes: &[u8], i: usize| f32::from_bits(word(bytes, i));
    let x = |axis: usize, i: usize| f64::from(number(&grid, 3 + axis * n_nodes + i));
    let positions: Vec<DVec3> = (0..n_nodes).map(|i| DVec3::new(x(0, i), x(1, i), x(2, i))).collect();
    // Three sizes and four numbers of the flow come before the density.
    let values: Vec<f32> = (0..n_nodes).map(|i| number(&solution, 7 + i)).collect();
    Cells::new(n - 1, &positions, &values, None).ok()
}

fn report(name: &str, cells: &Arc<Cells>) {
    let (min, max) = cells.nodes().iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), node| {
        (min.min(node.value.into()), max.max(node.value.into()))
    });
    println!("{name}: {} cells, values from {min} to {max}, radius {}", cells.n_cells(), cells.radius());
    let plan = |size: u32, n_steps: f64, mode: Mode| {
        let extinction = 2.0 / cells.radius();
        let knot =
            |x: f64, part: f64, color| Knot { value: min + x * (max - min), extinction: part * extinction, color };
        let knots =
            vec![knot(0.0, 0.05, [0.1, 0.2, 1.0]), knot(0.3, 0.5, [0.2, 1.0, 0.2]), knot(1.0, 1.0, [1.0, 0.1, 0.1])];
        let extent = Aabb::of_points(cells.nodes().iter().map(|n| DVec3::from_array(n.position.map(f64::from))));
        let around = Aabb { min: extent.min + cells.center(), max: extent.max + cells.center() };
        let view = CellsView {
            camera: Camera::framing(&around, DVec3::new(0.6, 0.5, 1.0), DVec3::Y).expect("a camera"),
            size: UVec2::splat(size),
            sampling: Sampling::new(2.0 * cells.radius() / n_steps, QuadratureRule::MidpointExponential, mode)
                .expect("a sampling"),
            transfer: TransferFunction::new(knots).expect("a transfer function"),
            behind: None,
        };
        CellsPlan::new(cells.clone(), view).expect("a plan")
    };
    for (n_steps, mode) in
        [(1.0, Mode::Exact), (50.0, Mode::Exact), (100.0, Mode::Exact), (200.0, Mode::Exact), (100.0, Mode::FAST)]
    {
        time(&plan(512, n_steps, mode), n_steps);
    }
    difference(&plan(128, 100.0, Mode::Exact));
}

fn time(plan: &CellsPlan, n_steps: f64) {
    let mut backend = CpuBackend::new();
    let mut times: Vec<(f64, f64)> = (0..5)
        .map(|_| {
            let (cpu, wall) = (cpu_seconds(), Instant::now());
            let frame = backend.render_cells(plan).expect("a picture");
            std::hint::black_box(frame);
            (cpu_seconds() - cpu, wall.elapsed().as_secs_f64())
        })
        .collect();
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mode = plan.sampling().mode().name();
    println!(
        "  512 x 512, {n_steps} steps along the diagonal, {mode}: {:.3} CPU s ({:.3} to {:.3}), {:.3} s",
        times[2].0, times[0].0, times[4].0, times[2].1
    );
}

/// CPU seconds of this process, by all threads.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").ok();
    let own = text.and_then(|text| text.split(' ').next()?.parse::<f64>().ok()).unwrap_or(0.0);
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let of_task = |path: PathBuf| {
        let text = std::fs::read_to_string(path.join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    let all: f64 = tasks.filter_map(|task| of_task(task.path())).sum();
    all.max(own) * 1e-9
}

fn difference(plan: &CellsPlan) {
    let begin = Instant::now();
    let expected = discrete_cells(plan);
    let seconds = begin.elapsed().as_secs_f64();
    let got = CpuBackend::new().render_cells(plan).expect("a picture").image;
    let pairs = got.pixels().iter().zip(expected.image.pixels()).zip(&expected.ambiguity);
    let off = |((a, b), ambiguity): ((&[f32; 4], &[f64; 4]), &f64)| {
        let off = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
        (a[3] > 0.0 || b[3] > 0.0).then_some((off, off - ambiguity))
    };
    let (mut off, beyond): (Vec<f64>, Vec<f64>) = pairs.filter_map(off).unzip();
    let beyond = beyond.into_iter().fold(0.0, f64::max);
    off.sort_by(f64::total_cmp);
    let at = |part: f64| off[((off.len() - 1) as f64 * part) as usize];
    println!(
        "  {} pixels, {} nodes in {} cells; from the f64 answer ({seconds:.1} s): median {:.1e}, 99.9 % {:.1e}, most {:.1e}, beyond ambiguity {beyond:.1e}",
        off.len(),
        expected.n_samples,
        expected.n_cells,
        at(0.5),
        at(0.999),
        at(1.0)
    );
}
