//! Laws of the client, over real sockets.

#![expect(clippy::single_range_in_vec_init, reason = "a list of ranges may have one")]

mod bad;
mod faults;
mod folder;
mod scripted;
