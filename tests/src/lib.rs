//! How Brickfield is held to its numbers: analytic volumes, metrics, comparisons against the f64 answer, and reports.
//!
//! Unpublished. `compare` (binary) renders a scene on every backend and reports error against run time; `conformance` holds
//! every backend to the f64 answer, and its own cases to mutants; `orders` prints observed orders of accuracy; `speed` times; `frames`
//! times steady frames of a file; `peers` holds Brickfield next to other renderers; `gpu` measures a graphics card, alone. Whatever is timed is timed by [`turns`].

pub mod codecs;
pub mod compare;
pub mod conformance;
pub mod frames;
pub mod gpu;
pub mod lamar;
pub mod left_out;
pub mod ljung;
mod memory;
pub mod metrics;
pub mod orders;
pub mod paper;
pub mod peers;
pub mod report;
pub mod saladi;
pub mod tong;
pub mod turns;
pub mod volumes;
pub mod wynn;
