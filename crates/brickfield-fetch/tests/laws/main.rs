//! Laws of the client, over real sockets.

mod bad;
mod faults;
mod folder;
mod scripted;
