//! Laws of the server, over real sockets.

mod ask;
mod faults;
mod folder;
mod limits;
mod ranges;
