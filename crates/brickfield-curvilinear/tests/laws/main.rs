//! What the hierarchy, selections and meshes must keep to, on generated grids.

mod grids;
mod layout;
mod tree;
