//! The f32 renderer against the f64 answer, over random grids, holes, cameras and rules.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Camera, Projection, TransferFunction};
use brickfield_cpu::discrete_cells;
use brickfield_frame::QuadratureRule;
use proptest::prelude::*;

use crate::grids::*;

fn layers(jump: f64) -> TransferFunction {
    let knots = vec![
        knot(-1.5, 0.5, [1.0, 0.1, 0.3]),
        knot(-0.6, 0.0, [1.0, 1.0, 0.4]),
        knot(0.5, 0.0, [0.0, 1.0, 0.4]),
        knot(0.6, 6.0, [0.0, 0.0, 1.0]),
        knot(1.0, 6.0 + jump, [0.9, 0.9, 1.0]),
    ];
    TransferFunction::new(knots).unwrap()
}

fn waves(p: DVec3) -> f64 {
    (2.5 * p.x).sin() + (2.0 * p.y).cos() * (2.0 * p.z + 0.5).sin()
}

fn grid(kind: u32, seed: u64) -> Nodes {
    let nodes = match kind {
        0 => bent(UVec3::new(6, 5, 7), seed, waves),
        1 => ring(UVec3::new(4, 12, 5), 0.5, waves).mirrored(),
        2 => ring(UVec3::new(5, 9, 4), 0.0, waves),
        _ => sheared(UVec3::new(5, 4, 6), shear() * 0.25, waves),
    };
    if seed.is_multiple_of(3) {
        nodes.with_holes(|i| (seed >> ((i.x + 5 * i.y + 11 * i.z) % 59)) & 15 == 15)
    } else {
        nodes
    }
}

fn points(low: f64, high: f64) -> impl Strategy<Value = DVec3> {
    (low..high, low..high, low..high).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Exact mode: within 1e-4 beyond a pixel's ambiguity, and 99 % of these 400 pixels within 1e-5.
    #[test]
    fn pictures_agree(kind in 0u32..4, seed in any::<u64>(), eye in points(-3.0, 3.0), rule in 0usize..5, wide in 0u32..2) {
        let nodes = grid(kind, seed);
        let projection = match wide {
            0 => Projection::Perspective { fov_y: 0.8 },
            _ => Projection::Orthographic { height: nodes.extent().diagonal() },
        };
        let center = nodes.extent().center();
        let camera = Camera::look_at(center + eye, center + DVec3::new(0.1, 0.05, 0.0), DVec3::new(0.3, 0.1, 1.0), projection);
        let view = ruled(view(camera.unwrap(), 20, layers(seed as f64 / u64::MAX as f64), 0.09), QuadratureRule::ALL[rule]);
        let plan = plan(&nodes, &view);
        let (expected, got) = (discrete_cells(&plan), fast(&plan));
        let mut n_off = 0;
        for (i, (a, b)) in got.pixels().iter().zip(expected.image.pixels()).enumerate() {
            let off = distance(*a, *b);
            n_off += usize::from(off > 1e-5);
            prop_assert!(off <= 1e-4 + expected.ambiguity[i], "pixel {}: {:?} is not {:?}", i, a, b);
        }
        prop_assert!(n_off <= 4, "{} pixels", n_off);
    }
}
