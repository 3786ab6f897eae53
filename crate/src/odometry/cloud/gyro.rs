//! A gyroscope beside the lidar: what it says of the turns between sweeps is a hypothesis that their registrations confirm or refute.
//!
//! Its readings may be in another unit, about other axes or of another clock, saturated or noise. Registrations tell its bias, the mean
//! difference of the rates of turn that both say, and whether what is left beyond it is so much less than the turns themselves that the
//! gyroscope measures them (an F test).

use std::collections::VecDeque;

use nalgebra::{UnitQuaternion, Vector3};

use crate::geometry::quantile::MIN_SAMPLE;

/// Sweeps that a verdict rests on, the last ones: a gyroscope may fail on the way.
const WINDOW: usize = 20;
/// Ratio of two variances with three degrees of freedom for each of five or more sweeps that is not by chance: one in 1,000 is larger (F
/// distribution, 12 and 15 degrees of freedom: 5.8).
const SIGNIFICANT: f64 = 6.0;
/// Largest bias of a gyroscope that is not calibrated (rad/s): 20 degrees a second (InvenSense, "MPU-6000 and MPU-6050 product
/// specification", zero-rate output).
const MAX_BIAS: f64 = 0.35;
/// Readings further apart leave open what was between (s): gyroscopes send 50 to 1,000 a second.
const MAX_GAP: f64 = 0.05;
/// Readings are kept for so long (s).
const MAX_AGE: f64 = 10.0;
/// Turns of less than this a second say nothing of a gyroscope (rad/s): registrations of neighbouring sweeps differ by as much.
const LEAST_RATE: f64 = 0.05;

/// Its readings of late, and what registrations say of them.
#[derive(Default)]
pub(super) struct Gyro {
    /// Times (s) and angular velocities in the frame of the lidar (rad/s).
    readings: VecDeque<(f64, Vector3<f64>)>,
    compared: VecDeque<Compared>,
    bias: Vector3<f64>,
    verdict: Verdict,
}

/// Mean rates of turn from one registered sweep to the next (rad/s).
#[derive(Clone, Copy)]
struct Compared {
    by_gyro: Vector3<f64>,
    /// The mean of its readings: rates that are not in radians add up to more than a turn.
    mean_reading: Vector3<f64>,
    by_registration: Vector3<f64>,
}

/// Whether a gyroscope measures how the lidar turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Verdict {
    /// Too few sweeps, or the lidar has hardly turned.
    #[default]
    Open,
    /// It does.
    Confirmed,
    /// It does not, once and for all.
    Refuted,
}

impl Gyro {
    /// Adds readings: times (s) and angular velocities in the frame of the lidar (rad/s). Those that are not later than the last one are
    /// known already.
    pub fn add(&mut self, readings: &[(f64, Vector3<f64>)]) {
        for (time, rate) in readings {
            let is_new = self.readings.back().is_none_or(|(last, _)| time > last);
            if is_new && rate.iter().all(|x| x.is_finite()) {
                self.readings.push_back((*time, *rate));
            }
        }
        let newest = self.readings.back().map_or(0.0, |(time, _)| *time);
        while self.readings.front().is_some_and(|(time, _)| newest - time > MAX_AGE) {
            self.readings.pop_front();
        }
    }

    pub fn is_confirmed(&self) -> bool {
        self.verdict == Verdict::Confirmed
    }

    /// The mean rate of turn between two times (rad/s), in the frame at the first one; `None` where readings are missing, and where the
    /// gyroscope is refuted.
    pub fn rate(&self, from: f64, to: f64) -> Option<Vector3<f64>> {
        (self.verdict != Verdict::Refuted).then(|| self.measured(from, to, &self.bias))?
    }

