//! Which shader a plan needs.

use brickfield_core::{Interblock, TransferFunction};
use brickfield_frame::{
    CellsPlan, CellsShading, Coloring, Division, FEW_KNOTS, Feature, FeatureSet, Fetch, FramePlan, Join, KnotTable,
    Lengths, MeshShading, Placement, Places, QuadratureRule, ShaderFunction, Slices, ValueScale,
};

use crate::passes::has_long_rays;

/// One shader of the family, by the choices that are compiled in. A key for pipeline caches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Variant {
    /// The features that the scene needs; the rest is left out.
    ///
    /// Without [`Feature::MultiLevel`] all slots are of level 0, without [`Feature::SkipEmpty`] all blocks are resident.
    pub features: FeatureSet,
    /// How values are found.
    pub field: FieldKind,
    /// How segments are integrated.
    pub rule: QuadratureRule,
    /// The segments: their surfaces, the division, and the lengths that they count for.
    pub segments: Segments,
    /// How knots are searched.
    pub search: KnotSearch,
    /// Rays are too long for one pass ([`crate::passes`]), and go on where earlier passes ended.
    pub long_rays: bool,
    /// The plan is a batch: rays go on where earlier batches ended.
    pub batch: bool,
    /// Texture reads of 16-bit samples are turned back into integers, of which f32 keeps all digits.
    pub integer_samples: bool,
    /// The entry point.
    pub entry: Entry,
}

/// The module that answers for the field (`package::field`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FieldKind {
    /// Bricks of one size: arithmetic finds their samples.
    #[default]
    Bricks,
    /// Slots of several sizes: a table says where their samples lie.
    Placed,
    /// Flat blocks: a row for each says its level and its first texel.
    Blocks(Join),
    /// Flat blocks that are blended, all of one level and in their order: one array of samples.
    Dense,
}

impl FieldKind {
    /// All kinds.
    pub const ALL: [FieldKind; 7] = [
        FieldKind::Bricks,
        FieldKind::Placed,
        FieldKind::Blocks(Join::Shared),
        FieldKind::Blocks(Join::Blend(Interblock::MinimumDistance)),
        FieldKind::Blocks(Join::Blend(Interblock::BoundarySplit)),
        FieldKind::Blocks(Join::Blend(Interblock::MaximumDistance)),
        FieldKind::Dense,
    ];

    /// The kind of a plan's field.
    pub fn of(plan: &FramePlan) -> FieldKind {
        match plan.field().slots().places() {
            Places::Even(_) => FieldKind::Bricks,
            Places::Table { .. } => FieldKind::Placed,
            // Of the samples of one array nobody knows which block's range they have.
            Places::Blocks(_) if plan.field().dense_level().is_some() && plan.spreads().is_none() => FieldKind::Dense,
            Places::Blocks(_) => FieldKind::Blocks(plan.field().join()),
        }
    }

    const fn module(self) -> &'static str {
        match self {
            FieldKind::Bricks => "field/bricks",
            FieldKind::Placed => "field/placed",
            FieldKind::Blocks(_) => "field/blocks",
            FieldKind::Dense => "field/dense",
        }
    }

    /// The scheme between flat blocks.
    const fn scheme(self) -> Option<Interblock> {
        match self {
            FieldKind::Blocks(Join::Blend(scheme)) => Some(scheme),
            _ => None,
        }
    }
}

/// The segments of a plan, as far as shaders differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub struct Segments {
    pub surfaces: Surfaces,
    pub division: Division,
    pub lengths: Lengths,
}

/// The kinds of [`Placement`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Surfaces {
    #[default]
    Shells,
    TessellatedShells,
    ViewportPlanes,
    ObjectPlanes,
}

impl Segments {
    /// The segments of a plan.
    pub fn of(plan: &FramePlan) -> Segments {
        let sampling = plan.sampling();
        let surfaces = match plan.rays().placement {
            Placement::Shells => Surfaces::Shells,
            Placement::TessellatedShells { .. } => Surfaces::TessellatedShells,
            Placement::ViewportPlanes => Surfaces::ViewportPlanes,
            Placement::ObjectPlanes => Surfaces::ObjectPlanes,
        };
        Segments { surfaces, division: sampling.division(), lengths: sampling.lengths() }
    }

