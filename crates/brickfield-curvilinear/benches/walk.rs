//! Times of rays through cells, and of octrees over them: `cargo bench -p brickfield-curvilinear --profile dev --bench walk`.

use std::f64::consts::TAU;
use std::time::Instant;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, Camera};
use brickfield_curvilinear::{CellWalker, CurvilinearVolume, OctTree};

fn main() {
    let n = UVec3::new(64, 192, 64);
    let start = Instant::now();
    let walker = CellWalker::new(ring(n)).expect("cells with a volume");
    println!("a ring of {} x {} x {} cells, made in {:.1} ms", n.x, n.y, n.z, start.elapsed().as_secs_f64() * 1e3);
    let extent = Aabb::of_points(walker.volume().positions().iter().copied());
    let camera = Camera::framing(&extent, DVec3::new(1.0, -2.0, 1.5), DVec3::Z).expect("a camera");
    let size = UVec2::splat(128);
    let rays = camera.pixel_rays(size);
    let mut times = Vec::new();
    let mut n_segments = 0;
    for _ in 0..7 {
        let start = Instant::now();
        let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y)));
        n_segments = pixels.map(|(x, y)| walker.walk(&rays.pixel_ray(x, y)).expect("a ray").count()).sum();
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let [least, median, most] = [0, 3, 6].map(|i| times[i] / n_segments as f64 * 1e9);
    println!(
        "{} rays, {n_segments} cells: {median:.0} ns a cell ({least:.0} to {most:.0}), one thread",
        size.x * size.y
    );
    octree(walker.volume().clone());
}

/// The hierarchy over the same cells, by all threads.
fn octree(volume: CurvilinearVolume) {
    let values: Vec<f32> = volume.positions().iter().map(|p| (3.0 * p.x).sin() as f32 + (p.y * p.z) as f32).collect();
    let start = Instant::now();
    let tree = OctTree::build(volume, values).expect("a value for each node");
    let (seconds, account) = (start.elapsed().as_secs_f64(), tree.byte_account());
    println!(
        "an octree of {} zones above level 0, {} bytes each, {:.3} of the data, made in {seconds:.2} s",
        account.n_stored_zones,
        account.bytes_per_zone,
        account.ratio()
    );
}

/// Closed around z, and bent along it.
fn ring(n: UVec3) -> CurvilinearVolume {
    let nodes = n + 1;
    let position = |i: u32| {
        let node = UVec3::new(i % nodes.x, i / nodes.x % nodes.y, i / nodes.x / nodes.y);
        let (radius, height) = (1.0 + f64::from(node.x) / f64::from(n.x), f64::from(node.z) / f64::from(n.z));
        let angle = TAU * f64::from(node.y % n.y) / f64::from(n.y) + 0.3 * height;
        DVec3::new(radius * angle.cos(), radius * angle.sin(), height + 0.1 * (3.0 * angle).sin())
    };
    CurvilinearVolume::new(n, (0..nodes.element_product()).map(position).collect()).expect("a node for each position")
}
