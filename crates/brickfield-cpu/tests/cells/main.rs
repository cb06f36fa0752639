//! Laws of pictures of curvilinear cells: closed forms, orders of accuracy, and both renderers against each other.

mod agreement;
mod closed_forms;
mod grids;
mod laws;
mod orders;
#[path = "../support/slope.rs"]
mod slope;
#[path = "../support/mod.rs"]
mod support;
