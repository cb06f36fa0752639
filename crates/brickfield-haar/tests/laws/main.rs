//! Laws of the codec, on random and extreme bricks.

mod bands;
mod bricks;
mod codec;
mod damage;
mod format;
