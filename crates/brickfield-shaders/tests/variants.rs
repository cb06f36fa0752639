//! Every variant compiles, and holds nothing that it does not need.

use brickfield_frame::{Division, Feature, FeatureSet, Fetch, Lengths, QuadratureRule, ShaderFunction};
use brickfield_shaders::{BindingKind, Entry, KnotSearch, Segments, Specialised, Surfaces, Variant, specialise};

const SEARCH: KnotSearch = KnotSearch::Unrolled(2);

fn feature_sets() -> impl Iterator<Item = FeatureSet> {
    (0..1u32 << Feature::ALL.len())
        .map(|bits| Feature::ALL.into_iter().filter(|f| bits >> *f as u32 & 1 == 1).collect())
}

/// A variant for short rays through samples that are no 16-bit integers.
fn variant(features: FeatureSet, rule: QuadratureRule, entry: Entry) -> Variant {
    Variant {
        features,
        rule,
        segments: Segments::default(),
        search: SEARCH,
        long_rays: false,
        integer_samples: false,
        entry,
    }
}

fn compile(variant: &Variant) -> Specialised {
    specialise(variant).unwrap_or_else(|e| panic!("{variant:?}: {e}"))
}

fn march(features: FeatureSet, rule: QuadratureRule) -> Specialised {
    compile(&variant(features, rule, Entry::March))
}

fn indices(shader: &Specialised) -> Vec<u32> {
    shader.bindings.iter().map(|b| b.index).collect()
}

#[test]
fn every_variant_of_the_march_compiles() {
    for features in feature_sets() {
        for rule in QuadratureRule::ALL {
            for (long_rays, integer_samples) in [(false, false), (true, false), (false, true), (true, true)] {
                let variant = Variant { long_rays, integer_samples, ..variant(features, rule, Entry::March) };
                let shader = compile(&variant);
                assert!(shader.spirv().unwrap().len() > 100);
                assert_eq!(shader.workgroup_size, [8, 8, 1]);
                assert_eq!(indices(&shader).contains(&8), long_rays);
            }
        }
    }
}

#[test]
fn every_kind_of_segments_compiles() {
    // With every feature, none, and all but one.
    let all = FeatureSet::all();
    let sets = Feature::ALL.map(|f| all.without(f)).into_iter().chain([all, FeatureSet::default()]);
    for features in sets {
        for (segments, rule) in Segments::all().flat_map(|s| QuadratureRule::ALL.map(|rule| (s, rule))) {
            if segments.lengths == Lengths::Nominal && rule != QuadratureRule::MidpointExponential {
                continue;
            }
            for long_rays in [false, true] {
                let variant = Variant { segments, long_rays, ..variant(features, rule, Entry::March) };
                let shader = compile(&variant);
                assert_eq!(indices(&shader).contains(&12), segments.surfaces == Surfaces::TessellatedShells);
                assert!(shader.spirv().unwrap().len() > 100);
            }
        }
    }
}

#[test]
fn every_kind_of_polygons_compiles() {
    let all = FeatureSet::all();
    for features in Feature::ALL.map(|f| all.without(f)).into_iter().chain([all, FeatureSet::default()]) {
        for (segments, rule) in Segments::all().flat_map(|s| QuadratureRule::ALL.map(|rule| (s, rule))) {
            let is_known = segments.lengths == Lengths::True || rule == QuadratureRule::MidpointExponential;
            if segments.division == Division::Ray || segments.surfaces == Surfaces::Shells || !is_known {
                continue;
            }
            let shader = compile(&Variant { segments, ..variant(features, rule, Entry::Proxy) });
            assert_eq!(shader.module.entry_points.len(), 2);
            assert!(shader.spirv().unwrap().len() > 100);
            // No march, no index, no picture to store to.
            assert!([3, 5, 8, 9, 10].iter().all(|index| !indices(&shader).contains(index)), "{:?}", indices(&shader));
        }
    }
}

#[test]
fn every_variant_of_every_function_compiles() {
    for features in feature_sets() {
        for rule in QuadratureRule::ALL {
            for function in ShaderFunction::ALL {
                for integer_samples in [false, true] {
                    let entry = Entry::Evaluate(function);
                    let shader = compile(&Variant { integer_samples, ..variant(features, rule, entry) });
                    assert!(shader.bindings.iter().any(|b| b.index == 7 && b.kind == BindingKind::StorageReadWrite));
                }
            }
        }
    }
}

