//! Does a scan contradict what another sensor saw? A return must not lie where the other's beams passed through.
//!
//! Two scans of different places can be laid over each other with small residuals, but then returns of the one stand in
//! the free space of the other. The share of such returns decides whether a registration is believed.

use nalgebra::Vector2;

use super::{FreeSpaceTally, FreeSpaceTest};
use crate::geometry::quantile::quantile;
use crate::geometry::scalar::larger;
use crate::search::order::ascending;

/// Ranges by bearing of one scan.
#[derive(Debug, Clone)]
pub struct RangeProfile {
    /// By bearing.
    beams: Vec<Beam>,
    /// How many beams lie before each of as many sectors; the sectors have equal shares of [`order_of`].
    before: Vec<usize>,
    /// Between beams further apart than this nothing is known (rad).
    max_gap: f64,
}

#[derive(Debug, Clone, Copy)]
struct Beam {
    /// Bearing (rad).
    bearing: f64,
    /// By [`order_of`].
    order: f64,
    /// Range (m).
    range: f64,
}

/// Smallest tolerance for a difference of ranges (m).
const MIN_TOLERANCE: f64 = 0.15;
/// Tolerance for a difference of ranges, as a share of the range: a small error in heading moves far walls.
const RELATIVE_TOLERANCE: f64 = 0.03;

/// Ranges of one surface, at this range (m), differ by up to this (m).
pub(crate) fn tolerance(range: f64) -> f64 {
    larger(MIN_TOLERANCE, RELATIVE_TOLERANCE * range)
}

impl RangeProfile {
    /// Sorts the returns (m, sensor frame) by bearing.
    pub fn new(points: &[Vector2<f64>]) -> Self {
        let beam = |p: &Vector2<f64>| Beam { bearing: p.y.atan2(p.x), order: order_of(p), range: p.norm() };
        let beams: Vec<Beam> = points.iter().map(beam).collect();
        let beams: Vec<Beam> =
            ascending(beams.iter().map(|beam| beam.order)).into_iter().map(|index| beams[index]).collect();
        let mut before = vec![0; beams.len()];
        for beam in &beams {
            let later = sector(beam.order, beams.len()) + 1;
            before.iter_mut().skip(later).take(1).for_each(|count| *count += 1);
        }
        for later in 1..before.len() {
            before[later] += before[later - 1];
        }
        let mut gaps: Vec<f64> = beams.windows(2).map(|pair| pair[1].bearing - pair[0].bearing).collect();
        let max_gap = quantile(&mut gaps, 0.5).map_or(0.0, |median| 2.5 * median);
        Self { beams, before, max_gap }
    }

    /// What the sensor saw of a point (m, in the sensor's frame).
    pub fn classify(&self, point: &Vector2<f64>) -> FreeSpaceTest {
        let (order, range) = (order_of(point), point.norm());
        let Some(&(mut after)) = self.before.get(sector(order, self.beams.len())) else {
            return FreeSpaceTest::Unknown;
        };
        while self.beams.get(after).is_some_and(|beam| beam.order < order) {
            after += 1;
        }
        if after == 0 || after == self.beams.len() {
            return FreeSpaceTest::Unknown;
        }
        let (low, high) = (self.beams[after - 1], self.beams[after]);
        if high.bearing - low.bearing > self.max_gap {
            return FreeSpaceTest::Unknown;
        }
        let tolerance = tolerance(range);
        let (near, far) = if high.range < low.range { (high.range, low.range) } else { (low.range, high.range) };
        if range < near - tolerance {
            FreeSpaceTest::InFreeSpace
        } else if range > far + tolerance {
            FreeSpaceTest::Hidden
        } else {
            FreeSpaceTest::Agreeing(())
        }
    }

    /// The same of many points, counted.
    pub fn tally(&self, points: impl Iterator<Item = Vector2<f64>>) -> FreeSpaceTally {
        points.map(|point| self.classify(&point)).collect()
    }
}

/// Grows with the bearing as the arc tangent does, from -2 to 2, and is a division.
fn order_of(point: &Vector2<f64>) -> f64 {
    let along = point.x / larger(f64::MIN_POSITIVE, point.x.abs() + point.y.abs());
    if point.y < 0.0 { along - 1.0 } else { 1.0 - along }
}

/// The sector, of so many, that holds this [`order_of`].
fn sector(order: f64, count: usize) -> usize {
    ((order + 2.0) * 0.25 * count as f64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_hides_what_is_behind_and_contradicts_what_is_in_front() {
        use FreeSpaceTest::{Agreeing, Hidden, InFreeSpace, Unknown};

        let wall: Vec<Vector2<f64>> = (-50..=50).map(|i| Vector2::new(3.0, 0.05 * f64::from(i))).collect();
        let profile = RangeProfile::new(&wall);
        let points = [[3.05, 0.3], [1.5, 0.0], [1.0, 0.2], [4.0, 0.1], [-3.0, 0.0]].map(Vector2::from);
        let seen = profile.tally(points.into_iter());
        assert_eq!(seen, FreeSpaceTally { agreeing: 1, in_free_space: 2 });
        let each = points.map(|point| profile.classify(&point));
        assert_eq!(each, [Agreeing(()), InFreeSpace, InFreeSpace, Hidden, Unknown]);
        assert!((seen.agreement() - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(RangeProfile::new(&[]).tally(points.into_iter()), FreeSpaceTally::default());
        assert_eq!(FreeSpaceTally::default().agreement(), 0.0);
    }

    #[test]
    fn nothing_is_said_of_gaps_between_beams() {
        let two_walls = (0..40).map(|i| Vector2::new(3.0, 0.05 * f64::from(i) - 1.0));
        let far = (0..40).map(|i| Vector2::new(-3.0, 0.05 * f64::from(i) - 1.0));
        let profile = RangeProfile::new(&two_walls.chain(far).collect::<Vec<_>>());
        let beside = [Vector2::new(0.0, 1.0), Vector2::new(0.1, -9.0)];
        assert_eq!(profile.tally(beside.into_iter()), FreeSpaceTally::default());
    }
}
