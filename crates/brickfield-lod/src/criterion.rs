//! When a brick is fine enough.

use brickfield_core::{BrickId, Level, WorldPos};

use crate::tile::Tile;

/// What a filter says to a brick (LaMar, Hamann and Joy 1999, section 4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Answer {
    /// Neither this brick nor those below it are needed.
    Ignore,
    /// The brick satisfies the filter: draw it.
    Render,
    /// The brick is too coarse: ask its children.
    Descend,
}

impl Answer {
    /// The answer of two filters that must both be satisfied.
    ///
    /// What one ignores is ignored; of the rest, what one finds too coarse is too coarse.
    pub fn and(self, other: Answer) -> Answer {
        match (self, other) {
            (Answer::Ignore, _) | (_, Answer::Ignore) => Answer::Ignore,
            (Answer::Descend, _) | (_, Answer::Descend) => Answer::Descend,
            (Answer::Render, Answer::Render) => Answer::Render,
        }
    }
}

/// When a brick is fine enough to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Criterion {
    /// Only level 0 is.
    FullResolution,
    /// This level is, and finer ones; the root always is.
    Uniform(Level),
    /// A brick is whose centre lies farther from the eye than `factor` times its diagonal, both in world units
    /// (LaMar, Hamann and Joy 1999, section 4.1: factor 1).
    ///
    /// A greater factor draws finer bricks; infinity and NaN draw level 0, 0 and less the root. The eye of an
    /// orthographic camera counts as the viewpoint, too.
    #[allow(missing_docs)]
    Distance { factor: f64 },
}

impl Criterion {
    /// Whether the brick satisfies the criterion: [`Answer::Render`] or [`Answer::Descend`], never ignore.
    pub(crate) fn judge(&self, id: BrickId, tile: impl FnOnce() -> Tile, eye: WorldPos) -> Answer {
        let is_fine_enough = match *self {
            Criterion::FullResolution => id.level == Level(0),
            Criterion::Uniform(level) => id.level <= level,
            Criterion::Distance { factor } => tile().is_farther(eye, factor),
        };
        if is_fine_enough { Answer::Render } else { Answer::Descend }
    }
}

impl Tile {
    /// Whether the centre is farther from `point` than `factor` diagonals.
    fn is_farther(&self, point: WorldPos, factor: f64) -> bool {
        self.center.0.distance(point.0) > factor * self.diagonal_world
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
