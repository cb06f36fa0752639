//! The laws of the README, chunk by chunk.

mod chunks;
mod damage;
mod metadata;
mod round_trip;
