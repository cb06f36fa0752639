//! What a backend holds copies of.

use std::sync::{Arc, Weak};

/// Which part of a plan a backend holds a copy of, told by identity: equal contents elsewhere are another part.
///
/// The part itself is not kept alive: the host's bricks may go while the device's stay.
#[derive(Debug)]
pub struct Held<T>(Weak<T>);

impl<T> Held<T> {
    /// Nothing.
    pub fn nothing() -> Held<T> {
        Held(Weak::new())
    }

    /// A copy of `part`.
    pub fn of(part: &Arc<T>) -> Held<T> {
        Held(Arc::downgrade(part))
    }

    /// Whether it is a copy of `part`, this very one.
    pub fn is(&self, part: &Arc<T>) -> bool {
        // An address in a `Weak` is not used again while the `Weak` lives.
        std::ptr::eq(self.0.as_ptr(), Arc::as_ptr(part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_very_part_is_held_even_after_it_is_gone() {
        let (a, b) = (Arc::new([1u8; 64]), Arc::new([1u8; 64]));
        let held = Held::of(&a);
        assert!(held.is(&a) && !held.is(&b) && !Held::nothing().is(&a));
        drop(a);
        // The address of what is gone is not given out again.
        assert!((0..100).map(|_| Arc::new([1u8; 64])).all(|new| !held.is(&new)));
    }
}
