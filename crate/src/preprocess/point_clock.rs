//! How the times of a lidar's points are read: their unit, and what they are counted from.
//!
//! Drivers disagree: Ouster writes `t` in nanoseconds from the stamp, Velodyne `time` in seconds up to the stamp, Hesai and RoboSense
//! `timestamp` in seconds since 1970, Livox `offset_time` in nanoseconds. Headers name no unit, but the duration of a sweep does.

use serde::{Deserialize, Serialize};

use crate::geometry::PointTimes;

/// How the times of a recording's points are read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PointClock {
    /// Seconds in a unit.
    pub unit: f64,
    /// Whether a clock is read, not the time from the frame's stamp.
    pub is_absolute: bool,
}

/// Units, in seconds, with their names.
const UNITS: [(f64, &str); 4] =
    [(1e-9, "nanoseconds"), (1e-6, "microseconds"), (1e-3, "milliseconds"), (1.0, "seconds")];
/// Shortest duration of a sweep (s): lidars send 1 to 100 sweeps a second.
const SHORTEST_SWEEP: f64 = 5e-3;
/// Neighbouring units differ by this factor, so that a sweep of 5 ms to 5 s has one unit.
const UNIT_FACTOR: f64 = 1e3;
/// The stamp of a frame lies no further from its sweep than this (durations of a sweep), be it at its beginning or at its end.
const MAX_STAMP_SPANS: f64 = 2.0;

impl PointClock {
    /// From the times of the first sweep.
    ///
    /// # Errors
    /// Why they cannot be those of a sweep, in a whole sentence.
    pub fn of(times: &PointTimes) -> Result<Self, String> {
        let span = times.span();
        if span == 0.0 {
            return Err("The times of points are not used: they are all the same, so motion within a sweep is not \
                        corrected"
                .to_owned());
        }
        let is_sweep = |unit: f64| (SHORTEST_SWEEP..UNIT_FACTOR * SHORTEST_SWEEP).contains(&(unit * span));
        let Some(&(unit, _)) = UNITS.iter().find(|(unit, _)| is_sweep(*unit)) else {
            return Err(format!(
                "The times of points are not used: they span {span}, which is no sweep of 5 ms to 5 s in nanoseconds, \
                 microseconds, milliseconds or seconds"
            ));
        };
        Ok(Self { unit, is_absolute: times.origin.abs() > MAX_STAMP_SPANS * span })
    }

    /// The times in seconds from the frame's stamp (s). Where a clock has nothing to do with the stamp, or that is not known, the first
    /// point is taken to be of the time of the stamp.
    pub fn seconds(&self, times: &PointTimes, stamp: Option<f64>) -> PointTimes {
        let span = self.unit * times.span();
        let from_stamp = self.unit * times.origin - if self.is_absolute { stamp.unwrap_or(f64::INFINITY) } else { 0.0 };
        let origin = if from_stamp.abs() <= MAX_STAMP_SPANS * span { from_stamp } else { 0.0 };
        PointTimes { origin, offsets: times.offsets.iter().map(|offset| self.unit as f32 * offset).collect() }
    }

    /// What was found, in a whole sentence.
    pub fn note(&self, times: &PointTimes) -> String {
        let name = UNITS.iter().find(|(unit, _)| *unit == self.unit).map_or("seconds", |(_, name)| name);
        let from = if self.is_absolute {
            "of a clock"
        } else if times.origin < -0.5 * times.span() {
            "up to the time stamp, which is the end of a sweep"
        } else {
            "from the time stamp, which is the beginning of a sweep"
        };
        format!("Points have times, in {name} {from}: a sweep takes {:.3} s", self.unit * times.span())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_and_origin_follow_from_the_duration_of_a_sweep() {
        let sweep = |first: f64, unit: f64| {
            PointTimes::new(&[0.0, 0.03, 0.099].map(|time: f64| (first + time) / unit)).unwrap()
        };
        for unit in [1e-9, 1e-6, 1e-3, 1.0] {
            for (first, is_absolute) in [(0.0, false), (-0.1, false), (1.7e9, true), (321.0, true)] {
                let times = sweep(first, unit);
                let clock = PointClock::of(&times).unwrap();
                assert_eq!(clock, PointClock { unit, is_absolute }, "{first} s in {unit} s");
                // The stamp is 20 ms before the first point of a clock.
                let stamp = if is_absolute { first - 0.02 } else { 5.0 };
                let seconds = clock.seconds(&times, Some(stamp));
                let expected = if is_absolute { 0.02 } else { first };
                assert!(
                    (seconds.origin - expected).abs() < 1e-6 && (seconds.span() - 0.099).abs() < 1e-6,
                    "{seconds:?}"
                );
                if is_absolute {
                    assert_eq!(
                        (clock.seconds(&times, None).origin, clock.seconds(&times, Some(9e8)).origin),
                        (0.0, 0.0)
                    );
                }
            }
        }
        assert!(PointClock::of(&sweep(1.0, 1.0)).unwrap().note(&sweep(1.0, 1.0)).contains("seconds of a clock"));
        assert!(PointClock::of(&sweep(-0.099, 1.0)).unwrap().note(&sweep(-0.099, 1.0)).contains("end of a sweep"));
    }

    #[test]
    fn times_of_no_sweep_are_refused() {
        assert!(PointClock::of(&PointTimes::new(&[5.0; 3]).unwrap()).unwrap_err().contains("all the same"));
        let hours = PointTimes::new(&[0.0, 7e12]).unwrap();
        assert!(PointClock::of(&hours).unwrap_err().contains("no sweep"));
        assert_eq!(PointTimes::new(&[f64::NAN, f64::INFINITY]), None);
        let gaps = PointTimes::new(&[f64::NAN, 2.0, 2.1]).unwrap();
        assert_eq!((gaps.origin, gaps.offsets[0]), (2.0, 0.0));
    }
}
