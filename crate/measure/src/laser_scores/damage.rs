//! Faults of recordings in practice, applied to intact logs.

use scanstitch::geometry::{Pose2, Pose3, RigidMotion};
use scanstitch::io::laser_log::LaserLog;
use scanstitch::io::trajectory::{Trajectory, in_space};

/// A log with its odometry, a pose a scan, and the number that each scan had in the log as it was.
pub struct Input {
    pub log: LaserLog,
    pub odometry: Option<Vec<Option<Pose2>>>,
    pub numbers: Vec<usize>,
    /// Added to the times of the odometry (s); without, the odometry has none.
    pub clock: Option<f64>,
    /// Whether the odometry's headings are written in degrees.
    pub in_degrees: bool,
    /// Number of the draw of `wheels_stop`: another one has its faults elsewhere.
    pub draw: usize,
}

/// All faults, by name.
pub const ALL: &[&str] = &[
    "scaled_up",
    "scaled_down",
    "scaled_twice",
    "scaled_half",
    "degrees",
    "gaps",
    "clock",
    "jumps",
    "heading_drift",
    "reversed",
    "every_fourth",
    "cut_out",
    "few_returns",
    "narrow",
    "short_range",
    "coarse_beams",
    "blind",
    "backwards",
    "every_second",
    "every_third",
    "every_fifth",
    "every_tenth",
    "every_fifteenth",
    "near",
    "first_half",
    "second_half",
    "noisy",
    "glass",
    "people",
    "wheels_stop",
];

/// `wheels_stop`: the fault comes again after this time (s), ...
const STOP_PERIOD: f64 = 25.0;
/// ... which begins, from one draw to the next, this share of it earlier (the golden ratio: draws are spread evenly), ...
const DRAW_SHIFT: f64 = 0.618;
/// ... the odometry repeats one pose in this part of it (s), ...
const STILL: std::ops::Range<f64> = 5.0..6.0;
/// ... and comes late in this one (s), ...
const LATE: std::ops::Range<f64> = 10.0..20.0;
/// ... by this much (s).
const LATENCY: std::ops::Range<f64> = 0.1..0.5;
/// Share of the steps that are another step of the log in truth, and share of the poses that are missing.
const FOREIGN_AND_MISSING: (f32, f32) = (0.05, 0.02);

impl Input {
    pub fn new(log: &LaserLog, odometry: Option<&Trajectory>) -> Self {
        let numbers: Vec<usize> = (0..log.scans.len()).collect();
        let in_file = odometry.and_then(Trajectory::poses).map(|poses| {
            let planar = |pose: &Pose3| {
                let (_, _, heading) = pose.rotation.euler_angles();
                Pose2::new(pose.translation.vector.xy(), heading)
            };
            poses.iter().map(planar).map(Some).collect::<Vec<_>>()
        });
        let odometry = in_file.or_else(|| log.scans.iter().map(|scan| scan.odometry.map(Some)).collect());
        Self { log: log.clone(), odometry, numbers, clock: None, in_degrees: false, draw: 0 }
    }

    /// The odometry as a file would hold it.
    pub fn trajectory(&self) -> Option<Trajectory> {
        let poses = self.odometry.as_ref()?;
        let known: Vec<usize> = (0..poses.len()).filter(|&scan| poses[scan].is_some()).collect();
        let numbers = known.iter().map(|&scan| self.log.scans[scan].number as f64).collect();
        let stamps = self.clock.map(|off| known.iter().map(|&s| self.log.scans[s].time.unwrap_or(0.0) + off).collect());
        let unit = if self.in_degrees { 1f64.to_degrees() } else { 1.0 };
        let headings: Vec<f64> = poses.iter().flatten().map(|pose| pose.rotation.angle() * unit).collect();
        let written = poses.iter().flatten().zip(&headings);
        let poses: Vec<Pose3> =
            written.map(|(pose, &heading)| in_space(&Pose2::new(pose.translation.vector, heading))).collect();
        Some(Trajectory { numbers: Some(numbers), headings: Some(headings), stamps, ..Trajectory::from_poses(&poses) })
    }

