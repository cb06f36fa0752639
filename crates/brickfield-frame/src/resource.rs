//! The buffers, textures and samplers of shaders, by name.

use std::borrow::Cow;

use crate::mesh::color_knots;
use crate::{CellsPlan, Chunked, FramePlan, FrameUniforms, KnotUniform, LightUniform, MeshPlan, MeshUniforms, Slots};

/// A buffer, texture or sampler, by the name that it has in shaders (`frame.wesl`).
///
/// To add one that a plan brings: a name here, its content in [`FramePlan::content`], its declaration in the shaders. Backends bind
/// whatever a shader names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Resource {
    /// The frame's numbers ([`FrameUniforms`](crate::FrameUniforms)).
    Frame,
    /// The samples of all slots: a 3-D texture; in exact mode layers, one for each z ([`TextureLayout`](crate::TextureLayout)).
    Atlas,
    /// How the atlas is filtered: linearly, clamped to the edge.
    AtlasSampler,
    /// How texels of layers are gathered: as they are, clamped to the edge.
    NearestSampler,
    /// The packed entries of the index.
    Index,
    /// Where each slot's samples lie, for slots of several sizes.
    Places,
    /// The level of each flat block, and where its samples lie.
    Blocks,
    /// The spreads of flat blocks' samples, each at its sample's texel, a texture like the atlas.
    Spreads,
    /// For each flat block that is one sample, its spread.
    OneSpreads,
    /// For each flat block, its least and its greatest voxel.
    Ranges,
    /// The gradients of flat blocks' samples, each at its sample's texel, a texture like the atlas.
    Gradients,
    /// For each flat block that is one sample, its gradient.
    OneGradients,
    /// The transfer function's knots.
    Knots,
    /// The first [`FEW_KNOTS`](crate::FEW_KNOTS) of them.
    FewKnots,
    /// The light on surfaces ([`LightUniform`]).
    Light,
    /// The picture that rays are stored to.
    Picture,
    /// The inputs of an evaluated function.
    Inputs,
    /// The outputs of an evaluated function.
    Outputs,
    /// The emission and depth that earlier passes saw of each ray.
    SeenBefore,
    /// Distances of macrocells, negative for visible ones ([`Occupancy`](crate::Occupancy)).
    Occupancy,
    /// For each slot, the box beside which its block is dark ([`KeptBoxes`](crate::KeptBoxes)).
    Kept,
    /// For each tile of pixels, the segments in which its rays may see something ([`Beams`](crate::Beams)).
    Beams,
    /// The blocks that polygons are clipped to ([`ProxyGeometry`](crate::ProxyGeometry)).
    Drawn,
    /// The planes of the facets of tessellated shells.
    Facets,
    /// The numbers of a probe ([`ProbeUniforms`](crate::ProbeUniforms)).
    Probe,
    /// The means of a probe's rays.
    Means,
    /// The task of a device that unpacks samples ([`DecodingUniforms`](crate::DecodingUniforms)).
    Decoding,
    /// The packed slots ([`PackedUniform`](crate::PackedUniform)).
    PackedBricks,
    /// The words of packed slots ([`PackedSamples::words`](crate::PackedSamples::words)).
    PackedWords,
    /// The coefficients of packed slots, and then their values.
    Coefficients,
    /// The texels of packed slots, on their way to the atlas.
    Texels,
    /// The numbers of a mesh's picture ([`MeshUniforms`](crate::MeshUniforms)).
    MeshView,
    /// The vertices of a mesh ([`MeshVertex`](crate::MeshVertex)).
    Vertices,
    /// The triangles of a mesh ([`MeshTriangle`](crate::MeshTriangle)).
    Triangles,
    /// The knots of a mesh's colour map.
    Colors,
    /// The nodes of curvilinear cells ([`CellNode`](crate::CellNode)).
    Nodes,
    /// The faces between a cell and nothing ([`CellFace`](crate::CellFace)).
    Faces,
    /// The boxes around faces ([`FaceBox`](crate::FaceBox)).
    Boxes,
    /// A bit for each cell that is left out.
    Voids,
    /// For each pixel, the colour and the distance of the surface that its ray through cells ends at.
    Ends,
}