    /// All segments that shaders tell apart.
    pub fn all() -> impl Iterator<Item = Segments> {
        let divisions = [Division::Ray, Division::Brick].into_iter();
        let pairs = divisions.flat_map(|d| [Lengths::True, Lengths::Nominal].map(|l| (d, l)));
        pairs.flat_map(|(division, lengths)| Surfaces::ALL.map(|surfaces| Segments { surfaces, division, lengths }))
    }

    fn conditions(self) -> impl Iterator<Item = (String, bool)> {
        let surfaces = Surfaces::ALL.into_iter().map(move |s| (s.condition().to_owned(), s == self.surfaces));
        let others = [
            ("divide_bricks".to_owned(), self.division == Division::Brick),
            ("nominal_lengths".to_owned(), self.lengths == Lengths::Nominal),
        ];
        surfaces.chain(others)
    }
}

impl Surfaces {
    /// All kinds.
    pub const ALL: [Surfaces; 4] =
        [Surfaces::Shells, Surfaces::TessellatedShells, Surfaces::ViewportPlanes, Surfaces::ObjectPlanes];

    const fn condition(self) -> &'static str {
        match self {
            Surfaces::Shells => "shells",
            Surfaces::TessellatedShells => "tessellated_shells",
            Surfaces::ViewportPlanes => "viewport_planes",
            Surfaces::ObjectPlanes => "object_planes",
        }
    }
}

/// The features for which a ray asks the field.
const READS_FIELD: [Feature; 4] = [Feature::TransferLookup, Feature::SkipEmpty, Feature::SkipDark, Feature::Light];

/// How the knots of a transfer function are searched.
///
/// Unrolled: on lavapipe that is 1.3 to 1.4 times as fast as a loop over four knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum KnotSearch {
    /// So many halvings, at most [`KnotSearch::MOST_HALVINGS`]; 0 where there is one knot.
    Unrolled(u8),
    /// From where a [`KnotTable`] says on, so many knots further, at most [`KnotSearch::MOST_STEPS`]; of as many knots as unrolled halvings
    /// tell apart.
    Table(u8),
    /// A loop, for more knots.
    Loop,
}

impl KnotSearch {
    /// Most halvings that are unrolled: they tell 256 knots apart.
    pub const MOST_HALVINGS: u8 = 8;

    /// Most steps from where a table says.
    pub const MOST_STEPS: u8 = 3;

    /// The search that tells `n_knots` apart, wherever they lie.
    pub fn among(n_knots: usize) -> KnotSearch {
        let halvings = n_knots.max(1).next_power_of_two().trailing_zeros() as u8;
        if halvings <= KnotSearch::MOST_HALVINGS { KnotSearch::Unrolled(halvings) } else { KnotSearch::Loop }
    }

    /// The search that a plan needs.
    pub fn of(plan: &FramePlan) -> KnotSearch {
        match plan.features().contains(Feature::TransferLookup) {
            true => KnotSearch::of_transfer(plan.transfer(), plan.value_scale()),
            false => KnotSearch::Unrolled(0),
        }
    }

    /// The search that reads fewest knots.
    fn of_transfer(transfer: &TransferFunction, values: ValueScale) -> KnotSearch {
        let halving = KnotSearch::among(transfer.knots().len());
        let KnotSearch::Unrolled(halvings) = halving else { return halving };
        let steps = KnotTable::of(transfer, values).most_steps();
        // The table itself is read once.
        let is_shorter = !halving.is_of_few() && steps + 1 < u32::from(halvings);
        if is_shorter && steps <= u32::from(KnotSearch::MOST_STEPS) { KnotSearch::Table(steps as u8) } else { halving }
    }

    /// All searches.
    pub fn all() -> impl Iterator<Item = KnotSearch> {
        let tables = (1..=KnotSearch::MOST_STEPS).map(KnotSearch::Table);
        (0..=KnotSearch::MOST_HALVINGS).map(KnotSearch::Unrolled).chain(tables).chain([KnotSearch::Loop])
    }

    /// Whether shaders compare with every knot.
    fn is_of_few(self) -> bool {
        matches!(self, KnotSearch::Unrolled(halvings) if 1 << halvings <= FEW_KNOTS)
    }

