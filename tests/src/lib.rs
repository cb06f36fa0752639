//! How Brickfield is held to its numbers: analytic volumes, metrics, comparisons against the f64 answer, and reports.
//!
//! Unpublished.

pub mod metrics;
pub mod report;
pub mod volumes;
