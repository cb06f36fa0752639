//! Merging of trimmed bricks into texture chunks.

mod cluster;

use brickfield_core::glam::{UVec2, UVec3};
use brickfield_core::{Axes, BrickId, BrickLayout, BrickSide, Level};

use crate::stored::Part;
use crate::{Class, PackError, SampleBox, StoredBricks, TexelAccount, TrimmedBricks, brick_samples, pack_boxes};
use cluster::{Draft, Room, merge_row};

/// How trimmed bricks are merged (Tong et al. 1999, section 3.2.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MergeOptions {
    /// Bricks of a cluster along x and y; along z it has one.
    pub cluster: UVec2,
    /// Texels of the texture cache along x, y, z: it holds all chunks of a cluster at once.
    pub cache: UVec3,
    /// Which merge is tried first.
    pub first: FirstMerge,
    /// Whether bricks of neighbouring clusters are merged.
    pub between: BetweenClusters,
}

impl Default for MergeOptions {
    /// The paper's, for bricks of 64^3: clusters of 2 x 2 bricks, a cache of 128 x 128 x 64 texels, the horizontal merge first.
    fn default() -> MergeOptions {
        MergeOptions {
            cluster: UVec2::splat(2),
            cache: UVec3::new(128, 128, 64),
            first: FirstMerge::default(),
            between: BetweenClusters::default(),
        }
    }
}

impl MergeOptions {
    /// The paper's proportions for bricks of another size: a cache of a cluster's bricks.
    pub fn of_bricks(side: BrickSide) -> MergeOptions {
        let n = side.n_samples();
        MergeOptions { cache: UVec3::new(2 * n, 2 * n, n), ..MergeOptions::default() }
    }
}

/// The merge that is done as long as it is possible, before the other one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FirstMerge {
    /// Side by side along x: fewer chunks, more padding. The paper's platform loads long rows faster.
    #[default]
    Horizontal,
    /// One upon the other along z: no padding.
    Vertical,
}

/// What becomes of bricks that no brick of their own cluster was merged with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BetweenClusters {
    /// They stay alone.
    Apart,
    /// They are merged with such bricks of the next cluster along z: the chunk is stored once, and both clusters refer to it.
    #[default]
    AlongZ,
}

/// Why bricks cannot be merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum MergeError {
    #[error("a cluster has {} x {} bricks; it must have 1 to {limit}", cluster.x, cluster.y)]
    Cluster { cluster: UVec2, limit: u32 },
    #[error("a cluster takes {needed} texels along {axis}; the cache has {texels}")]
    Cache { axis: char, needed: u64, texels: u32 },
}

impl MergeOptions {
    /// The most bricks of a cluster: every pair of them is looked at.
    pub const MAX_CLUSTER: u32 = 256;

    fn check(&self, side: u32) -> Result<Room, MergeError> {
        let (cluster, limit) = (self.cluster, MergeOptions::MAX_CLUSTER);
        let n_bricks = u64::from(cluster.x) * u64::from(cluster.y);
        if !(1..=u64::from(limit)).contains(&n_bricks) {
            return Err(MergeError::Cluster { cluster, limit });
        }
        for (axis, n, texels) in
            [('x', cluster.x, self.cache.x), ('y', cluster.y, self.cache.y), ('z', 1, self.cache.z)]
        {
            let needed = u64::from(n) * u64::from(side);
            if needed > u64::from(texels) {
                return Err(MergeError::Cache { axis, needed, texels });
            }
        }
        Ok(Room::new(self.cache / side))
    }
}

/// A box of texels with the samples of some bricks (the paper's texture chunk).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureChunk {
    /// Texels along x, y, z: one or two sides of a brick, a side, and at most a side.
    pub n: UVec3,
    /// Its bricks, by [`BrickLayout::ordinal`].
    pub bricks: Vec<usize>,
}

/// Where a brick lies in its texture chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkPart {
    /// The number of the chunk.
    pub chunk: usize,
    /// The brick's first texel in it.
    pub texel: UVec3,
    /// The samples that are stored: trimmed along the trimming axis, whole along the others.
    pub samples: SampleBox,
    /// Which axis of space each axis of the texture runs along: the trimming axis is the texture's z.
    pub axes: Axes,
}

