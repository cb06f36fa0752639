//! Polygon budgets that keep to a frame time (Wynn et al. 1999, section 2.4).

/// A frame time to keep to, and the budgets that are allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTarget {
    seconds: f64,
    least: u32,
    most: u32,
}

/// One drawn frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct FrameTime {
    /// Polygons that were drawn: at most the budget, fewer where the view shows fewer.
    pub n_polygons: u32,
    pub seconds: f64,
}

/// Why there is no budget.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum FrameTimeError {
    #[error("a {what} of {seconds} seconds; it must be finite and above 0")]
    Seconds { what: &'static str, seconds: f64 },
    #[error("budgets from {least} to {most} polygons; the least must be at least 1, and at most the greatest")]
    Budgets { least: u32, most: u32 },
}

/// Feedback on the last frame time, as in the paper: the budget grows and shrinks with target / measured.
///
/// It takes every frame for one that used its budget. Where a view shows few polygons it raises the budget without need, and the next
/// full view takes far too long: [`PredictiveBudget`] does not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedbackBudget {
    target: FrameTarget,
    budget: f64,
}

/// A model of the frame time, fixed + per_polygon * n_polygons, fitted to the last frames: the budget is where the model meets the
/// target.
///
/// Old frames lose weight with each new one. Frames of about the same number of polygons tell nothing about the slope of the model: the
/// slope stays until frames differ, and only the fixed part follows. A frame far from the model scales the whole model, so that
/// frames before and after a change of speed are not mixed up; at most by a half where it was faster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictiveBudget {
    target: FrameTarget,
    budget: u32,
    frames: WeightedFrames,
    /// Seconds a polygon; `None` before the first frame.
    per_polygon: Option<f64>,
}

/// Sums over frames, the older the less.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
struct WeightedFrames {
    weight: f64,
    n: f64,
    n_squared: f64,
    seconds: f64,
    n_seconds: f64,
}

impl FrameTarget {
    /// # Errors
    /// A time that is not finite or not above 0; budgets without an order.
    pub fn new(seconds: f64, least: u32, most: u32) -> Result<FrameTarget, FrameTimeError> {
        check("frame time to keep to", seconds)?;
        if least == 0 || least > most {
            return Err(FrameTimeError::Budgets { least, most });
        }
        Ok(FrameTarget { seconds, least, most })
    }

    /// The time that a frame may take.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    fn limited(&self, budget: f64) -> f64 {
        budget.clamp(f64::from(self.least), f64::from(self.most))
    }
}

impl FeedbackBudget {
    /// Starts with a budget, which is limited to the target's.
    pub fn new(target: FrameTarget, budget: u32) -> FeedbackBudget {
        FeedbackBudget { target, budget: target.limited(f64::from(budget)) }
    }

    /// The number of polygons for the next frame.
    pub fn budget(&self) -> u32 {
        self.budget as u32
    }

    /// The budget after a frame: at most twice or half of the last one.
    ///
    /// # Errors
    /// A time that is not finite or not above 0; the budget stays.
    pub fn observe(&mut self, frame: FrameTime) -> Result<u32, FrameTimeError> {
        check("frame time", frame.seconds)?;
        let factor = (self.target.seconds / frame.seconds).clamp(0.5, 2.0);
        self.budget = self.target.limited(self.budget * factor);
        Ok(self.budget())
    }
}

impl PredictiveBudget {
    /// How much weight a frame keeps with each new one.
    const KEEP: f64 = 0.8;
    /// The spread of the numbers of polygons, relative to their mean, from which frames tell a slope.
    const SPREAD: f64 = 0.05;
    /// How far a frame may be from the model before the model is scaled.
    const SURPRISE: f64 = 1.4;
    /// The share of a frame's time that polygons take from which on the frame tells how fast they are: one that shows next to nothing does not.
    const OF_POLYGONS: f64 = 0.5;
    /// The least factor by which one frame scales the model: a single fast frame is not believed at once.
    const FASTEST: f64 = 0.5;

    /// Starts with a budget, which is limited to the target's.
    pub fn new(target: FrameTarget, budget: u32) -> PredictiveBudget {
        let budget = target.limited(f64::from(budget)) as u32;
        PredictiveBudget { target, budget, frames: WeightedFrames::default(), per_polygon: None }
    }

    /// The number of polygons for the next frame.
    pub fn budget(&self) -> u32 {
        self.budget
    }

    /// The seconds that the model says for a frame; `None` before the first frame.
    pub fn predicted(&self, n_polygons: u32) -> Option<f64> {
        let slope = self.per_polygon?;
        Some(self.frames.fixed(slope) + slope * f64::from(n_polygons))
    }

    /// The budget after a frame.
    ///
    /// # Errors
    /// A time that is not finite or not above 0; the budget stays.
    pub fn observe(&mut self, frame: FrameTime) -> Result<u32, FrameTimeError> {
        check("frame time", frame.seconds)?;
        let n = f64::from(frame.n_polygons.max(1));
        if let (Some(predicted), Some(slope)) = (self.predicted(frame.n_polygons), self.per_polygon)
            && slope * n >= PredictiveBudget::OF_POLYGONS * predicted
        {
            self.follow(frame.seconds / predicted);
        }
        self.frames.add(n, frame.seconds, PredictiveBudget::KEEP);
        let fitted = self.frames.slope(PredictiveBudget::SPREAD).filter(|slope| *slope > 0.0);
        let slope = fitted.or(self.per_polygon).unwrap_or(frame.seconds / n);
        self.per_polygon = Some(slope);
        self.budget = self.target.limited((self.target.seconds - self.frames.fixed(slope)) / slope) as u32;
        Ok(self.budget)
    }

    /// Takes a frame that is far from the model for a change of speed: of the machine, or of the view's polygons.
    fn follow(&mut self, slowness: f64) {
        if (1.0 / PredictiveBudget::SURPRISE..PredictiveBudget::SURPRISE).contains(&slowness) {
            return;
        }
        let factor = slowness.max(PredictiveBudget::FASTEST);
        self.frames.seconds *= factor;
        self.frames.n_seconds *= factor;
        self.per_polygon = self.per_polygon.map(|slope| slope * factor);
    }
}

impl WeightedFrames {
    fn add(&mut self, n: f64, seconds: f64, keep: f64) {
        *self = WeightedFrames {
            weight: self.weight * keep + 1.0,
            n: self.n * keep + n,
            n_squared: self.n_squared * keep + n * n,
            seconds: self.seconds * keep + seconds,
            n_seconds: self.n_seconds * keep + n * seconds,
        };
    }

    /// The slope of the least-squares line; `None` if the numbers of polygons are too much alike.
    fn slope(&self, spread: f64) -> Option<f64> {
        let mean = self.n / self.weight;
        let variance = self.n_squared / self.weight - mean * mean;
        let covariance = self.n_seconds / self.weight - mean * self.seconds / self.weight;
        (variance > (spread * mean).powi(2)).then(|| covariance / variance)
    }

    /// The seconds without polygons, on the line of this slope through the mean frame.
    fn fixed(&self, slope: f64) -> f64 {
        ((self.seconds - slope * self.n) / self.weight.max(1.0)).max(0.0)
    }
}

fn check(what: &'static str, seconds: f64) -> Result<(), FrameTimeError> {
    if seconds.is_finite() && seconds > 0.0 { Ok(()) } else { Err(FrameTimeError::Seconds { what, seconds }) }
}
