//! Colours that evenly spaced values may step over.

use brickfield_core::glam::Vec4;

/// Where a list of colours leaves the colours at both ends of a window and comes back to them.
///
/// ```text
/// colour |      /\              spacing:  .       .  steps over the peak
///        |_____/  \_____                  . . . . .  does not
///        +------------------ place
/// ```
///
/// Windows are 2, 4, 8 ... places wide, each half over the next. A window has a bump if a part of it has one; or if a colour in it
/// lies outside of the box around the colours at its ends, by more than half of the window's greatest difference from `nothing`.
#[derive(Clone, Debug)]
pub(crate) struct Bumps {
    /// For windows of 2^(i + 1) places: how many of the first windows have a bump; one number more than windows.
    counts: Vec<Vec<u32>>,
}

impl Bumps {
    /// The bumps of 2^n + 1 colours; `nothing` is the colour of what nobody sees.
    pub(crate) fn new(colors: &[Vec4], nothing: Vec4) -> Bumps {
        let mut counts = Vec::new();
        let mut parts: Vec<Window> = colors.windows(2).map(|ends| Window::of_two(ends[0], ends[1], nothing)).collect();
        // The first parts follow each other; later ones lie half over each other.
        let mut distance = 1;
        let mut half = 1;
        while 2 * half < colors.len() {
            let n = (colors.len() - 1) / half - 1;
            let window = |i: usize| {
                let [low, high] = [&parts[i * distance], &parts[(i + 1) * distance]];
                low.and(high, &[colors[i * half], colors[(i + 2) * half]])
            };
            let windows: Vec<Window> = (0..n).map(window).collect();
            let so_far = windows.iter().scan(0, |n, window| {
                *n += u32::from(window.has_bump);
                Some(*n)
            });
            counts.push(std::iter::once(0).chain(so_far).collect());
            (parts, distance, half) = (windows, 2, 2 * half);
        }
        Bumps { counts }
    }

    /// Whether a window of at most `spacing` places, rounded up to a power of two, has a bump and lies between two places.
    pub(crate) fn any(&self, first: f32, last: f32, spacing: f32) -> bool {
        let i = (spacing.max(2.0).log2().ceil() as usize - 1).min(self.counts.len() - 1);
        let (half, counts) = (1usize << i, &self.counts[i]);
        // A place between two colours depends on both.
        let start = (first as usize).div_ceil(half);
        let end = ((last.ceil() as usize) / half).saturating_sub(1).min(counts.len() - 1);
        start < end && counts[start] < counts[end]
    }
}

/// Colours of consecutive places.
struct Window {
    least: Vec4,
    greatest: Vec4,
    /// The greatest distance from nothing.
    reach: f32,
    has_bump: bool,
}

impl Window {
    fn of_two(a: Vec4, b: Vec4, nothing: Vec4) -> Window {
        let reach = a.distance(nothing).max(b.distance(nothing));
        Window { least: a.min(b), greatest: a.max(b), reach, has_bump: false }
    }

    /// Two halves with a place in common, and the colours at the ends of the whole.
    fn and(&self, other: &Window, ends: &[Vec4; 2]) -> Window {
        let (least, greatest) = (self.least.min(other.least), self.greatest.max(other.greatest));
        let reach = self.reach.max(other.reach);
        let below = ends[0].min(ends[1]) - least;
        let above = greatest - ends[0].max(ends[1]);
        let is_bump = below.max(above).length() > 0.5 * reach;
        Window { least, greatest, reach, has_bump: is_bump || self.has_bump || other.has_bump }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gray values over 65 places.
    fn bumps(gray: impl Fn(usize) -> f32) -> Bumps {
        let colors: Vec<Vec4> = (0..65).map(|i| Vec4::new(gray(i), 0.0, 0.0, 0.0)).collect();
        Bumps::new(&colors, Vec4::ZERO)
    }

    #[test]
    fn values_step_over_a_peak_that_is_narrower_than_their_spacing() {
        for center in (20..40).chain([60]) {
            let peak = bumps(|i| (1.0 - i.abs_diff(center) as f32 / 4.0).max(0.0));
            // Its base is 8 places wide.
            for (spacing, is_missed) in [(2.0, false), (4.0, false), (16.0, true)] {
                assert_eq!(peak.any(0.0, 64.0, spacing), is_missed, "{center} {spacing}");
            }
            assert!(!peak.any(0.0, center as f32 - 4.0, 16.0) && !peak.any(center as f32 + 4.0, 64.0, 16.0));
        }
    }

    #[test]
    fn slopes_steps_and_constants_have_no_bump() {
        for gray in [|i: usize| i as f32, |i| f32::from(u8::from(i > 30)), |_| 0.7, |_| 0.0] {
            for spacing in [1.0, 2.0, 7.0, 64.0, 1000.0] {
                assert!(!bumps(gray).any(0.0, 64.0, spacing));
            }
        }
    }

    #[test]
    fn a_dip_is_a_bump_and_one_of_a_sixth_is_none() {
        assert!(bumps(|i| 1.0 - f32::from(u8::from(i == 30))).any(0.0, 64.0, 2.0));
        assert!(!bumps(|i| 1.0 - f32::from(u8::from(i == 30)) / 6.0).any(0.0, 64.0, 64.0));
    }
}
