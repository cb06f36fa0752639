//! Every segment of every ray is one fragment of one polygon of its own, and they are drawn from back to front; also of rays
//! that f32 puts beside their place.

mod support;

use brickfield_core::glam::{DVec2, DVec3, UVec2, UVec3};
use brickfield_core::{BrickLayout, BrickSide, Camera, IndexPos, Level, Projection, ScalarType, TransferFunction};
use brickfield_frame::{
    Division, Drawing, FramePlan, IndexEntry, Lengths, Placement, PlanParts, PlanRay, ProxyCorner, ProxyGeometry,
    Slices, Target,
};
use proptest::prelude::*;
use support::Setup;

/// What a fragment stands for: a brick's segment that ends at a surface, or with the brick.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fragment {
    brick: u32,
    surface: f32,
    owner: u32,
}

/// The fragments that cover a point of the picture, in drawing order.
fn fragments(proxy: &ProxyGeometry, at: DVec2) -> Vec<Fragment> {
    let corner = |i: u32| proxy.corners()[i as usize];
    let place = |c: ProxyCorner| DVec2::new(c.pixel[0].into(), c.pixel[1].into());
    let covering = proxy.indices().chunks_exact(3).filter(|t| {
        let [a, b, c] = [0, 1, 2].map(|i| place(corner(t[i])));
        let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| (q - p).perp_dot(at - p));
        sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
    });
    let fragment = |t: &[u32]| {
        let ProxyCorner { brick, surface, owner, .. } = corner(t[0]);
        Fragment { brick, surface, owner }
    };
    let mut found: Vec<Fragment> = covering.map(fragment).collect();
    // A point on an edge between two triangles of a fan is one fragment of a rasteriser.
    found.dedup();
    found
}

/// The ray of a pixel, beside its place by shares of what f32 may do.
fn ray_beside(plan: &FramePlan, (x, y): (u32, u32), beside: [f64; 3]) -> PlanRay {
    let ray = plan.rays().ray(x, y);
    let far = plan.domain().diagonal() / ray.direction.length();
    PlanRay { anchor: ray.anchor + DVec3::from(beside) * plan.rays().rounding(x, y, &ray, far), ..ray }
}

