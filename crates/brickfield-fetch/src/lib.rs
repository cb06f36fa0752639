#![doc = include_str!("../README.md")]

mod arrived;
mod cache;
mod client;
mod error;
mod location;
mod options;
mod pieces;
mod request;
mod seen;
mod transfer;
mod version;
mod web;

pub use arrived::{Arrived, ArrivedError, NotArrived};
pub use client::{Client, FetchedCounts};
pub use error::FetchError;
pub use options::FetchOptions;
pub use request::Request;
