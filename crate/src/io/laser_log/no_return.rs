//! A number that stands for no return below all ranges, where the log does not say so.

use super::LaserScan;

/// Readings that show a number for no return, at least.
const MIN_READINGS: usize = 20;
/// They are at most this share of all: otherwise the sensor is in a round room.
const MAX_SHARE: f64 = 0.9;
/// They differ by the rounding of single precision and of a file in millimetres, as a share.
const SAME: f32 = 1e-3;
/// Up to this many times the number there is hardly any range: a wall that a laser nears leaves no such gap.
const GAP: f32 = 2.0;
/// Ranges within the gap, as a share of the readings of the number.
const MAX_IN_GAP: f64 = 0.05;

/// Drops the readings of the smallest number, and says so, where it comes again and again and the ranges begin far above it.
/// Drivers write their least range, or a number below it, where nothing came back; a part of the robot that the laser sees
/// leaves the same pile, and is no wall either.
#[inline(never)]
pub(super) fn drop_number_for_none(scans: &mut [LaserScan]) -> Option<String> {
    let readings =
        || scans.iter().flat_map(|scan| &scan.ranges).copied().filter(|range| range.is_finite() && *range > 0.0);
    let smallest = readings().fold(f32::INFINITY, f32::min);
    let count = |from: f32, to: f32| readings().filter(|range| (from..=to).contains(range)).count();
    let end = smallest * (1.0 + SAME);
    let (piled, within) = (count(smallest, end), count(smallest, GAP * smallest));
    let all = readings().count();
    let is_pile = piled >= MIN_READINGS && (within - piled) as f64 <= MAX_IN_GAP * piled as f64;
    if !is_pile || piled as f64 > MAX_SHARE * all as f64 {
        return None;
    }
    for range in scans.iter_mut().flat_map(|scan| &mut scan.ranges) {
        if (smallest..=end).contains(range) {
            *range = f32::NAN;
        }
    }
    Some(format!(
        "{piled} of {all} readings are {smallest:.3} m and hardly any lies up to {GAP} times that: they were taken for no return, or \
         for a part of the robot, and dropped."
    ))
}

#[cfg(test)]
mod tests {
    use super::super::Bearings;
    use super::*;

    fn told(ranges: impl Iterator<Item = f32>) -> (bool, usize) {
        let mut scans = [LaserScan {
            number: 0,
            line: 1,
            bearings: Bearings::Even { start: 0.0, step: 0.01 },
            ranges: ranges.collect(),
            max_range: f64::INFINITY,
            time: None,
            reference: None,
            odometry: None,
        }];
        let note = drop_number_for_none(&mut scans);
        (note.is_some(), scans[0].points().len())
    }

    #[test]
    fn a_number_below_all_ranges_is_no_return() {
        let walls = || (0..180_u8).map(|beam| 1.0 + 0.02 * f32::from(beam));
        assert_eq!(told(walls().chain([0.05; 40])), (true, 180));
        assert_eq!(told(walls().chain([0.05; 10])), (false, 190));
        // A wall that is near, in steps of a centimetre, and a round room.
        let near = (0..90_u8).map(|beam| (0.3 + 0.004 * f32::from(beam) * f32::from(beam / 8)).max(0.3));
        assert!(!told(near.map(|range| (100.0 * range).round() / 100.0)).0);
        assert_eq!(told([1.0; 180].into_iter()), (false, 180));
    }
}