    /// Applies one damage.
    pub fn damage(&mut self, what: &str) {
        match what {
            "scaled_up" => {
                self.change_odometry(|_, pose| Pose2::new(pose.translation.vector * 100.0, pose.rotation.angle()));
            }
            "scaled_down" => {
                self.change_odometry(|_, pose| Pose2::new(pose.translation.vector * 0.01, pose.rotation.angle()));
            }
            "scaled_twice" => {
                self.change_odometry(|_, pose| Pose2::new(pose.translation.vector * 2.0, pose.rotation.angle()));
            }
            "scaled_half" => {
                self.change_odometry(|_, pose| Pose2::new(pose.translation.vector * 0.5, pose.rotation.angle()));
            }
            "degrees" => self.in_degrees = true,
            "jumps" => {
                self.change_steps(
                    |scan, step| {
                        if scan % 100 == 50 { Pose2::new([5.0, -3.0].into(), 1.0) * step } else { step }
                    },
                );
            }
            "heading_drift" => {
                self.change_steps(|_, step| step * Pose2::rotation(0.02 * step.translation_norm()));
            }
            "reversed" => {
                if let Some(odometry) = &mut self.odometry {
                    odometry.reverse();
                }
            }
            "gaps" => {
                for (scan, pose) in self.odometry.iter_mut().flatten().enumerate() {
                    *pose = pose.filter(|_| scan % 200 < 100 || scan % 200 >= 150);
                }
            }
            "clock" => self.clock = Some(5.0),
            "every_fourth" => self.keep(|scan| scan % 4 == 0),
            "cut_out" => self.keep(|scan| scan % 150 < 100),
            "few_returns" => {
                self.change_ranges(
                    |scan, beam, range| {
                        if (scan == 0 || scan % 20 == 10) && beam % 40 != 0 { f32::NAN } else { range }
                    },
                );
            }
            "blind" => {
                self.change_ranges(|scan, _, range| if (100..115).contains(&(scan % 150)) { f32::NAN } else { range });
            }
            "narrow" => {
                let count = self.log.scans[0].ranges.len();
                let bearings = self.log.scans[0].bearings.clone();
                let is_ahead = move |beam: usize| bearings.of(beam).abs() < 0.79 && beam < count;
                self.change_ranges(|_, beam, range| if is_ahead(beam) { range } else { f32::NAN });
            }
            "short_range" => self.change_ranges(|_, _, range| if range < 8.0 { range } else { f32::NAN }),
            "backwards" => {
                let count = self.numbers.len();
                self.pick(&(0..count).rev().collect::<Vec<_>>());
            }
            "every_second" => self.keep(|scan| scan % 2 == 0),
            "every_third" => self.keep(|scan| scan % 3 == 0),
            "every_fifth" => self.keep(|scan| scan % 5 == 0),
            "every_tenth" => self.keep(|scan| scan % 10 == 0),
            "every_fifteenth" => self.keep(|scan| scan % 15 == 0),
            "near" => self.change_ranges(|_, _, range| if range < 5.0 { range } else { f32::NAN }),
            "first_half" => {
                let half = self.numbers.len() / 2;
                self.keep(|scan| scan < half);
            }
            "second_half" => {
                let half = self.numbers.len() / 2;
                self.keep(|scan| scan >= half);
            }
            "noisy" => self.change_ranges(|scan, beam, range| range + 0.05 * normal(scan, beam)),
            "glass" => {
                self.change_ranges(|scan, beam, range| if uniform(scan, beam / 8, 1) < 0.3 { f32::NAN } else { range });
            }
            "people" => {
                self.change_ranges(|scan, beam, range| {
                    if uniform(scan, beam / 12, 2) < 0.15 {
                        range.min(1.0 + 2.0 * uniform(scan, beam / 12, 3))
                    } else {
                        range
                    }
                });
            }
            "wheels_stop" => self.stop_wheels(),
            "coarse_beams" => self.change_ranges(|_, beam, range| if beam % 2 == 0 { range } else { f32::NAN }),
            other => panic!("{other} is no damage: {ALL:?}"),
        }
    }

    /// Another log after this one; its odometry goes on from this one's.
    pub fn append(&mut self, other: &Self) {
        let last = self.odometry.as_ref().and_then(|poses| poses.last().copied().flatten());
        if let (Some(poses), Some(theirs)) = (&mut self.odometry, &other.odometry) {
            let T = last.unwrap_or_default() * theirs[0].unwrap_or_default().inverse();
            poses.extend(theirs.iter().map(|pose| pose.map(|pose| T * pose)));
        }
        let count = self.log.scans.len();
        for scan in &other.log.scans {
            let mut scan = scan.clone();
            (scan.number, scan.time) = (scan.number + count, None);
            self.log.scans.push(scan);
        }
        self.numbers.extend(other.numbers.iter().map(|_| usize::MAX));
    }