    fn conditions(self) -> impl Iterator<Item = (String, bool)> {
        let unrolls = move |n| matches!(self, KnotSearch::Unrolled(halvings) if n <= halvings);
        let halvings = (1..=KnotSearch::MOST_HALVINGS).map(move |n| (format!("halvings_{n}"), unrolls(n)));
        let goes_on = move |n| matches!(self, KnotSearch::Table(steps) if n <= steps);
        let steps = (2..=KnotSearch::MOST_STEPS).map(move |n| (format!("steps_{n}"), goes_on(n)));
        let kinds = [("knot_table", matches!(self, KnotSearch::Table(_))), ("many_knots", self == KnotSearch::Loop)];
        halvings.chain(steps).chain(kinds.map(|(name, holds)| (name.to_owned(), holds)))
    }
}

/// The task of a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Entry {
    /// Renders the picture by casting rays.
    March,
    /// Renders the picture by shading the polygons of proxy geometry: a vertex and a fragment shader.
    Proxy(Slices),
    /// Evaluates one function on a list of inputs.
    Evaluate(ShaderFunction),
    /// Reads textures and does nothing else, to be timed ([`brickfield_frame::Probe`]).
    Probe(Fetch),
    /// Unpacks the samples of slots ([`crate::Decoding`]).
    Decode,
    /// Renders the picture of a mesh ([`brickfield_frame::MeshPlan`]): a vertex and a fragment shader.
    Mesh(MeshShading),
    /// Renders the picture of curvilinear cells ([`brickfield_frame::CellsPlan`]) by walking from cell to cell.
    Cells(CellsShading),
}

impl Entry {
    /// All kinds of entries, those of functions and fetches for each of them.
    pub fn all() -> impl Iterator<Item = Entry> {
        let functions = ShaderFunction::ALL.into_iter().map(Entry::Evaluate);
        [Entry::March, Entry::Proxy(Slices::Together), Entry::Proxy(Slices::InteriorsFirst)]
            .into_iter()
            .chain(functions)
            .chain(Fetch::ALL.map(Entry::Probe))
            .chain([Entry::Decode])
            .chain(MeshShading::all().map(Entry::Mesh))
            .chain(CellsShading::all().map(Entry::Cells))
    }

    /// The names of the entry points: one for compute, or one for vertices and one for fragments.
    pub const fn entry_points(self) -> &'static [&'static str] {
        match self {
            Entry::March => &["march"],
            Entry::Proxy(_) => &["project", "shade"],
            Entry::Evaluate(_) => &["evaluate"],
            Entry::Probe(Fetch::Filtered) => &["filtered"],
            Entry::Probe(Fetch::Gathered) => &["gathered"],
            Entry::Decode => &["decode"],
            Entry::Mesh(_) => &["place", "paint"],
            Entry::Cells(_) => &["march_cells"],
        }
    }

    /// The module that they are in.
    pub(crate) const fn module(self) -> &'static str {
        match self {
            Entry::March => "march",
            Entry::Proxy(_) => "proxy",
            Entry::Evaluate(_) => "evaluate",
            Entry::Probe(_) => "probe",
            Entry::Decode => "decode",
            Entry::Mesh(_) => "mesh",
            Entry::Cells(_) => "cells",
        }
    }
}

impl Variant {
    /// A shader for short rays between shells, through bricks whose samples are no 16-bit integers, with two to four knots.
    pub fn new(features: FeatureSet, rule: QuadratureRule, entry: Entry) -> Variant {
        Variant {
            features,
            field: FieldKind::default(),
            rule,
            segments: Segments::default(),
            search: KnotSearch::Unrolled(2),
            long_rays: false,
            batch: false,
            integer_samples: false,
            entry,
        }
    }

    /// The shader that replays `plan`.
    pub fn of(plan: &FramePlan, entry: Entry) -> Variant {
        Variant {
            features: plan.features(),
            field: FieldKind::of(plan),
            rule: plan.sampling().rule(),
            segments: Segments::of(plan),
            search: KnotSearch::of(plan),
            long_rays: entry == Entry::March && has_long_rays(plan),
            batch: entry == Entry::March && plan.is_batch(),
            integer_samples: plan.reads_integers(),
            entry,
        }
    }

