//! Does a scan contradict what another sensor saw? A return must not lie where the other's beams passed through.
//!
//! Two scans of different places can be laid over each other with small residuals, but then returns of the one stand in
//! the free space of the other. The share of such returns decides whether a registration is believed.

use nalgebra::Vector2;

/// How the returns of one scan look from another sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Visibility {
    /// Returns at the range that the sensor measured there.
    pub agreeing: usize,
    /// Returns in front of what the sensor saw: its beam passed through them.
    pub in_free_space: usize,
    /// Returns behind what the sensor saw: nothing can be said of them.
    pub hidden: usize,
}

impl Visibility {
    /// Share of the visible returns that agree, 0..=1; 0 when none is visible.
    pub fn agreement(&self) -> f64 {
        self.agreeing as f64 / (self.agreeing + self.in_free_space).max(1) as f64
    }
}

impl std::ops::AddAssign for Visibility {
    fn add_assign(&mut self, other: Self) {
        self.agreeing += other.agreeing;
        self.in_free_space += other.in_free_space;
        self.hidden += other.hidden;
    }
}

/// Ranges by bearing of one scan.
#[derive(Debug, Clone)]
pub struct RangeProfile {
    /// (bearing (rad), range (m)), by bearing.
    beams: Vec<(f64, f64)>,
    /// Between beams further apart than this nothing is known (rad).
    max_gap: f64,
}

/// Ranges this close are equal (m) ...
const MIN_TOLERANCE: f64 = 0.15;
/// ... or within this share of the range: a small error in heading moves far walls.
const RELATIVE_TOLERANCE: f64 = 0.03;

impl RangeProfile {
    /// Sorts the returns (m, sensor frame) by bearing.
    pub fn new(points: &[Vector2<f64>]) -> Self {
        let mut beams: Vec<(f64, f64)> = points.iter().map(|p| (p.y.atan2(p.x), p.norm())).collect();
        beams.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut gaps: Vec<f64> = beams.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        let max_gap = if gaps.is_empty() {
            0.0
        } else {
            let middle = gaps.len() / 2;
            2.5 * *gaps.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        Self { beams, max_gap }
    }

    /// How points (m, in the frame of this profile's sensor) look from it.
    pub fn look_at(&self, points: impl Iterator<Item = Vector2<f64>>) -> Visibility {
        let mut visibility = Visibility::default();
        for point in points {
            let (bearing, range) = (point.y.atan2(point.x), point.norm());
            let after = self.beams.partition_point(|beam| beam.0 < bearing);
            if after == 0 || after == self.beams.len() {
                continue;
            }
            let (low, high) = (self.beams[after - 1], self.beams[after]);
            if high.0 - low.0 > self.max_gap {
                continue;
            }
            let tolerance = MIN_TOLERANCE.max(RELATIVE_TOLERANCE * range);
            if range < low.1.min(high.1) - tolerance {
                visibility.in_free_space += 1;
            } else if range > low.1.max(high.1) + tolerance {
                visibility.hidden += 1;
            } else {
                visibility.agreeing += 1;
            }
        }
        visibility
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_hides_what_is_behind_and_contradicts_what_is_in_front() {
        let wall: Vec<Vector2<f64>> = (-50..=50).map(|i| Vector2::new(3.0, 0.05 * f64::from(i))).collect();
        let profile = RangeProfile::new(&wall);
        let points = [[3.05, 0.3], [1.5, 0.0], [1.0, 0.2], [4.0, 0.1], [-3.0, 0.0]].map(Vector2::from);
        let seen = profile.look_at(points.into_iter());
        assert_eq!(seen, Visibility { agreeing: 1, in_free_space: 2, hidden: 1 });
        assert!((seen.agreement() - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(RangeProfile::new(&[]).look_at(points.into_iter()), Visibility::default());
        assert_eq!(Visibility::default().agreement(), 0.0);
    }

    #[test]
    fn nothing_is_said_of_gaps_between_beams() {
        let two_walls = (0..40).map(|i| Vector2::new(3.0, 0.05 * f64::from(i) - 1.0));
        let far = (0..40).map(|i| Vector2::new(-3.0, 0.05 * f64::from(i) - 1.0));
        let profile = RangeProfile::new(&two_walls.chain(far).collect::<Vec<_>>());
        let beside = [Vector2::new(0.0, 1.0), Vector2::new(0.1, -9.0)];
        assert_eq!(profile.look_at(beside.into_iter()), Visibility::default());
    }
}
