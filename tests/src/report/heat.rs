//! The colour scale of difference pictures: logarithmic, one for all, so that they can be compared.

/// Differences at the dark and at the bright end of the scale.
pub const HEAT_RANGE: [f64; 2] = [1e-7, 1e-1];

/// From black over violet and orange to pale yellow, evenly spaced (8-bit sRGB).
const STOPS: [[u8; 3]; 7] =
    [[0, 0, 4], [43, 17, 94], [114, 31, 129], [182, 55, 122], [241, 96, 93], [254, 175, 119], [252, 253, 191]];

/// The colour (8-bit sRGB) of a difference; below and above [`HEAT_RANGE`] the scale's ends.
pub fn heat(difference: f64) -> [u8; 3] {
    let [low, high] = HEAT_RANGE.map(f64::log10);
    heat_of_share((difference.max(0.0).log10() - low) / (high - low))
}

/// The colour (8-bit sRGB) at a share of the scale, 0 at its dark end and 1 at its bright one.
pub fn heat_of_share(share: f64) -> [u8; 3] {
    let share = share.clamp(0.0, 1.0);
    let at = share * (STOPS.len() - 1) as f64;
    let i = (at as usize).min(STOPS.len() - 2);
    let mix =
        |c: usize| f64::from(STOPS[i][c]) + (at - i as f64) * (f64::from(STOPS[i + 1][c]) - f64::from(STOPS[i][c]));
    [0, 1, 2].map(|c| mix(c).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decade_is_a_stop() {
        assert_eq!([0.0, 1e-9, 1e-7].map(heat), [STOPS[0]; 3]);
        assert_eq!([heat(1e-4), heat(1e-1), heat(7.0)], [STOPS[3], STOPS[6], STOPS[6]]);
    }

    #[test]
    fn greater_differences_are_brighter() {
        let sum = |d: f64| heat(d).into_iter().map(u32::from).sum::<u32>();
        let sums: Vec<u32> = (0..=60).map(|i| sum(10f64.powf(-7.0 + f64::from(i) / 10.0))).collect();
        assert!(sums.windows(2).all(|w| w[0] < w[1]), "{sums:?}");
    }
}