    /// The same where this is the bias. The rate is taken to change linearly from reading to reading.
    fn measured(&self, from: f64, to: f64, bias: &Vector3<f64>) -> Option<Vector3<f64>> {
        let first = self.readings.partition_point(|(time, _)| *time <= from).checked_sub(1)?;
        let mut turn = UnitQuaternion::identity();
        for (a, b) in self.readings.iter().skip(first).zip(self.readings.iter().skip(first + 1)) {
            if b.0 - a.0 > MAX_GAP {
                return None;
            }
            let [begin, end] = [from.max(a.0), to.min(b.0)];
            let share = (0.5 * (begin + end) - a.0) / (b.0 - a.0);
            let rate = a.1 + (b.1 - a.1) * share - bias;
            turn *= UnitQuaternion::from_scaled_axis(rate * (end - begin));
            if b.0 >= to {
                return Some(turn.scaled_axis() / (to - from));
            }
        }
        None
    }

    /// Compares what it says with the turn of a good registration between two times.
    pub fn compare(&mut self, from: f64, to: f64, registered: &UnitQuaternion<f64>) {
        let Some(by_gyro) = self.measured(from, to, &Vector3::zeros()) else { return };
        if self.compared.len() == WINDOW {
            self.compared.pop_front();
        }
        let between = || self.readings.iter().filter(|(time, _)| (from..=to).contains(time)).map(|(_, rate)| rate);
        let mean_reading = between().sum::<Vector3<f64>>() / between().count().max(1) as f64;
        let by_registration = registered.scaled_axis() / (to - from);
        self.compared.push_back(Compared { by_gyro, mean_reading, by_registration });
        let count = self.compared.len() as f64;
        self.bias = self.compared.iter().map(Compared::difference).sum::<Vector3<f64>>() / count;
        if self.verdict != Verdict::Refuted {
            self.verdict = self.judged();
        }
    }

    fn judged(&self) -> Verdict {
        let [left, turns] = self.variances();
        if self.compared.len() < MIN_SAMPLE || turns < LEAST_RATE * LEAST_RATE && left < LEAST_RATE * LEAST_RATE {
            return Verdict::Open;
        }
        if left * SIGNIFICANT < turns && self.bias.norm() < MAX_BIAS {
            return Verdict::Confirmed;
        }
        if left > turns || self.bias.norm() >= MAX_BIAS { Verdict::Refuted } else { Verdict::Open }
    }

    /// Mean squares (rad^2/s^2) of what is left of the differences beyond the bias, and of the turns.
    fn variances(&self) -> [f64; 2] {
        let count = self.compared.len() as f64;
        let left: f64 = self.compared.iter().map(|one| (one.difference() - self.bias).norm_squared()).sum();
        let turns: f64 = self.compared.iter().map(|one| one.by_registration.norm_squared()).sum();
        [left / (count - 1.0).max(1.0), turns / count.max(1.0)]
    }

    /// What was found, in a whole sentence; `None` without readings.
    pub fn note(&self) -> Option<String> {
        self.readings.front()?;
        let degrees = |rate: f64| rate.to_degrees();
        let [left, turns] = self.variances().map(f64::sqrt).map(degrees);
        Some(match self.verdict {
            Verdict::Confirmed => format!(
                "The gyroscope is used where clouds turn: it says the same as their registration to {left:.1} degrees a second, beyond a \
                 bias of {:.1}",
                degrees(self.bias.norm())
            ),
            Verdict::Refuted => format!(
                "The gyroscope is not used: it differs from the registration of the clouds by {left:.1} degrees a second and a bias of \
                 {:.1}, and they turn by {turns:.1}.{}",
                degrees(self.bias.norm()),
                self.remedy()
            ),
            Verdict::Open => "Whether the gyroscope measures how the clouds turn is open: they hardly turn, or too few of them are good. \
                              It is tried, and used where more points fit"
                .to_owned(),
        })
    }

