//! Variants compile, and hold nothing that they do not need.

use std::collections::HashSet;

use brickfield_core::Interblock;
use brickfield_frame::{
    Division, Feature, FeatureSet, Fetch, Join, Lengths, QuadratureRule, Resource, ShaderFunction, Slices,
};
use brickfield_shaders::{
    BindingKind, Entry, FieldKind, KnotSearch, Segments, ShaderError, ShaderLibrary, Specialised, Surfaces, Variant,
    specialise,
};

fn compile(variant: &Variant) -> Specialised {
    specialise(variant).unwrap_or_else(|e| panic!("{variant:?}: {e}"))
}

fn march(features: FeatureSet, rule: QuadratureRule) -> Specialised {
    compile(&Variant::new(features, rule, Entry::March))
}

fn unlit(features: FeatureSet) -> FeatureSet {
    features.without(Feature::Light).without(Feature::LightBesideEye).without(Feature::StoredGradients)
}

fn resources(shader: &Specialised) -> Vec<Resource> {
    shader.bindings.iter().map(|b| b.resource).collect()
}

/// The options of a variant, each as a number below its count.
const N_OPTIONS: usize = Feature::ALL.len() + 7;

fn counts() -> [usize; N_OPTIONS] {
    let mut counts = [2; N_OPTIONS];
    let others =
        [FieldKind::ALL.len(), QuadratureRule::ALL.len(), Segments::all().count(), KnotSearch::all().count(), 2, 2];
    counts[Feature::ALL.len()..N_OPTIONS - 1].copy_from_slice(&others);
    counts[N_OPTIONS - 1] = Entry::all().count();
    counts
}

/// The variant of some options; `None` if no plan asks for it.
fn variant(options: &[usize; N_OPTIONS]) -> Option<Variant> {
    let features = Feature::ALL.into_iter().zip(options).filter(|(_, o)| **o == 1).map(|(f, _)| f).collect();
    let [field, rule, segments, search, long_rays, integer_samples, entry] = options[Feature::ALL.len()..] else {
        panic!("seven options behind the features")
    };
    let mut variant = Variant::new(features, QuadratureRule::ALL[rule], Entry::all().nth(entry)?);
    variant.field = FieldKind::ALL[field];
    variant.segments = Segments::all().nth(segments)?;
    variant.search = KnotSearch::all().nth(search)?;
    variant.long_rays = long_rays == 1;
    variant.integer_samples = integer_samples == 1;
    let Segments { surfaces, division, lengths } = variant.segments;
    let is_nominal = lengths == Lengths::Nominal;
    let is_drawn = surfaces != Surfaces::Shells && division == Division::Brick && !variant.long_rays;
    let is_blended = matches!(variant.field, FieldKind::Blocks(Join::Blend(_)));
    let is_of_blocks = matches!(variant.field, FieldKind::Blocks(_) | FieldKind::Dense);
    let is_asked_for = (!is_nominal || variant.rule == QuadratureRule::MidpointExponential)
        && (!matches!(variant.entry, Entry::Proxy(_)) || is_drawn)
        && (variant.entry != Entry::Proxy(Slices::InteriorsFirst) || is_blended)
        && (matches!(variant.field, FieldKind::Bricks | FieldKind::Placed) || !features.contains(Feature::SkipDark))
        && (!matches!(variant.entry, Entry::Probe(_))
            || (variant.entry == Entry::Probe(Fetch::Filtered)) == features.contains(Feature::HardwareFilter))
        && (is_of_blocks || !features.contains(Feature::ShortBlocks))
        && (matches!(variant.field, FieldKind::Blocks(_)) || !features.contains(Feature::Prefiltered))
        && (variant.rule != QuadratureRule::PreIntegrated || !features.contains(Feature::Prefiltered))
        && (features.contains(Feature::TransferLookup) || !features.contains(Feature::Light))
        && (features.contains(Feature::Light) || !features.contains(Feature::LightBesideEye))
        && (features.contains(Feature::Light) && matches!(variant.field, FieldKind::Blocks(_) | FieldKind::Dense)
            || !features.contains(Feature::StoredGradients));
    is_asked_for.then_some(variant)
}

