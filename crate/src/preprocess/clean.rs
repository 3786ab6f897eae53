//! Removal of points that are not measurements of a surface, with counts by reason.

use std::collections::HashSet;

use glam::{DVec3, Vec3};
use rustc_hash::FxBuildHasher;
use serde::{Deserialize, Serialize};

use crate::geometry::PointCloud;
use crate::geometry::quantile::RANGE_END;
use crate::{Error, Result};

/// The range limits (m) of usable returns.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RangeLimits {
    /// Nearer returns are dropped: the robot itself, dirt on the window.
    pub min_range: f64,
    /// Returns at this range or beyond are dropped: a sensor reports its limit where nothing came back.
    pub max_range: f64,
}

/// Counts of the kept and dropped points of one scan. The others add up to `num_read`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct CleaningReport {
    /// Points given.
    pub num_read: usize,
    /// Dropped: a coordinate is NaN or infinite.
    pub non_finite: usize,
    /// Dropped: nearer than `min_range`.
    pub too_near: usize,
    /// Dropped: at `max_range` (within a millimetre) or beyond.
    pub at_range_limit: usize,
    /// Dropped: equal to an earlier point.
    pub duplicates: usize,
    /// Points kept.
    pub num_kept: usize,
}

/// Refuses coordinates so large that they are stored relative to an origin. Each cloud has another origin, so the motion between
/// two of them would be lost.
///
/// # Errors
/// When the origin is not zero.
pub fn refuse_map_coordinates(cloud: &PointCloud) -> Result<()> {
    if cloud.origin == DVec3::ZERO {
        return Ok(());
    }
    let problem = "The coordinates are those of a map, not of a sensor: they are too large for single precision";
    Err(Error::whole(problem, "Give clouds in the frame of the sensor that took them"))
}

/// The points that [`clean`] kept, in their order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cleaned {
    /// Their positions (m).
    pub positions: Vec<Vec3>,
    /// Their indices among the points given, to pick normals or colours by.
    pub indices: Vec<u32>,
    /// Counts of dropped points by reason.
    pub report: CleaningReport,
}

/// Tolerance of the range limit (m): a range of 50 m becomes 49.99999999 m by sine, cosine and a decimal file.
const LIMIT_TOLERANCE: f64 = 1e-3;

/// Drops the points that are not measurements. `positions` are in the sensor frame (m), so a point's range is its distance
/// from the origin.
///
/// Each point is counted once, under the first that applies: not finite, too near, at the range limit, a duplicate of
/// a point that was kept. 0 and -0 are the same coordinate. Limits that are NaN drop nothing.
pub fn clean(positions: &[Vec3], limits: &RangeLimits) -> Cleaned {
    let mut report = CleaningReport { num_read: positions.len(), ..CleaningReport::default() };
    let mut kept = Vec::with_capacity(positions.len());
    let mut indices = Vec::with_capacity(positions.len());
    let mut seen = HashSet::with_capacity_and_hasher(positions.len(), FxBuildHasher);
    for (index, &position) in positions.iter().enumerate() {
        let range = range(position);
        if !position.is_finite() {
            report.non_finite += 1;
        } else if range < limits.min_range {
            report.too_near += 1;
        } else if range >= limits.max_range - LIMIT_TOLERANCE {
            report.at_range_limit += 1;
        } else if !seen.insert((position + Vec3::ZERO).to_array().map(f32::to_bits)) {
            report.duplicates += 1;
        } else {
            kept.push(position);
            indices.push(index as u32);
        }
    }
    report.num_kept = kept.len();
    Cleaned { positions: kept, indices, report }
}

/// Distance from the origin (m), in double precision so that squares of single-precision numbers do not overflow.
fn range(position: Vec3) -> f64 {
    position.as_dvec3().length()
}

