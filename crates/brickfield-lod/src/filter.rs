//! Filters: their answers to a tile, and how several make one.

use crate::Tile;

/// A filter's answer to a tile (LaMar, Hamann and Joy 1999, section 4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Answer {
    /// Neither this tile nor the tiles below it are needed.
    Ignore,
    /// The tile satisfies the filter: draw it.
    Render,
    /// The tile is too coarse: ask its children.
    Descend,
}

impl Answer {
    /// The answer of two filters that must both be satisfied.
    ///
    /// A tile that one ignores is ignored; any other tile that one finds too coarse is too coarse. Commutative, associative, and
    /// [`Answer::Render`] is its unit.
    pub fn and(self, other: Answer) -> Answer {
        match (self, other) {
            (Answer::Ignore, _) | (_, Answer::Ignore) => Answer::Ignore,
            (Answer::Descend, _) | (_, Answer::Descend) => Answer::Descend,
            (Answer::Render, Answer::Render) => Answer::Render,
        }
    }
}

/// Answers for tiles: the interface of a selection.
///
/// A closure `|tile: &Tile<'_>| -> Answer` is a filter, and so are a [`Frustum`](crate::Frustum) and a
/// [`Criterion`](crate::Criterion) in a view. [`and`](Filter::and) makes one of two.
pub trait Filter {
    /// Knowledge of a tile from the answer to its parent, which need not be found out again; `()` if there is none.
    /// The default is the knowledge of the root.
    type Known: Copy + Default;

    /// The answer to a tile, and the knowledge of its children.
    fn answer_knowing(&self, tile: &Tile<'_>, known: Self::Known) -> (Answer, Self::Known);

    /// The answer to a tile of whose ancestors nothing is known.
    fn answer(&self, tile: &Tile<'_>) -> Answer {
        self.answer_knowing(tile, Self::Known::default()).0
    }

    /// The filter that is satisfied where both are: [`Answer::and`] of the two.
    ///
    /// The second is not asked about tiles that the first ignores.
    fn and<F: Filter>(self, other: F) -> And<Self, F>
    where
        Self: Sized,
    {
        And(self, other)
    }
}

/// Two filters that must both be satisfied: the result of [`Filter::and`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct And<A, B>(A, B);

impl<F: Fn(&Tile<'_>) -> Answer> Filter for F {
    type Known = ();

    #[inline]
    fn answer_knowing(&self, tile: &Tile<'_>, (): ()) -> (Answer, ()) {
        (self(tile), ())
    }
}

impl<A: Filter, B: Filter> Filter for And<A, B> {
    type Known = (A::Known, B::Known);

    #[inline]
    fn answer_knowing(&self, tile: &Tile<'_>, (a, b): Self::Known) -> (Answer, Self::Known) {
        let (first, a) = self.0.answer_knowing(tile, a);
        if first == Answer::Ignore {
            return (first, (a, b));
        }
        let (second, b) = self.1.answer_knowing(tile, b);
        (first.and(second), (a, b))
    }
}

#[cfg(test)]
mod tests {
    use super::Answer::{self, *};

    #[test]
    fn and_is_commutative_associative_and_has_render_as_unit() {
        let all = [Ignore, Render, Descend];
        for a in all {
            assert_eq!(a.and(Render), a);
            for b in all {
                assert_eq!(a.and(b), b.and(a));
                assert!(all.iter().all(|&c| a.and(b).and(c) == a.and(Answer::and(b, c))));
            }
        }
    }
}