/// Trimmed bricks in texture chunks.
///
/// ```text
/// horizontal            vertical           vertical, upon a horizontal one
///                                              +-----+
///             +---+     +-----+                |  c  +-----+
/// +-----+     |   |     |  b  |                +-----+     |
/// |  a  |xxxxx| b |     +-----+                |  a  |  b  |      z
/// |     |     |   |     |  a  |                |     |     |      ^
/// +-----+-----+---+     +-----+                +-----+-----+      +-> x      x: padding
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MergedBricks {
    layout: BrickLayout,
    chunks: Vec<TextureChunk>,
    parts: Vec<Option<ChunkPart>>,
    n_clusters: UVec3,
    /// For each cluster, x fastest, the chunks that hold its bricks.
    clusters: Vec<Vec<usize>>,
}

/// Merges trimmed bricks into texture chunks.
///
/// Bricks are grouped into clusters of the same index along z. In each cluster, and then between clusters that follow each other along
/// z, the pair with the least difference of thickness is merged first; of equal ones, that of the first bricks.
///
/// Departures from the paper, where it does not say:
///
/// 1. A pile may have more than two bricks, as long as it is no higher than a brick.
/// 2. Chunks of a cluster, shared ones included, always have room in the cache together: a horizontal merge that would take it is not done.
///
/// # Errors
/// If a cluster has no brick or too many, or the cache does not hold a cluster.
pub fn merge_bricks(trimmed: &TrimmedBricks, options: &MergeOptions) -> Result<MergedBricks, MergeError> {
    let layout = *trimmed.layout();
    let side = layout.side().n_samples();
    let room = options.check(side)?;
    let alone: Vec<Option<Part>> = layout.bricks(Level(0)).map(|id| alone(trimmed, id)).collect();
    let mut merged = MergedBricks::without_chunks(layout, options.cluster);
    let n = merged.n_clusters;
    for (x, y) in (0..n.y).flat_map(|y| (0..n.x).map(move |x| (x, y))) {
        let clusters = (0..n.z).map(|z| merged.drafts(UVec3::new(x, y, z), options.cluster, &alone)).collect();
        for (z, draft) in merge_row(clusters, options, room, side) {
            merged.add_chunk(UVec3::new(x, y, z), &draft, &alone);
        }
    }
    Ok(merged)
}

/// What is stored of a brick, with its trimming axis along the texture's z; nothing of a white one.
pub(crate) fn alone(trimmed: &TrimmedBricks, id: BrickId) -> Option<Part> {
    let ordinal = trimmed.layout().ordinal(id);
    let (kept, n) = (trimmed.kept()[ordinal], brick_samples(trimmed.layout(), id).n);
    match trimmed.class(ordinal) {
        Class::White => None,
        Class::Black => Some(Part { samples: kept, axes: Axes::Xyz }),
        Class::Grey { trimming_axis } => {
            let mut samples = SampleBox::whole(n);
            samples.first[trimming_axis] = kept.first[trimming_axis];
            samples.n[trimming_axis] = kept.n[trimming_axis];
            Some(Part { samples, axes: [Axes::Zyx, Axes::Xzy, Axes::Xyz][trimming_axis] })
        }
    }
}

impl MergedBricks {
    fn without_chunks(layout: BrickLayout, cluster: UVec2) -> MergedBricks {
        let n_bricks = layout.n_bricks(Level(0));
        let n_clusters = UVec3::new(n_bricks.x.div_ceil(cluster.x), n_bricks.y.div_ceil(cluster.y), n_bricks.z);
        let n_clusters_total = n_clusters.to_array().into_iter().map(|n| n as usize).product();
        MergedBricks {
            layout,
            chunks: Vec::new(),
            parts: vec![None; layout.n_bricks_total(Level(0))],
            n_clusters,
            clusters: vec![Vec::new(); n_clusters_total],
        }
    }

    /// The bricks of a cluster, each on its own.
    fn drafts(&self, cluster: UVec3, n: UVec2, alone: &[Option<Part>]) -> Vec<Draft> {
        let first = UVec3::new(cluster.x * n.x, cluster.y * n.y, cluster.z);
        let end = (first + n.extend(1)).min(self.layout.n_bricks(Level(0)));
        let bricks = (first.y..end.y).flat_map(|y| (first.x..end.x).map(move |x| UVec3::new(x, y, first.z)));
        let ordinals = bricks.map(|coords| self.layout.ordinal(BrickId { level: Level(0), coords }));
        ordinals.filter_map(|i| Some(Draft::alone(i, alone[i]?.n().z))).collect()
    }

