//! Segmentations of 3D Slicer: layers of labels, and the segments that lie in them.

use super::header::NrrdHeader;

/// The most segments that are looked for.
const MAX_SEGMENTS: usize = 10_000;

impl NrrdHeader {
    pub(super) fn is_segmentation(&self) -> bool {
        self.key("Segment0_ID").is_some()
    }
}

/// The names of the segments of each layer, if the file says which segment lies in which.
pub(super) fn layer_names(header: &NrrdHeader, n_layers: u64) -> Option<Vec<String>> {
    let mut layers = vec![Vec::new(); usize::try_from(n_layers).ok().filter(|n| *n <= MAX_SEGMENTS)?];
    for i in 0..MAX_SEGMENTS {
        let Some(id) = header.key(&format!("Segment{i}_ID")) else { break };
        let layer: usize = header.key(&format!("Segment{i}_Layer"))?.trim().parse().ok()?;
        let name = header.key(&format!("Segment{i}_Name")).unwrap_or(id);
        layers.get_mut(layer)?.push(name);
    }
    Some(layers.into_iter().map(|names| names.join(", ")).collect())
}