/// All pairs of two options' values that some variant has.
fn pairs(options: &[usize; N_OPTIONS]) -> impl Iterator<Item = [usize; 4]> {
    (0..N_OPTIONS).flat_map(move |i| (0..i).map(move |j| [i, options[i], j, options[j]]))
}

/// Variants in which every pair of values of any two options occurs that can occur at all (of 40,000 random variants).
fn covering() -> Vec<Variant> {
    let mut state = 1u64;
    let mut random = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n
    };
    let mut candidates = Vec::new();
    while candidates.len() < 40_000 {
        let options = counts().map(&mut random);
        candidates.extend(variant(&options).map(|v| (options, v)));
    }
    let mut open: HashSet<[usize; 4]> = candidates.iter().flat_map(|(options, _)| pairs(options)).collect();
    let mut chosen = Vec::new();
    while !open.is_empty() {
        // The best of a few that have something new.
        let gain = |options: &[usize; N_OPTIONS]| pairs(options).filter(|p| open.contains(p)).count();
        let new = candidates.iter().filter(|(options, _)| gain(options) > 0).take(60);
        let (options, variant) = new.max_by_key(|(options, _)| gain(options)).expect("an open pair is of a candidate");
        open.retain(|pair| !pairs(options).any(|p| p == *pair));
        chosen.push(*variant);
    }
    chosen
}

#[test]
fn every_pair_of_options_compiles_and_binds_what_it_names() {
    let variants = covering();
    assert!((100..1000).contains(&variants.len()), "{}", variants.len());
    for variant in variants {
        let shader = compile(&variant);
        assert!(shader.spirv().unwrap().len() > 100);
        let uses = |resource| shader.uses(resource);
        let is_lit = variant.features.contains(Feature::Light);
        let draws = matches!(variant.entry, Entry::March | Entry::Proxy(_));
        assert_eq!(uses(Resource::Light), is_lit && draws);
        let is_stored = variant.features.contains(Feature::StoredGradients);
        assert_eq!(uses(Resource::Gradients), is_stored && draws);
        assert_eq!(uses(Resource::OneGradients), is_stored && draws && variant.field != FieldKind::Dense);
        match variant.entry {
            Entry::March => {
                assert_eq!(shader.workgroup_size, [8, 8, 1]);
                assert_eq!(uses(Resource::SeenBefore), variant.long_rays);
                let has_facets = variant.segments.surfaces == Surfaces::TessellatedShells;
                assert_eq!(uses(Resource::Facets), has_facets);
                let reads = uses(Resource::Index) && variant.features.contains(Feature::TransferLookup);
                assert_eq!(uses(Resource::Places), uses(Resource::Index) && variant.field == FieldKind::Placed);
                let is_of_blocks = matches!(variant.field, FieldKind::Blocks(_));
                assert_eq!(uses(Resource::Blocks), uses(Resource::Index) && is_of_blocks);
                assert!(!reads || uses(Resource::Atlas));
                let is_prefiltered = reads && variant.features.contains(Feature::Prefiltered);
                let of_spreads = [Resource::Spreads, Resource::OneSpreads, Resource::Ranges];
                assert!(of_spreads.into_iter().all(|resource| uses(resource) == is_prefiltered));
            }
            Entry::Proxy(_) => {
                assert_eq!(shader.module.entry_points.len(), 2);
                let of_rays = [Resource::Picture, Resource::SeenBefore, Resource::Beams];
                assert!(!of_rays.into_iter().any(uses), "{:?}", resources(&shader));
                // A gradient may ask the next brick.
                assert!(!uses(Resource::Index) || variant.features.contains(Feature::Light));
            }
            Entry::Probe(_) => assert!(uses(Resource::Means)),
            Entry::Decode => assert!(uses(Resource::PackedWords) && shader.n_storage_buffers() == 4),
            Entry::Mesh(_) => {
                let expected = [Resource::MeshView, Resource::Vertices, Resource::Triangles, Resource::Colors];
                assert_eq!(resources(&shader), expected);
            }
            Entry::Cells(shading) => {
                assert_eq!(shader.workgroup_size, [8, 8, 1]);
                assert!([Resource::Nodes, Resource::Faces, Resource::Boxes].into_iter().all(uses));
                assert_eq!((uses(Resource::Voids), uses(Resource::Ends)), (shading.has_voids, shading.has_ends));
            }
            Entry::Evaluate(_) => {
                let outputs = |b: &&brickfield_shaders::Binding| b.resource == Resource::Outputs;
                let outputs = shader.bindings.iter().find(outputs).unwrap();
                assert_eq!(outputs.kind, BindingKind::StorageReadWrite);
            }
        }
    }
}

