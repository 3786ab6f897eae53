//! When the points of a cloud were measured.

/// The time of each point: `origin` and its offset, in one unit.
///
/// Clocks count so many units that single precision would lose a sweep's duration; offsets from the first point do not.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointTimes {
    /// The earliest time.
    pub origin: f64,
    /// From there to each point's time.
    pub offsets: Vec<f32>,
}

impl PointTimes {
    /// From the times themselves; those that are not finite become the earliest one. `None` where none is finite.
    pub fn new(times: &[f64]) -> Option<Self> {
        let origin = times.iter().copied().filter(|time| time.is_finite()).reduce(f64::min)?;
        let offset = |time: &f64| if time.is_finite() { (time - origin) as f32 } else { 0.0 };
        Some(Self { origin, offsets: times.iter().map(offset).collect() })
    }

    /// From the earliest time to the last one.
    pub fn span(&self) -> f64 {
        f64::from(self.offsets.iter().copied().fold(0.0, f32::max))
    }

    /// The times of some of the points.
    #[must_use]
    pub(crate) fn selected(&self, kept: &[usize]) -> Self {
        Self { origin: self.origin, offsets: kept.iter().map(|&point| self.offsets[point]).collect() }
    }
}