    /// The shader that draws the same picture, and those of other transfer functions, levels and empty blocks besides.
    ///
    /// What needs data of its own (dark regions, light, gradients, spreads) is as in `self`: a shader has no binding for data that a
    /// plan does not bring. Of batches, bricks are lent in general.
    #[must_use]
    pub fn general(self) -> Variant {
        let mut features =
            self.features.with(Feature::SkipEmpty).with(Feature::MultiLevel).with(Feature::TransferLookup);
        if matches!(self.field, FieldKind::Blocks(_) | FieldKind::Dense) {
            features = features.with(Feature::ShortBlocks);
        }
        if self.field == FieldKind::Placed && self.features.contains(Feature::SkipDark) {
            features = features.with(Feature::Lent);
        }
        let search = match self.search {
            KnotSearch::Unrolled(_) | KnotSearch::Table(_) => KnotSearch::Unrolled(KnotSearch::MOST_HALVINGS),
            KnotSearch::Loop => KnotSearch::Loop,
        };
        match self.entry {
            Entry::March | Entry::Proxy(_) => Variant { features, search, ..self },
            Entry::Evaluate(_) | Entry::Probe(_) | Entry::Decode | Entry::Mesh(_) | Entry::Cells(_) => self,
        }
    }

    /// The modules that are compiled, one for each path that several modules share.
    pub(crate) fn chosen_modules(self) -> [&'static str; 3] {
        let integrate = match self.segments.division {
            Division::Brick => "integrate/bricks",
            Division::Ray if self.reads_field() => "integrate/rays",
            Division::Ray => "integrate/constant",
        };
        let gradient = match self.features.contains(Feature::StoredGradients) {
            true => "gradient/stored",
            false => "gradient/central",
        };
        [self.field.module(), integrate, gradient]
    }

    fn reads_field(self) -> bool {
        READS_FIELD.into_iter().any(|f| self.features.contains(f)) || self.segments.division == Division::Brick
    }

    /// Whether nodes have spreads: only samples of flat blocks do, and the rule looks at nodes alone.
    fn is_prefiltered(self) -> bool {
        let is_classified =
            self.features.contains(Feature::TransferLookup) && self.rule != QuadratureRule::PreIntegrated;
        let has_blocks = matches!(self.field, FieldKind::Blocks(_)) && !matches!(self.entry, Entry::Cells(_));
        self.features.contains(Feature::Prefiltered) && has_blocks && is_classified
    }

    /// The shader that reads textures one way. It has nothing of a plan's.
    pub fn probe(fetch: Fetch) -> Variant {
        let features = match fetch {
            Fetch::Filtered => FeatureSet::default().with(Feature::HardwareFilter),
            Fetch::Gathered => FeatureSet::default(),
        };
        Variant::new(features, QuadratureRule::MidpointExponential, Entry::Probe(fetch))
    }

    /// The shader that unpacks samples. It has nothing of a plan's.
    pub fn decode() -> Variant {
        Variant::new(FeatureSet::default(), QuadratureRule::MidpointExponential, Entry::Decode)
    }

    /// The shader that draws a mesh. It has nothing of a volume's.
    pub fn mesh(shading: MeshShading) -> Variant {
        Variant::new(FeatureSet::default(), QuadratureRule::MidpointExponential, Entry::Mesh(shading))
    }

    /// The shader that draws a picture of cells.
    pub fn cells(plan: &CellsPlan) -> Variant {
        let n_knots = plan.transfer().knots().len();
        let needed = [
            (Feature::TransferLookup, n_knots > 1),
            (Feature::EarlyTermination, plan.sampling().transmittance_floor() > 0.0),
        ];
        let features = needed.into_iter().filter_map(|(feature, is_needed)| is_needed.then_some(feature)).collect();
        let variant = Variant::new(features, plan.sampling().rule(), Entry::Cells(plan.shading()));
        Variant { search: KnotSearch::of_transfer(plan.transfer(), plan.value_scale()), ..variant }
    }

