//! Host structs against the offsets that naga gives the shaders' structs.

use std::mem::{offset_of, size_of};

use brickfield_frame::{FeatureSet, Fetch, FrameUniforms, KnotUniform, PlaceUniform, ProbeUniforms, QuadratureRule};
use brickfield_shaders::naga::{Module, TypeInner};
use brickfield_shaders::{Entry, FieldKind, Variant, specialise};

macro_rules! host {
    ($t:ty, $($member:ident),*) => { (vec![$((stringify!($member), offset_of!($t, $member))),*], size_of::<$t>()) };
}

fn shader(module: &Module, name: &str) -> (Vec<(String, usize)>, usize) {
    let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).expect(name);
    let TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
    let members = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize));
    (members.collect(), *span as usize)
}

fn assert_equal(module: &Module, name: &str, (members, size): (Vec<(&str, usize)>, usize)) {
    let (found, span) = shader(module, name);
    let found: Vec<_> = found.iter().map(|(n, o)| (n.as_str(), *o)).collect();
    assert_eq!((found, span), (members, size), "{name}");
}

#[test]
fn host_and_shader_structs_have_the_same_layout() {
    let mut variant = Variant::new(FeatureSet::all(), QuadratureRule::MidpointExponential, Entry::March);
    variant.features = variant.features.without(brickfield_frame::Feature::SkipMacrocells);
    variant.field = FieldKind::Placed;
    let module = specialise(&variant).unwrap().module;
    #[rustfmt::skip]
    assert_equal(&module, "Frame", host!(FrameUniforms, anchor, anchor_past_start, anchor_right, pixel, anchor_down,
        anchor_depth, direction, least_parameter, direction_right, step_world, direction_down, transmittance_floor,
        domain_min, sample_scale, domain_max, sample_offset, visible_min, cell_samples, visible_max, first_segment,
        first_sample, end_segment, last_sample, counted_from, index_origin, beam_pixels, index_dims, n_knots,
        atlas_bricks, brick_samples, size, first_row, facet_pixels, planes_low, facet_columns, planes_high, padding_0,
        voxel_world, padding_1));
    assert_equal(&module, "Knot", host!(KnotUniform, optics, value, per_value, padding));
    assert_equal(&module, "Place", host!(PlaceUniform, texel, level, first, padding, last, axes));
    for fetch in Fetch::ALL {
        assert_equal(&specialise(&Variant::probe(fetch)).unwrap().module, "Probe", host!(ProbeUniforms, work));
    }
}