    /// What may be wrong with it.
    fn remedy(&self) -> &'static str {
        let off = |factor: f64| -> f64 {
            self.compared.iter().map(|one| (one.mean_reading * factor - one.by_registration).norm_squared()).sum()
        };
        if off(1f64.to_radians()) * SIGNIFICANT < off(1.0) && off(1f64.to_radians()) * SIGNIFICANT < off(0.0) {
            return " It seems to be in degrees a second; sensor_msgs/Imu is in radians";
        }
        " Its axes may be others (is there a /tf from it to the lidar?), or its unit or its clock"
    }
}

impl Compared {
    fn difference(&self) -> Vector3<f64> {
        self.by_gyro - self.by_registration
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns about a changing axis (rad/s).
    fn rate(time: f64) -> Vector3<f64> {
        Vector3::new(0.3 * (2.0 * time).sin(), 0.2 * (3.0 * time).cos(), 1.5 * (1.3 * time).sin())
    }

    fn attitude(time: f64) -> UnitQuaternion<f64> {
        let step = 1e-4;
        let steps = (0..(time / step).round() as usize).map(|number| (number as f64 + 0.5) * step);
        steps.fold(UnitQuaternion::identity(), |R, at| R * UnitQuaternion::from_scaled_axis(rate(at) * step))
    }

    /// Compares ten sweeps a second for 3 s with a gyroscope that says this at a time.
    fn compared(says: impl Fn(f64) -> Vector3<f64>) -> Gyro {
        let mut gyro = Gyro::default();
        let readings: Vec<_> = (0..320).map(|number| 0.01 * f64::from(number)).map(|time| (time, says(time))).collect();
        gyro.add(&readings);
        for sweep in 0..30 {
            let [from, to] = [0.1 * f64::from(sweep), 0.1 * f64::from(sweep + 1)];
            gyro.compare(from, to, &(attitude(from).inverse() * attitude(to)));
        }
        gyro
    }

    /// What a gyroscope says at a time (s).
    type Says = fn(f64) -> Vector3<f64>;

    #[test]
    fn a_gyroscope_is_confirmed_with_its_bias_and_every_wrong_one_refuted() {
        let bias = Vector3::new(0.02, -0.05, 0.04);
        let gyro = compared(|time| rate(time) + bias);
        assert_eq!(gyro.verdict, Verdict::Confirmed);
        assert!((gyro.bias - bias).norm() < 2e-3, "{}", gyro.bias);
        let expected = (attitude(2.0).inverse() * attitude(2.1)).scaled_axis() / 0.1;
        assert!((gyro.rate(2.0, 2.1).unwrap() - expected).norm() < 5e-3);
        assert_eq!(gyro.rate(3.15, 3.3), None, "readings are missing");
        let wrong: [(&str, Says); 5] = [
            ("axes", |time| rate(time).yzx()),
            ("degrees a second", |time| rate(time) * 1f64.to_degrees()),
            ("clock", |time| rate(time + 1.7)),
            ("sign", |time| -rate(time)),
            ("noise", |time| Vector3::new((9e4 * time).sin(), (7e4 * time).sin(), (8e4 * time).sin()) * 20.0),
        ];
        for (name, says) in wrong {
            let gyro = compared(says);
            assert_eq!((gyro.verdict, gyro.rate(2.0, 2.1)), (Verdict::Refuted, None), "{name}");
            assert_eq!(gyro.note().unwrap().contains("in degrees a second"), name == "degrees a second", "{name}");
        }
    }

    #[test]
    fn a_lidar_that_hardly_turns_leaves_it_open() {
        let mut gyro = Gyro::default();
        assert_eq!(gyro.note(), None);
        gyro.add(&[(0.0, Vector3::zeros()), (0.04, Vector3::zeros()), (0.08, Vector3::zeros())]);
        (0..6).for_each(|_| gyro.compare(0.0, 0.08, &UnitQuaternion::identity()));
        assert!(gyro.verdict == Verdict::Open && gyro.note().unwrap().contains("is open"));
    }
}