/// The data that a plan brings for a resource.
pub enum Content<'a> {
    /// Numbers of this frame, brought with every frame.
    Bytes(Cow<'a, [u8]>),
    /// A list that frames share: chunks that a device holds are not brought again.
    Chunks(&'a dyn Chunked),
    /// The samples of slots as a texture: slots that a device holds are not brought again.
    Texture(&'a Slots),
}

impl Resource {
    /// All resources.
    pub const ALL: [Resource; 40] = [
        Resource::Frame,
        Resource::Atlas,
        Resource::AtlasSampler,
        Resource::NearestSampler,
        Resource::Index,
        Resource::Places,
        Resource::Blocks,
        Resource::Spreads,
        Resource::OneSpreads,
        Resource::Ranges,
        Resource::Gradients,
        Resource::OneGradients,
        Resource::Knots,
        Resource::FewKnots,
        Resource::Light,
        Resource::Picture,
        Resource::Inputs,
        Resource::Outputs,
        Resource::SeenBefore,
        Resource::Occupancy,
        Resource::Kept,
        Resource::Beams,
        Resource::Drawn,
        Resource::Facets,
        Resource::Probe,
        Resource::Means,
        Resource::Decoding,
        Resource::PackedBricks,
        Resource::PackedWords,
        Resource::Coefficients,
        Resource::Texels,
        Resource::MeshView,
        Resource::Vertices,
        Resource::Triangles,
        Resource::Colors,
        Resource::Nodes,
        Resource::Faces,
        Resource::Boxes,
        Resource::Voids,
        Resource::Ends,
    ];

    /// The name in shaders and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Resource::Frame => "frame_block",
            Resource::Atlas => "atlas",
            Resource::AtlasSampler => "atlas_sampler",
            Resource::NearestSampler => "nearest_sampler",
            Resource::Index => "index",
            Resource::Places => "places",
            Resource::Blocks => "blocks",
            Resource::Spreads => "spreads",
            Resource::OneSpreads => "one_spreads",
            Resource::Ranges => "ranges",
            Resource::Gradients => "gradients",
            Resource::OneGradients => "one_gradients",
            Resource::Knots => "knots",
            Resource::FewKnots => "knots_block",
            Resource::Light => "light",
            Resource::Picture => "picture",
            Resource::Inputs => "inputs",
            Resource::Outputs => "outputs",
            Resource::SeenBefore => "seen_before",
            Resource::Occupancy => "occupancy",
            Resource::Kept => "kept",
            Resource::Beams => "beams",
            Resource::Drawn => "drawn",
            Resource::Facets => "facets",
            Resource::Probe => "probe",
            Resource::Means => "means",
            Resource::Decoding => "decoding",
            Resource::PackedBricks => "packed_bricks",
            Resource::PackedWords => "packed_words",
            Resource::Coefficients => "coefficients",
            Resource::Texels => "texels",
            Resource::MeshView => "mesh_view",
            Resource::Vertices => "vertices",
            Resource::Triangles => "triangles",
            Resource::Colors => "colors",
            Resource::Nodes => "nodes",
            Resource::Faces => "faces",
            Resource::Boxes => "boxes",
            Resource::Voids => "voids",
            Resource::Ends => "ends",
        }
    }

    /// Whether shaders read it as a uniform block; other buffers are storage.
    pub const fn is_uniform(self) -> bool {
        matches!(self, Resource::Frame | Resource::FewKnots | Resource::Decoding | Resource::MeshView)
    }

    /// The resource of a name.
    pub fn of_name(name: &str) -> Option<Resource> {
        Resource::ALL.into_iter().find(|resource| resource.name() == name)
    }
}