#[test]
fn every_search_compiles_and_only_the_last_loops() {
    let features = FeatureSet::default().with(Feature::TransferLookup);
    let classify = Entry::Evaluate(ShaderFunction::Classify);
    for search in KnotSearch::all() {
        for (rule, entry) in
            [(QuadratureRule::MidpointExponential, classify), (QuadratureRule::PreIntegrated, Entry::March)]
        {
            let shader = compile(&Variant { search, ..variant(features, rule, entry) });
            assert!(entry == Entry::March || shader.wgsl.contains("for (") == (search == KnotSearch::Loop));
        }
    }
}

#[test]
fn what_a_scene_does_not_need_is_left_out() {
    let rule = QuadratureRule::MidpointExponential;
    let all = FeatureSet::all();
    assert_eq!(indices(&march(all, rule)), [0, 1, 2, 3, 4, 5, 9, 10]);
    assert_eq!(indices(&march(all.without(Feature::HardwareFilter), rule)), [0, 1, 3, 4, 5, 9, 10]);
    assert_eq!(indices(&march(all.without(Feature::SkipMacrocells), rule)), [0, 1, 2, 3, 4, 5, 10]);
    assert_eq!(indices(&march(all.without(Feature::SkipBesideBeams), rule)), [0, 1, 2, 3, 4, 5, 9]);
    assert_eq!(indices(&march(FeatureSet::default(), rule)), [0, 4, 5]);
    assert_eq!(indices(&march(FeatureSet::default().with(Feature::SkipTransparent), rule)), [0, 3, 4, 5]);

    let general = march(all, rule);
    for feature in Feature::ALL.into_iter().filter(|f| *f != Feature::HardwareFilter) {
        let without = march(all.without(feature), rule);
        assert!(without.counts.expressions < general.counts.expressions, "{}", feature.name());
        assert!(without.spirv().unwrap().len() < general.spirv().unwrap().len(), "{}", feature.name());
    }
    let least = march(FeatureSet::default(), rule);
    assert!(least.counts.functions < general.counts.functions);
    for (text, feature) in [
        ("textureSampleLevel", Feature::HardwareFilter),
        ("fn ended", Feature::EarlyTermination),
        ("resident", Feature::SkipTransparent),
        ("fn macrocells_at", Feature::SkipMacrocells),
        ("beam", Feature::SkipBesideBeams),
        ("scale", Feature::MultiLevel),
        ("fn knot_below", Feature::TransferLookup),
    ] {
        assert!(general.wgsl.contains(text) && !march(all.without(feature), rule).wgsl.contains(text), "{text}");
    }
    assert!(!general.wgsl.contains("textureLoad") && !general.wgsl.contains("preintegrate"));
}

#[test]
fn functions_bind_what_they_read() {
    let bindings = |function| {
        let rule = QuadratureRule::Gauss2;
        let features = FeatureSet::default().with(Feature::TransferLookup);
        indices(&compile(&variant(features, rule, Entry::Evaluate(function))))
    };
    assert_eq!(bindings(ShaderFunction::Alpha), [6, 7]);
    assert_eq!(bindings(ShaderFunction::Classify), [0, 4, 6, 7]);
    assert_eq!(bindings(ShaderFunction::Sample), [0, 1, 3, 6, 7]);
    assert_eq!(bindings(ShaderFunction::RayAnchor), [0, 6, 7]);
}

#[test]
fn a_probe_reads_one_way_and_binds_no_more() {
    let filtered = compile(&Variant::probe(Fetch::Filtered));
    assert_eq!((indices(&filtered), filtered.workgroup_size), (vec![0, 1, 2, 7], [8, 8, 1]));
    assert!(!filtered.wgsl.contains("textureLoad"));
    let loaded = compile(&Variant::probe(Fetch::Loaded));
    assert_eq!((indices(&loaded), loaded.workgroup_size), (vec![0, 1, 7], [8, 8, 1]));
    assert!(!loaded.wgsl.contains("textureSample"));
    assert!([filtered, loaded].iter().all(|shader| shader.spirv().unwrap().len() > 100));
}
