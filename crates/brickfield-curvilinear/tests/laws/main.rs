//! What the hierarchy, selections and meshes must keep to, on generated grids.

mod frame_rate;
mod grids;
mod layout;
mod mesh;
mod oct_tree;
mod octree;
mod select;
mod tree;
mod walk;