/// The far ends of a ray's segments in the bricks, from back to front: brick, and surface.
fn expected(plan: &FramePlan, cells: &[UVec3], ray: &PlanRay) -> Vec<(u32, f32, f64)> {
    let (index, domain, lengths) = (plan.field().index(), plan.domain(), plan.sampling().lengths());
    let n = f64::from(index.lattice().cell_samples);
    let mut ends = Vec::new();
    for (brick, cell) in cells.iter().enumerate() {
        let reach = index.at(*cell).reach();
        let (low, high) = reach.block(*cell);
        let (mut start, mut end) = (ray.t_eye, f64::INFINITY);
        for axis in 0..3 {
            let face_of = |cell: u32| f64::from(cell) * n;
            let first = if low[axis] == 0 { domain.min[axis] } else { face_of(low[axis]) };
            let last = if high[axis] >= index.dims()[axis] { domain.max[axis] } else { face_of(high[axis]) };
            let at =
                |face: f64| (face - plan.rays().center[axis] - ray.anchor[axis]) / ray.direction[axis] + ray.t_anchor;
            start = start.max(at(first).min(at(last)));
            end = end.min(at(first).max(at(last)));
        }
        let step = plan.sampling().step_world() * ray.stretch * f64::from(reach.level_of_brick().stride());
        // Nothing that a rounding could take away.
        if end - start < 1e-6 {
            continue;
        }
        if lengths == Lengths::True {
            ends.push((brick as u32, ProxyCorner::EXIT, end));
        }
        let shift = if lengths == Lengths::True { 0.0 } else { 0.5 };
        for k in (start / step - shift).ceil() as i64..=(end / step - shift).floor() as i64 {
            let t = (k as f64 + shift) * step;
            if t > start + 1e-6 && t < end - 1e-6 {
                ends.push((brick as u32, k as f32, t));
            }
        }
    }
    ends.sort_by(|a, b| b.2.total_cmp(&a.2));
    ends
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn every_segment_is_one_fragment_and_the_far_ones_come_first(
        eye in prop::array::uniform3(-0.6f64..1.6),
        target in prop::array::uniform3(0.2f64..0.8),
        // From a thousandth of a pixel's way of rounding to very wide.
        fov_y in (-6.0f64..0.45).prop_map(|e| 10f64.powf(e)),
        beside in prop::array::uniform3(-1.0f64..1.0),
        target_in_corner in any::<bool>(),
        parallel in any::<bool>(),
        placement in 0usize..3,
        nominal in any::<bool>(),
        seed in any::<u32>(),
        side in prop::sample::select(vec![BrickSide::S16, BrickSide::S32, BrickSide::S64]),
        step_world in 0.9f64..5.0,
    ) {
        let volume = support::volume([50, 40, 34], DVec3::new(1.0, 1.2, 0.7), ScalarType::U8, |_| 100.0);
        let b = volume.grid().world_box();
        let at = |p: [f64; 3]| b.min + b.extent() * DVec3::from(p);
        let corner = volume.grid().world(IndexPos(DVec3::new(30.5, 15.5, 15.5))).0;
        let target = if target_in_corner { corner } else { at(target) };
        prop_assume!(at(eye).distance(target) > 1.0);
        let projection = match parallel {
            true => Projection::Orthographic { height: 40.0 },
            false => Projection::Perspective { fov_y },
        };
        let Ok(camera) = Camera::look_at(at(eye), target, DVec3::new(0.1, 0.2, 1.0), projection) else { return Ok(()) };
        let level = |cell: UVec3| ((cell.x * 7 + cell.y * 13 + cell.z * 29 + seed) % 3) as u8;
        let placements =
            [Placement::TessellatedShells { facet_pixels: 5 }, Placement::ViewportPlanes, Placement::ObjectPlanes];
        let setup = Setup {
            camera,
            step_world,
            level: &level,
            side,
            size: UVec2::new(17, 13),
            placement: placements[placement],
            division: Division::Brick,
            lengths: if nominal { Lengths::Nominal } else { Lengths::True },
            ..Setup::new(&volume, TransferFunction::constant(0.1, [1.0; 3]).unwrap())
        };
        let parts = setup.parts();
        let is_first = |cell: &UVec3| match parts.field.index().at(*cell) {
            IndexEntry::Resident { reach, .. } => reach.block(*cell).0 == *cell,
            IndexEntry::Empty { .. } => false,
        };
        let layout = BrickLayout::new(volume.grid().dims(), side);
        let cells: Vec<UVec3> = layout.bricks(Level(0)).map(|id| id.coords).filter(is_first).collect();
        let drawing = Drawing::Polygons { back_to_front: cells.clone(), target: Target::Float32, slices: Slices::Together };
        let plan = FramePlan::new(PlanParts { drawing, ..parts }).unwrap();
        let proxy = plan.proxy().unwrap();
        for (x, y) in (0..13).flat_map(|y| (0..17).map(move |x| (x, y))) {
            let found = fragments(proxy, DVec2::new(f64::from(x), f64::from(y)) + 0.5);
            let mut last = vec![None; cells.len()];
            for (brick, surface, _) in expected(&plan, &cells, &ray_beside(&plan, (x, y), beside)) {
                let own = |f: &Fragment| {
                    let owner = match plan.rays().placement {
                        _ if surface == ProxyCorner::EXIT => true,
                        Placement::TessellatedShells { .. } => f.owner == plan.rays().facet_of(x, y),
                        Placement::ObjectPlanes => {
                            let d = plan.rays().ray(x, y).direction;
                            let axis = plan.rays().planes.axis(d);
                            f.owner == 2 * axis as u32 + u32::from(d[axis] > 0.0)
                        }
                        _ => f.owner == 0,
                    };
                    f.brick == brick && f.surface == surface && owner
                };
                let places: Vec<usize> = (0..found.len()).filter(|i| own(&found[*i])).collect();
                let n = places.len();
                // Faces beside each other cover their common edge both: the shader takes the ray's own.
                let is_exit = surface == ProxyCorner::EXIT;
                prop_assert!(n == 1 || (is_exit && n > 1), "pixel ({x}, {y}): {n} fragments of brick {brick}, surface {surface}");
                let before = last[brick as usize].replace(places[0]);
                prop_assert!(before.is_none_or(|before| before < places[0]), "pixel ({x}, {y}), brick {brick}: order");
            }
        }
    }
}