#[test]
fn a_device_with_few_storage_buffers_gets_a_shader_without_shortcuts() {
    let unlit = unlit(FeatureSet::all());
    let mut general = Variant::new(unlit, QuadratureRule::MidpointExponential, Entry::March);
    general.long_rays = true;
    general.segments.surfaces = Surfaces::TessellatedShells;
    general.search = KnotSearch::Loop;
    let library = ShaderLibrary::embedded();
    let within = |limit| library.specialise_within(&general, limit);
    assert_eq!(within(6).unwrap().n_storage_buffers(), 6);
    let four = within(4).unwrap();
    assert_eq!(resources(&four).iter().filter(|r| [Resource::Beams, Resource::Occupancy].contains(r)).count(), 0);
    assert!(within(5).unwrap().uses(Resource::Occupancy) && !within(5).unwrap().uses(Resource::Beams));
    assert_eq!(within(3).unwrap_err(), ShaderError::TooManyStorageBuffers { n: 4, limit: 3 });
}

#[test]
fn every_search_compiles_and_only_the_last_loops() {
    let features = FeatureSet::default().with(Feature::TransferLookup);
    let classify = Entry::Evaluate(ShaderFunction::Classify);
    for search in KnotSearch::all() {
        for (rule, entry) in
            [(QuadratureRule::MidpointExponential, classify), (QuadratureRule::PreIntegrated, Entry::March)]
        {
            let mut variant = Variant::new(features, rule, entry);
            variant.search = search;
            let shader = compile(&variant);
            assert!(entry == Entry::March || shader.wgsl.contains("for (") == (search == KnotSearch::Loop));
        }
    }
}

