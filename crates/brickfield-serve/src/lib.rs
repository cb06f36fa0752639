#![doc = include_str!("../README.md")]

mod answer;
mod folder;
mod link;
mod options;
mod server;

pub use options::{Faults, Limits, ServeError, ServeOptions, Throttle};
pub use server::{ServedCounts, Server};