impl FramePlan {
    /// The content of a resource; `None` if the plan does not have it, and for resources that backends fill themselves: the frame's
    /// numbers (they depend on the atlas and the pass), pictures, inputs and results.
    pub fn content(&self, resource: Resource) -> Option<Content<'_>> {
        let bytes = |bytes: &[u8]| Some(Content::Bytes(Cow::Owned(bytes.to_vec())));
        match resource {
            Resource::Atlas => Some(Content::Texture(self.field.slots())),
            Resource::Index => Some(Content::Chunks(&**self.field.index())),
            Resource::Places => self.field.slots().place_table().map(Content::Chunks),
            Resource::Blocks => self.field.slots().block_table().map(Content::Chunks),
            Resource::Spreads => self.spreads().map(|slots| Content::Texture(slots)),
            Resource::OneSpreads => self.spreads().and_then(|slots| slots.one_table()).map(Content::Chunks),
            Resource::Ranges => self.spreads().and(self.field.ranges()).map(|ranges| Content::Chunks(ranges.table())),
            Resource::Gradients => self.gradients().map(|slots| Content::Texture(slots)),
            Resource::OneGradients => self.gradients().and_then(|slots| slots.one_table()).map(Content::Chunks),
            Resource::Knots => bytes(bytemuck::cast_slice(&KnotUniform::of(self))),
            Resource::FewKnots => bytes(bytemuck::cast_slice(&KnotUniform::few(&KnotUniform::of(self)))),
            Resource::Light => LightUniform::of(self).and_then(|light| bytes(bytemuck::bytes_of(&light))),
            Resource::Occupancy => self.occupancy.as_ref().map(|occupancy| Content::Chunks(&**occupancy)),
            Resource::Kept => self.kept.as_ref().map(|kept| Content::Chunks(kept.table())),
            Resource::Beams => self.beams.as_ref().and_then(|beams| bytes(bytemuck::cast_slice(&beams.spans()))),
            Resource::Drawn => {
                let proxy = self.proxy.as_ref()?;
                Some(Content::Bytes(Cow::Borrowed(bytemuck::cast_slice(proxy.bricks()))))
            }
            Resource::Facets => bytes(bytemuck::cast_slice(&self.rays.facet_planes())),
            Resource::Frame
            | Resource::AtlasSampler
            | Resource::NearestSampler
            | Resource::Picture
            | Resource::Inputs
            | Resource::Outputs
            | Resource::SeenBefore
            | Resource::Probe
            | Resource::Means
            | Resource::Decoding
            | Resource::PackedBricks
            | Resource::PackedWords
            | Resource::Coefficients
            | Resource::Texels
            | Resource::MeshView
            | Resource::Vertices
            | Resource::Triangles
            | Resource::Colors
            | Resource::Nodes
            | Resource::Faces
            | Resource::Boxes
            | Resource::Voids
            | Resource::Ends => None,
        }
    }
}

impl MeshPlan {
    /// The content of a resource; `None` if meshes do not have it.
    pub fn content(&self, resource: Resource) -> Option<Content<'_>> {
        let bytes = |bytes: &[u8]| Some(Content::Bytes(Cow::Owned(bytes.to_vec())));
        match resource {
            Resource::MeshView => bytes(bytemuck::bytes_of(&MeshUniforms::of(self))),
            Resource::Vertices => Some(Content::Chunks(self.mesh().vertex_table())),
            Resource::Triangles => Some(Content::Chunks(self.mesh().triangle_table())),
            Resource::Colors => bytes(bytemuck::cast_slice(&color_knots(self))),
            _ => None,
        }
    }
}

impl CellsPlan {
    /// The content of a resource; `None` if cells do not have it.
    pub fn content(&self, resource: Resource) -> Option<Content<'_>> {
        let bytes = |bytes: &[u8]| Some(Content::Bytes(Cow::Owned(bytes.to_vec())));
        let cells = self.cells();
        match resource {
            Resource::Frame => bytes(bytemuck::bytes_of(&FrameUniforms::of_cells(self))),
            Resource::Knots => bytes(bytemuck::cast_slice(&KnotUniform::of_cells(self))),
            Resource::FewKnots => bytes(bytemuck::cast_slice(&KnotUniform::few(&KnotUniform::of_cells(self)))),
            Resource::Nodes => Some(Content::Chunks(cells.node_table())),
            Resource::Faces => Some(Content::Chunks(cells.face_table())),
            Resource::Boxes => Some(Content::Chunks(cells.box_table())),
            Resource::Voids => Some(Content::Chunks(cells.void_table())),
            Resource::Ends => {
                let ends = self.ends()?;
                bytes(bytemuck::cast_slice(&ends))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        for resource in Resource::ALL {
            assert_eq!(Resource::of_name(resource.name()), Some(resource));
        }
        assert_eq!(Resource::of_name("nothing"), None);
    }
}
