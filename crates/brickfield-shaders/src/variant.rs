//! Which shader a plan needs.

use brickfield_frame::{Feature, FeatureSet, FramePlan, QuadratureRule, ShaderFunction};

/// One shader of the family: what is compiled in. A key for pipeline caches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// What the scene needs; the rest is left out.
    ///
    /// Without [`Feature::MultiLevel`] all resident bricks are of level 0, without [`Feature::SkipTransparent`] all blocks
    /// are resident.
    pub features: FeatureSet,
    /// How segments are integrated.
    pub rule: QuadratureRule,
    /// What is run.
    pub entry: Entry,
}

/// What a shader does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Entry {
    /// Renders the picture.
    March,
    /// Evaluates one function on a list of inputs.
    Evaluate(ShaderFunction),
}

impl Entry {
    /// Both kinds of entries, the second for each function.
    pub fn all() -> impl Iterator<Item = Entry> {
        std::iter::once(Entry::March).chain(ShaderFunction::ALL.into_iter().map(Entry::Evaluate))
    }

    /// The entry point's name.
    pub const fn entry_point(self) -> &'static str {
        match self {
            Entry::March => "march",
            Entry::Evaluate(_) => "evaluate",
        }
    }
}

impl Variant {
    /// The shader that replays `plan`.
    pub fn of(plan: &FramePlan, entry: Entry) -> Variant {
        Variant { features: plan.features, rule: plan.sampling.rule(), entry }
    }

    /// The conditions (`@if(name)`) that hold.
    pub(crate) fn conditions(self) -> Vec<(String, bool)> {
        let has = |f| self.features.contains(f);
        let features = Feature::ALL.into_iter().map(|f| (f.name().to_owned(), has(f)));
        let rules = QuadratureRule::ALL.into_iter().map(|r| (condition_of_rule(r), r == self.rule));
        let evaluated = |f| self.entry == Entry::Evaluate(f);
        let functions = ShaderFunction::ALL.into_iter().map(|f| (format!("evaluate_{}", f.name()), evaluated(f)));
        let two_nodes = self.rule.nodes().len() > 1;
        let derived = [
            ("one_node", !two_nodes),
            ("two_nodes", two_nodes),
            ("bricks", has(Feature::TransferLookup) || has(Feature::SkipTransparent)),
        ];
        let derived = derived.into_iter().map(|(name, holds)| (name.to_owned(), holds));
        features.chain(rules).chain(functions).chain(derived).collect()
    }
}

fn condition_of_rule(rule: QuadratureRule) -> String {
    format!("rule_{}", rule.name().replace('-', "_"))
}