/// The smallest range (m) that the sensor reported where nothing came back, if the scans of one recording show one.
///
/// Many lasers report their limit where there is no return, always the same number or, after a calibration, about the same, whereas
/// ranges of surfaces differ. So the limit is a pile at the top of the histogram of all ranges:
///
/// - at least three returns have the largest range (to within 1e-6, the rounding of sines, cosines and single precision), and more
///   than lie within 5 % below it, as ranges are quantised, for example to a centimetre, so that the farthest wall gives equal
///   ranges as well;
/// - or the same of a narrow band below the largest range, with twenty returns at least, where the strip of the same width below the
///   band holds hardly any: what a surface leaves has no such edge.
///
/// A few returns may lie beyond: echoes of echoes.
pub fn range_limit<'a>(scans: impl IntoIterator<Item = &'a [Vec3], IntoIter: Clone>) -> Option<f64> {
    /// Share of the returns that may lie beyond the limit.
    const MAX_STRAYS: f64 = 1e-3;
    /// How often the farthest returns are taken for strays and skipped; each step makes two passes over all returns.
    const MOST_STEPS: usize = 3;
    let scans = scans.into_iter();
    let mut beyond = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let top = Top::of(scans.clone(), beyond);
        let limit = top.limit();
        let are_strays = top.counts[1] as f64 <= MAX_STRAYS * top.counts[0] as f64;
        if limit.is_some() || !are_strays {
            return limit;
        }
        beyond = RANGE_END * top.largest;
    }
    None
}

/// Widths of a pile (shares of the largest range), and the returns that it has at least.
const BANDS: [(f64, usize); 4] = [(1e-6, 3), (1e-3, 20), (3e-3, 20), (1e-2, 20)];
/// The strip below a pile that jitters holds at most this share of its returns.
const MAX_STRIP_SHARE: f64 = 0.05;

/// The top of the histogram of the ranges below some range (m).
struct Top {
    largest: f64,
    /// Returns in all, from `RANGE_END` on, and for each band in it and in it with the strip below.
    counts: [usize; 10],
    /// Whether there are smaller ranges: otherwise the sensor is in a round room, or the limit cannot be determined.
    is_farther: bool,
}

impl Top {
    fn of<'a>(scans: impl Iterator<Item = &'a [Vec3]> + Clone, beyond: f64) -> Self {
        let largest = scans.clone().map(|scan| largest_range(scan, beyond)).fold(0.0, f64::max);
        let [a, b, c, d] = BANDS.map(|(band, _)| [largest * (1.0 - band), largest * (1.0 - 2.0 * band)]);
        let least = [0.0, RANGE_END * largest, a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]];
        let (mut counts, mut is_farther) = ([0; 10], false);
        for scan in scans {
            let of_scan = count_ranges(scan, least, beyond);
            counts.iter_mut().zip(of_scan).for_each(|(sum, count)| *sum += count);
            is_farther |= of_scan[1] < of_scan[0];
        }
        Self { largest, counts, is_farther }
    }

    fn limit(&self) -> Option<f64> {
        let is_limit = |&place: &usize| {
            let [at_limit, with_strip] = [self.counts[2 + 2 * place], self.counts[3 + 2 * place]];
            let has_edge = (with_strip - at_limit) as f64 <= MAX_STRIP_SHARE * at_limit as f64;
            at_limit >= BANDS[place].1 && at_limit > self.counts[1] - at_limit && (place == 0 || has_edge)
        };
        let place = (0..BANDS.len()).find(is_limit).filter(|_| self.largest > 0.0 && self.is_farther)?;
        Some(if place == 0 { self.largest } else { self.largest * (1.0 - BANDS[place].0) })
    }
}

/// The largest finite range below some range (m); 0 where there is none.
#[inline(never)]
fn largest_range(scan: &[Vec3], beyond: f64) -> f64 {
    scan.iter().map(|&p| range(p)).filter(|range| range.is_finite() && *range < beyond).fold(0.0, f64::max)
}

