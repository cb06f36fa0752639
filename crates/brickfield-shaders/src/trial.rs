//! Which of two shaders is quicker on a device.

/// Two shaders of one picture take turns from frame to frame until one is seen to be quicker.
///
/// Frames of a session differ little from one to the next; of each pair of turns the order is turned round, so that a slow change favours neither.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trial {
    /// Milliseconds of frames: the variant's own shader, the general one.
    ms: [Vec<f64>; 2],
    /// Whether each has drawn its first frame, which does not count: drivers finish compiling in it.
    has_begun: [bool; 2],
}

/// Pairs of turns after which the smaller median decides.
const MOST_PAIRS: usize = 5;
/// Medians that differ by this factor decide at once.
const CLEAR: f64 = 1.25;

impl Trial {
    /// Whether the general shader draws the next frame.
    pub(crate) fn general_is_next(&self) -> bool {
        self.general_is_quicker().unwrap_or_else(|| {
            let n_turns =
                self.ms.iter().map(Vec::len).sum::<usize>() + self.has_begun.iter().filter(|begun| **begun).count();
            matches!(n_turns % 4, 1 | 2)
        })
    }

    /// Notes how long a frame took.
    pub(crate) fn note(&mut self, is_general: bool, ms: f64) {
        let which = usize::from(is_general);
        if self.general_is_quicker().is_some() {
            return;
        }
        match self.has_begun[which] {
            true => self.ms[which].push(ms),
            false => self.has_begun[which] = true,
        }
    }

    /// The verdict, when there is one. The own shader stays where both are equal.
    fn general_is_quicker(&self) -> Option<bool> {
        let [own, general] = &self.ms;
        if own.is_empty() || own.len() != general.len() {
            return None;
        }
        let [own_ms, general_ms] = [median(own), median(general)];
        let is_clear = own_ms.max(general_ms) >= CLEAR * own_ms.min(general_ms);
        (is_clear || own.len() >= MOST_PAIRS).then_some(general_ms < own_ms)
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
    (low + high) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Who draws so many frames; frame `n` takes `ms(n, is_general)`.
    fn turns(n_frames: usize, ms: impl Fn(usize, bool) -> f64) -> (Trial, Vec<bool>) {
        let mut trial = Trial::default();
        let drawn = (0..n_frames).map(|n| {
            let is_general = trial.general_is_next();
            trial.note(is_general, ms(n, is_general));
            is_general
        });
        let drawn = drawn.collect();
        (trial, drawn)
    }

    #[test]
    fn the_quicker_one_stays() {
        for general_ms in [5.0, 9.5, 10.0, 10.5, 40.0] {
            let (trial, drawn) = turns(40, |_, is_general| if is_general { general_ms } else { 10.0 });
            let expected = general_ms < 10.0;
            assert_eq!(trial.general_is_quicker(), Some(expected), "{general_ms}");
            assert!(drawn[12..].iter().all(|is_general| *is_general == expected));
        }
    }

    #[test]
    fn a_slow_shader_has_two_turns() {
        let (_, drawn) = turns(40, |_, is_general| if is_general { 40.0 } else { 10.0 });
        assert_eq!(drawn.iter().filter(|is_general| **is_general).count(), 2);
    }

    #[test]
    fn neither_the_first_frame_of_each_nor_a_slow_drift_decides() {
        let first = |n: usize| if n < 2 { 500.0 } else { 0.0 };
        let (trial, _) = turns(40, |n, is_general| first(n) + n as f64 + if is_general { 100.0 } else { 102.0 });
        assert_eq!(trial.general_is_quicker(), Some(true));
    }
}