    /// Adds a chunk whose first cluster is `cluster`.
    fn add_chunk(&mut self, cluster: UVec3, draft: &Draft, alone: &[Option<Part>]) {
        let (side, chunk) = (self.layout.side().n_samples(), self.chunks.len());
        for (column, pile) in draft.columns.iter().enumerate() {
            let mut z = 0;
            for &brick in &pile.bricks {
                let texel = UVec3::new(column as u32 * side, 0, z);
                self.parts[brick] =
                    alone[brick].map(|Part { samples, axes }| ChunkPart { chunk, texel, samples, axes });
                z += alone[brick].map_or(0, |part| part.n().z);
            }
        }
        let n = UVec3::new(draft.columns.len() as u32 * side, side, draft.height());
        let bricks = draft.columns.iter().flat_map(|pile| pile.bricks.iter().copied()).collect();
        self.chunks.push(TextureChunk { n, bricks });
        for z in cluster.z..cluster.z + draft.n_clusters {
            let cluster = self.cluster_ordinal(UVec3 { z, ..cluster });
            self.clusters[cluster].push(chunk);
        }
    }

    /// Which bricks there are.
    pub fn layout(&self) -> &BrickLayout {
        &self.layout
    }

    /// The chunks, each stored once.
    pub fn chunks(&self) -> &[TextureChunk] {
        &self.chunks
    }

    /// Where each brick lies, by [`BrickLayout::ordinal`]; `None` of a white brick.
    pub fn parts(&self) -> &[Option<ChunkPart>] {
        &self.parts
    }

    /// Clusters along x, y, z.
    pub fn n_clusters(&self) -> UVec3 {
        self.n_clusters
    }

    /// The chunks that hold the bricks of a cluster: those that are in the cache together while it is drawn. A chunk of two clusters
    /// is among the chunks of both.
    ///
    /// # Panics
    /// If there is no such cluster.
    pub fn chunks_of(&self, cluster: UVec3) -> &[usize] {
        assert!(cluster.cmplt(self.n_clusters).all(), "cluster {cluster} of {}", self.n_clusters);
        &self.clusters[self.cluster_ordinal(cluster)]
    }

    fn cluster_ordinal(&self, cluster: UVec3) -> usize {
        let [x, y, z] = cluster.to_array().map(|i| i as usize);
        x + self.n_clusters.x as usize * (y + self.n_clusters.y as usize * z)
    }

    /// Texels of the trimmed bricks before they are merged: a box of side x side x thickness for each.
    pub fn before(&self) -> TexelAccount {
        let parts = || self.parts.iter().flatten();
        let area = u64::from(self.layout.side().n_samples()).pow(2);
        TexelAccount {
            n_boxes: parts().count(),
            n_texels: parts().map(|part| area * u64::from(part.n().z)).sum(),
            n_samples: parts().map(|part| part.samples.n_samples()).sum(),
        }
    }

    /// Texels of the chunks.
    pub fn after(&self) -> TexelAccount {
        TexelAccount {
            n_boxes: self.chunks.len(),
            n_texels: self.chunks.iter().map(|chunk| chunk.n.as_u64vec3().element_product()).sum(),
            n_samples: self.before().n_samples,
        }
    }

    /// The chunks in one texture of at most `most` texels along x, y, z.
    ///
    /// # Errors
    /// If the chunks have no room; a box's index is a chunk's number.
    pub fn store(&self, most: UVec3) -> Result<StoredBricks, PackError> {
        let boxes: Vec<UVec3> = self.chunks.iter().map(|chunk| chunk.n).collect();
        let packed = pack_boxes(&boxes, most)?;
        Ok(StoredBricks::new(self.layout, packed.texels, |brick| {
            let part = self.parts[brick]?;
            Some((part.part(), packed.origins[part.chunk] + part.texel))
        }))
    }
}

impl ChunkPart {
    pub(crate) fn part(&self) -> Part {
        Part { samples: self.samples, axes: self.axes }
    }

    /// Samples along the axes of the texture; along z the thickness.
    pub fn n(&self) -> UVec3 {
        self.part().n()
    }
}