#[test]
fn what_a_scene_does_not_need_is_left_out() {
    let rule = QuadratureRule::MidpointExponential;
    // Bricks have no stored gradients.
    let all = FeatureSet::all().without(Feature::StoredGradients);
    use Resource::{Atlas, AtlasSampler, Beams, FewKnots, Frame, Index, Knots, Light, Occupancy, Picture};
    let of_general = [Frame, Atlas, AtlasSampler, Index, Picture, Occupancy, Beams, Light, FewKnots];
    assert_eq!(resources(&march(all, rule)), of_general);
    for (feature, resource) in [
        (Feature::HardwareFilter, AtlasSampler),
        (Feature::SkipDark, Occupancy),
        (Feature::SkipBesideBeams, Beams),
        (Feature::Light, Light),
    ] {
        assert!(!march(all.without(feature), rule).uses(resource), "{}", resource.name());
    }
    assert_eq!(resources(&march(FeatureSet::default(), rule)), [Frame, Knots, Picture]);
    let skipping = march(FeatureSet::default().with(Feature::SkipEmpty), rule);
    assert_eq!(resources(&skipping), [Frame, Index, Knots, Picture]);

    let general = march(all, rule);
    // Light looks values up.
    let unlit = unlit(all);
    let of_blocks = |features| {
        let mut variant = Variant::new(features, rule, Entry::March);
        variant.field = FieldKind::Blocks(Join::Blend(Interblock::MaximumDistance));
        compile(&variant)
    };
    for feature in all.iter().filter(|f| *f != Feature::HardwareFilter) {
        let (with, without) = match feature {
            Feature::ShortBlocks | Feature::Prefiltered => {
                let features = all.without(Feature::SkipDark);
                (of_blocks(features), of_blocks(features.without(feature)))
            }
            Feature::Lent => {
                let of_places = |features| {
                    let mut variant = Variant::new(features, rule, Entry::March);
                    variant.field = FieldKind::Placed;
                    compile(&variant)
                };
                (of_places(all), of_places(all.without(feature)))
            }
            Feature::TransferLookup => (march(unlit, rule), march(unlit.without(feature), rule)),
            _ => (general.clone(), march(all.without(feature), rule)),
        };
        assert!(without.counts.expressions < with.counts.expressions, "{}", feature.name());
        assert!(without.spirv().unwrap().len() < with.spirv().unwrap().len(), "{}", feature.name());
    }
    let least = march(FeatureSet::default(), rule);
    assert!(least.counts.functions < general.counts.functions);
    for (text, feature) in [
        ("textureSampleLevel", Feature::HardwareFilter),
        ("fn ended", Feature::EarlyTermination),
        ("resident", Feature::SkipEmpty),
        ("fn dark_around", Feature::SkipDark),
        ("let beam", Feature::SkipBesideBeams),
        ("    scale: f32", Feature::MultiLevel),
        ("fn shade_at", Feature::Light),
        ("fn gradient_at", Feature::Light),
        ("fn towards_light", Feature::LightBesideEye),
    ] {
        assert!(general.wgsl.contains(text) && !march(all.without(feature), rule).wgsl.contains(text), "{text}");
    }
    assert!(march(unlit, rule).wgsl.contains("fn later"));
    assert!(!march(unlit.without(Feature::TransferLookup), rule).wgsl.contains("fn later"));
    assert!(!general.wgsl.contains("textureGather") && !general.wgsl.contains("preintegrate"));
}

#[test]
fn functions_bind_what_they_read() {
    use Resource::{Atlas, FewKnots, Frame, Index, Inputs, Knots, NearestSampler, Outputs};
    let among = |n_knots, function| {
        let features = FeatureSet::default().with(Feature::TransferLookup);
        let mut variant = Variant::new(features, QuadratureRule::Gauss2, Entry::Evaluate(function));
        variant.search = KnotSearch::among(n_knots);
        resources(&compile(&variant))
    };
    let of = |function| among(4, function);
    assert_eq!(of(ShaderFunction::Alpha), [Inputs, Outputs]);
    assert_eq!(of(ShaderFunction::Classify), [Frame, Inputs, Outputs, FewKnots]);
    assert_eq!(among(9, ShaderFunction::Classify), [Frame, Knots, Inputs, Outputs]);
    assert_eq!(of(ShaderFunction::Sample), [Frame, Atlas, NearestSampler, Index, Inputs, Outputs]);
    assert_eq!(of(ShaderFunction::RayAnchor), [Frame, Inputs, Outputs]);
}

#[test]
fn a_probe_reads_one_way_and_binds_no_more() {
    use Resource::{Atlas, AtlasSampler, Means, NearestSampler, Probe};
    let filtered = compile(&Variant::probe(Fetch::Filtered));
    assert_eq!((resources(&filtered), filtered.workgroup_size), (vec![Probe, Atlas, AtlasSampler, Means], [8, 8, 1]));
    assert!(!filtered.wgsl.contains("textureGather"));
    let gathered = compile(&Variant::probe(Fetch::Gathered));
    assert_eq!((resources(&gathered), gathered.workgroup_size), (vec![Probe, Atlas, NearestSampler, Means], [8, 8, 1]));
    assert!(!gathered.wgsl.contains("textureSample"));
    assert!([filtered, gathered].iter().all(|shader| shader.spirv().unwrap().len() > 100));
}