/// How many finite ranges below some range are at least each of these (m).
#[inline(never)]
fn count_ranges<const N: usize>(scan: &[Vec3], least: [f64; N], beyond: f64) -> [usize; N] {
    let mut counts = [0; N];
    for range in scan.iter().map(|&p| range(p)).filter(|range| range.is_finite() && *range < beyond) {
        for (count, least) in counts.iter_mut().zip(least) {
            *count += usize::from(range >= least);
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: RangeLimits = RangeLimits { min_range: 0.5, max_range: 50.0 };

    #[test]
    fn every_point_is_counted_once_under_the_first_reason() {
        let points = [
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(f32::NAN, 0.0, 0.0),
            Vec3::new(f32::INFINITY, 100.0, 0.0),
            Vec3::new(0.1, 0.0, 0.0),
            Vec3::new(0.1, 0.0, 0.0),
            Vec3::new(0.0, 49.999_5, 0.0),
            Vec3::new(0.0, 49.99, 0.0),
            Vec3::new(1e30, 1e30, 1e30),
            Vec3::new(1.0, -0.0, 0.0),
            Vec3::new(0.0, 0.5, 0.0),
        ];
        let cleaned = clean(&points, &LIMITS);
        assert_eq!(cleaned.indices, [0, 6, 9]);
        assert_eq!(cleaned.positions, [points[0], points[6], points[9]]);
        let expected =
            CleaningReport { num_read: 10, non_finite: 2, too_near: 2, at_range_limit: 2, duplicates: 1, num_kept: 3 };
        assert_eq!(cleaned.report, expected);
    }

    #[test]
    fn nothing_is_dropped_from_nothing_and_without_limits() {
        assert_eq!(clean(&[], &LIMITS), Cleaned::default());
        let far = [Vec3::splat(f32::MAX), Vec3::ZERO];
        let cleaned = clean(&far, &RangeLimits { min_range: 0.0, max_range: f64::INFINITY });
        assert_eq!(cleaned.positions, far);
    }

    #[test]
    fn a_limit_is_what_the_farthest_returns_share() {
        let scan = |ranges: &[f32]| -> Vec<Vec3> {
            let beam = |(index, &range): (usize, &f32)| {
                let angle = index as f32 * 0.1;
                Vec3::new(range * angle.cos(), range * angle.sin(), 0.0)
            };
            ranges.iter().enumerate().map(beam).collect()
        };
        let limit = |ranges: &[f32]| range_limit([scan(ranges).as_slice()]);
        assert!((limit(&[3.0, 8.19, 8.19, f32::NAN, 5.0, 8.19, 8.0]).unwrap() - 8.19).abs() < 1e-5);
        assert_eq!(limit(&[3.0, 8.19, 8.19, 5.0]), None);
        // A far wall, in steps of a centimetre.
        assert_eq!(limit(&[8.19, 8.19, 8.19, 8.18, 8.17, 8.16, 3.0]), None);
        assert_eq!(limit(&[0.0, 0.0, 0.0]), None);
        assert_eq!(limit(&[]), None);
        let (one, other) = (scan(&[3.0, 8.19, 2.0]), scan(&[8.19, 8.19]));
        assert!(range_limit([one.as_slice(), other.as_slice()]).is_some());
        // A limit that jitters by a tenth of a percent, above walls at all ranges.
        let walls = (0..180).map(|beam| 2.0 + 0.033 * beam as f32);
        let jitter = (0..60).map(|beam| 8.18 + 0.011 * (beam as f32 * 0.618).fract());
        let ranges: Vec<f32> = walls.clone().chain(jitter).collect();
        assert!((8.1..=8.18).contains(&limit(&ranges).unwrap()), "{:?}", limit(&ranges));
        // An echo beyond it, once in a thousand returns.
        let echoed: Vec<f32> = (0..10).flat_map(|_| ranges.clone()).chain([14.2]).collect();
        assert!((8.1..=8.18).contains(&limit(&echoed).unwrap()), "{:?}", limit(&echoed));
        // The far end of a hall, without an edge below it.
        let far = (0..60).map(|beam| 8.18 - 0.0025 * beam as f32);
        assert_eq!(limit(&walls.chain(far).collect::<Vec<f32>>()), None);
        // A round wall about the sensor.
        assert_eq!(limit(&[1.0; 180]), None);
    }
}