    /// Odometry that stops for a second and then jumps, comes late, misses poses and has foreign steps.
    fn stop_wheels(&mut self) {
        let times = self.times();
        let chance = 40 + self.draw;
        let start = times[0] - STOP_PERIOD * (DRAW_SHIFT * self.draw as f64).fract();
        let Some(poses) = &mut self.odometry else { return };
        let old: Vec<Pose2> = poses.iter().map(|pose| pose.unwrap_or_default()).collect();
        let at = |time: f64| {
            let after = times.partition_point(|&other| other <= time).clamp(1, times.len() - 1);
            let share = (time - times[after - 1]) / (times[after] - times[after - 1]).max(1e-9);
            let motion = (old[after - 1].inverse() * old[after]).log();
            old[after - 1] * Pose2::exp(&(motion * share.clamp(0.0, 1.0)))
        };
        let told = |time: f64| {
            let period = ((time - start) / STOP_PERIOD).floor();
            let within = time - start - period * STOP_PERIOD;
            if STILL.contains(&within) {
                return at(time - (within - STILL.start));
            }
            let latency =
                LATENCY.start + (LATENCY.end - LATENCY.start) * f64::from(uniform(period as usize, 0, chance));
            at(if LATE.contains(&within) { time - latency } else { time })
        };
        let late: Vec<Pose2> = times.iter().map(|&time| told(time)).collect();
        let step = |scan: usize| late[scan - 1].inverse() * late[scan];
        let mut now = late[0];
        for (scan, pose) in poses.iter_mut().enumerate().skip(1) {
            let other = 1 + (uniform(scan, 1, chance) * (late.len() - 1) as f32) as usize;
            let is_foreign = uniform(scan, 2, chance) < FOREIGN_AND_MISSING.0;
            now *= step(if is_foreign { other.min(late.len() - 1) } else { scan });
            *pose = (uniform(scan, 3, chance) >= FOREIGN_AND_MISSING.1).then_some(now);
        }
    }

    /// Times of the scans (s); a second a scan where the log does not have all of them in order.
    fn times(&self) -> Vec<f64> {
        let told: Option<Vec<f64>> = self.log.scans.iter().map(|scan| scan.time).collect();
        let told = told.filter(|times| times.windows(2).all(|pair| pair[0] < pair[1]));
        told.unwrap_or_else(|| (0..self.log.scans.len()).map(|scan| scan as f64).collect())
    }

    fn change_odometry(&mut self, change: impl Fn(usize, Pose2) -> Pose2) {
        for (scan, pose) in self.odometry.iter_mut().flatten().enumerate() {
            *pose = pose.map(|pose| change(scan, pose));
        }
    }

    fn change_steps(&mut self, change: impl Fn(usize, Pose2) -> Pose2) {
        let Some(poses) = &mut self.odometry else { return };
        let old: Vec<Pose2> = poses.iter().map(|pose| pose.unwrap_or_default()).collect();
        let mut now = old[0];
        for scan in 1..old.len() {
            now *= change(scan, old[scan - 1].inverse() * old[scan]);
            poses[scan] = Some(now);
        }
    }

    fn keep(&mut self, is_kept: impl Fn(usize) -> bool) {
        self.pick(&(0..self.numbers.len()).filter(|&scan| is_kept(scan)).collect::<Vec<_>>());
    }

    /// Only these scans, in this order.
    fn pick(&mut self, kept: &[usize]) {
        self.log.scans = kept.iter().map(|&scan| self.log.scans[scan].clone()).collect();
        for (number, scan) in self.log.scans.iter_mut().enumerate() {
            scan.number = number;
        }
        self.odometry = self.odometry.as_ref().map(|poses| kept.iter().map(|&scan| poses[scan]).collect());
        self.numbers = kept.iter().map(|&scan| self.numbers[scan]).collect();
    }

    fn change_ranges(&mut self, change: impl Fn(usize, usize, f32) -> f32) {
        for (number, scan) in self.log.scans.iter_mut().enumerate() {
            for (beam, range) in scan.ranges.iter_mut().enumerate() {
                *range = change(number, beam, *range);
            }
        }
    }
}

/// A number from 0 to 1 by these three, the same at every run.
fn uniform(scan: usize, beam: usize, what: usize) -> f32 {
    let mut state = (scan as u64) << 32 ^ (beam as u64) << 8 ^ what as u64;
    for _ in 0..3 {
        state = (state ^ state >> 31).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(0x632B_E59B);
    }
    (state >> 40) as f32 / (1u32 << 24) as f32
}

/// A number of unit deviation.
fn normal(scan: usize, beam: usize) -> f32 {
    (0..12).map(|what| uniform(scan, beam, 10 + what)).sum::<f32>() - 6.0
}