    /// The conditions (`@if(name)`) that hold.
    pub(crate) fn conditions(self) -> Vec<(String, bool)> {
        let has = |f| self.features.contains(f);
        let holds = |f| match f {
            Feature::Prefiltered => has(f) && self.is_prefiltered(),
            Feature::Lent => has(f) && self.field == FieldKind::Placed,
            _ => has(f),
        };
        let features = Feature::ALL.into_iter().map(|f| (f.name().to_owned(), holds(f)));
        let rules = QuadratureRule::ALL.into_iter().map(|r| (condition_of_rule(r), r == self.rule));
        let evaluated = |f| self.entry == Entry::Evaluate(f);
        let functions = ShaderFunction::ALL.into_iter().map(|f| (format!("evaluate_{}", f.name()), evaluated(f)));
        let two_nodes = self.rule.nodes().len() > 1;
        let (shading, cells) = match self.entry {
            Entry::Mesh(shading) => (shading, CellsShading::default()),
            Entry::Cells(cells) => (MeshShading::default(), cells),
            _ => Default::default(),
        };
        let derived = [
            ("one_node", !two_nodes),
            ("two_nodes", two_nodes),
            ("reads_field", self.reads_field()),
            ("lattice_origin", self.field != FieldKind::Bricks),
            ("wide_blocks", has(Feature::MultiLevel) || has(Feature::SkipEmpty) || self.field != FieldKind::Bricks),
            ("blend", self.field.scheme().is_some()),
            ("interiors_first", self.entry == Entry::Proxy(Slices::InteriorsFirst)),
            ("dense", self.field == FieldKind::Dense),
            ("flat_blocks", matches!(self.field, FieldKind::Blocks(_) | FieldKind::Dense)),
            ("few_knots", has(Feature::TransferLookup) && self.search.is_of_few()),
            ("long_rays", self.long_rays),
            ("rays_go_on", self.long_rays || self.batch),
            ("integer_samples", self.integer_samples),
            ("gouraud", shading.coloring == Coloring::Gouraud),
            ("mesh_light", shading.lit),
            ("mesh_normals", shading.has_normals),
            ("mesh_lines", shading.has_lines),
            ("cell_voids", cells.has_voids),
            ("cell_ends", cells.has_ends),
        ];
        let derived = derived.into_iter().map(|(name, holds)| (name.to_owned(), holds));
        let scheme = |s: Interblock| (s.name().replace('-', "_"), self.field.scheme() == Some(s));
        let segments = self.segments.conditions().chain(Interblock::ALL.map(scheme));
        features.chain(rules).chain(segments).chain(functions).chain(self.search.conditions()).chain(derived).collect()
    }
}

fn condition_of_rule(rule: QuadratureRule) -> String {
    format!("rule_{}", rule.name().replace('-', "_"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Knot;
    use brickfield_frame::Decode;

    #[test]
    fn a_search_tells_its_knots_apart() {
        let expected = [(0, 0), (1, 0), (2, 1), (3, 2), (4, 2), (5, 3), (256, 8)];
        assert!(expected.iter().all(|(n, halvings)| KnotSearch::among(*n) == KnotSearch::Unrolled(*halvings)));
        assert_eq!(KnotSearch::among(257), KnotSearch::Loop);
    }

    #[test]
    fn a_table_is_taken_where_it_reads_fewer_knots() {
        let search = |n: u32, value: fn(u32) -> f64| {
            let knot = |i| Knot { value: value(i), extinction: 0.0, color: [0.0; 3] };
            let transfer = TransferFunction::new((0..n).map(knot).collect()).unwrap();
            KnotSearch::of_transfer(&transfer, ValueScale::of(&transfer, Decode { scale: 1.0, offset: 0.0 }))
        };
        assert_eq!(search(8, f64::from), KnotSearch::Unrolled(3));
        assert_eq!((search(9, f64::from), search(256, f64::from)), (KnotSearch::Table(1), KnotSearch::Table(1)));
        assert_eq!(search(17, |i| f64::from(if i == 8 { 7 } else { i })), KnotSearch::Table(2));
        // Four knots in the first bin; more than are unrolled.
        assert_eq!(search(40, |i| f64::from(i).powi(2)), KnotSearch::Unrolled(6));
        assert_eq!(search(257, f64::from), KnotSearch::Loop);
    }
}
