//! Host structs against the offsets that naga gives the shaders' structs.

use std::mem::{offset_of, size_of};

use brickfield_frame::{FeatureSet, Fetch, FrameUniforms, KnotUniform, ProbeUniforms, QuadratureRule};
use brickfield_shaders::naga::{Module, TypeInner};
use brickfield_shaders::{Entry, KnotSearch, Segments, Variant, specialise};

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
    let variant = Variant {
        features: FeatureSet::all(),
        rule: QuadratureRule::MidpointExponential,
        segments: Segments::default(),
        search: KnotSearch::Unrolled(2),
        long_rays: false,
        integer_samples: false,
        entry: Entry::March,
    };
    let module = specialise(&variant).unwrap().module;
    #[rustfmt::skip]
    assert_equal(&module, "Frame", host!(FrameUniforms, anchor, anchor_right, anchor_down, direction, direction_right,
        direction_down, domain_min, domain_max, visible_min, visible_max, origin, last_sample, index_dims, atlas_bricks, size,
        planes_low, planes_high, voxel_world));
    assert_equal(&module, "Knot", host!(KnotUniform, optics, value));
    for fetch in Fetch::ALL {
        assert_equal(&specialise(&Variant::probe(fetch)).unwrap().module, "Probe", host!(ProbeUniforms, work));
    }
}
