//! What trimming must never do, on random fields and transfer functions.

mod blended;
mod bricks;
mod field;
mod figures;
mod storage;
