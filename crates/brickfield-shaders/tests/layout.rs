//! Host structs against the offsets that naga gives the shaders' structs.

use std::mem::{offset_of, size_of};

use brickfield_frame::{
    CellsShading, DecodingUniforms, FaceBox, Feature, FeatureSet, Fetch, FrameUniforms, KnotUniform, LightUniform,
    MeshShading, MeshUniforms, MeshVertex, PackedUniform, PlaceUniform, ProbeUniforms, QuadratureRule,
};
use brickfield_shaders::naga::{Module, TypeInner};
use brickfield_shaders::{Entry, FieldKind, Variant, specialise};

macro_rules! host {
    ($t:ty, $($member:ident $(= $host:ident)?),*) => {
        (vec![$((stringify!($member), host!(@ $t, $member $($host)?))),*], size_of::<$t>())
    };
    (@ $t:ty, $member:ident) => { offset_of!($t, $member) };
    (@ $t:ty, $member:ident $host:ident) => { offset_of!($t, $host) };
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
    variant.features = variant.features.without(Feature::StoredGradients);
    variant.field = FieldKind::Placed;
    let module = specialise(&variant).unwrap().module;
    #[rustfmt::skip]
    assert_equal(&module, "Frame", host!(FrameUniforms, anchor, anchor_right, anchor_down, direction, direction_right,
        direction_down, domain_min, domain_max, visible_min, visible_max, first_sample, last_sample, index_origin,
        index_dims, atlas_bricks, planes_low, planes_high, voxel_world, size, facets_of_picture = facet_pixels));
    assert_rows();
    assert_equal(&module, "Knot", host!(KnotUniform, optics, value, per_value, begins));
    #[rustfmt::skip]
    assert_equal(&module, "Light", host!(LightUniform, steepness_x, steepness_y, steepness_z, world_x, world_y, world_z, source,
        ambient, diffuse, specular, shininess, greatest_slope, back));
    assert_equal(&module, "Place", host!(PlaceUniform, texel, level, first, padding, last, axes));
    let decode = specialise(&Variant::decode()).unwrap().module;
    assert_equal(&decode, "Decoding", host!(DecodingUniforms, task, level, axis, sample_bits));
    #[rustfmt::skip]
    assert_equal(&decode, "PackedBrick", host!(PackedUniform, extent, n_levels, first_coefficient, first_texel, row_words, step,
        first_word, kernel, value, padding));
    let shading = MeshShading { lit: true, has_normals: true, has_lines: true, ..MeshShading::default() };
    let mesh = specialise(&Variant::mesh(shading)).unwrap().module;
    #[rustfmt::skip]
    assert_equal(&mesh, "MeshView", host!(MeshUniforms, clip_x, clip_y, clip_z, clip_w, anchor, anchor_right, anchor_down, direction,
        direction_right, direction_down, line, source, n_knots, shininess, unit, padding));
    assert_equal(&mesh, "Vertex", host!(MeshVertex, position, normal));
    let midpoint = QuadratureRule::MidpointExponential;
    let cells = Variant::new(FeatureSet::default(), midpoint, Entry::Cells(CellsShading::default()));
    let cells = specialise(&cells).unwrap().module;
    assert_equal(&cells, "FaceBox", host!(FaceBox, low = min, first, high = max, n_faces));
    for fetch in Fetch::ALL {
        assert_equal(&specialise(&Variant::probe(fetch)).unwrap().module, "Probe", host!(ProbeUniforms, work));
    }
}

/// Numbers that share a row of the frame's uniforms are where the functions of frame.wesl look for them: `name` reads component
/// `component` of the row `row`.
fn assert_rows() {
    macro_rules! offsets {
        ($($member:ident),*) => { [$((stringify!($member), offset_of!(FrameUniforms, $member))),*] };
    }
    let host = offsets!(
        anchor,
        anchor_past_start,
        anchor_right,
        pixel_side,
        anchor_down,
        anchor_depth,
        direction,
        least_parameter,
        direction_right,
        step_world,
        direction_down,
        end_depth,
        domain_min,
        sample_scale,
        domain_max,
        sample_offset,
        visible_min,
        cell_samples,
        visible_max,
        first_segment,
        first_sample,
        end_segment,
        last_sample,
        counted_from,
        index_origin,
        dense_stride,
        index_dims,
        n_knots,
        atlas_bricks,
        brick_samples,
        planes_low,
        spread_scale,
        planes_high,
        bins_per_value,
        size,
        first_row,
        beam_pixels,
        facet_pixels,
        facet_columns,
        goes_on,
        seen_row
    );
    let offset = |name: &str| match name {
        "facets_of_picture" => offset_of!(FrameUniforms, facet_pixels),
        _ => host.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name}")).1,
    };
    let library = brickfield_shaders::ShaderLibrary::embedded();
    let (_, text) = library.modules().find(|(name, _)| *name == "frame").unwrap();
    let functions: Vec<&str> = text.split("\nfn ").skip(1).filter(|f| f.contains("return frame.")).collect();
    assert_eq!(functions.len(), 23);
    for function in functions {
        let name = function.split('(').next().unwrap();
        let read = function.split("return frame.").nth(1).unwrap().split(';').next().unwrap();
        let (row, component) = read.split_once('.').unwrap();
        let place = 4 * "xyzw".find(component).unwrap();
        assert_eq!(offset(name), offset(row) + place, "{name} is not {read}");
    }
}
