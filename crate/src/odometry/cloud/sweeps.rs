//! Odometry of a lidar that moves while it turns: every sweep is straightened by the motion that its registration finds.
//!
//! Each point has its time, and the sensor is taken to move with a constant velocity during a sweep: at first that of the last one,
//! then that from the last sweep to this one (Vizzo et al., "KISS-ICP", RA-L 8 (2023), section III-A, straightens once, with the last
//! velocity). Sweeps are registered as they are seen from their middle, where an error of the velocity does the least harm. The first
//! one is straightened when the second one is there, and the first eight are registered again. Where sweeps fit one another better as
//! they are, they are left so. A gyroscope, where there is one, proposes another motion to begin with.

use nalgebra::{Translation3, UnitQuaternion, Vector3, Vector6};

use super::gyro::Gyro;
use super::options::CloudOptions;
use super::prepared::PreparedCloud;
use super::skew_test::{SkewTest, left_over};
use super::{CloudEstimate, CloudOdometry, Found, RegisteredCloud};
use crate::error::Result;
use crate::geometry::quantile::quantile;
use crate::geometry::{PointCloud, Pose3, RigidMotion};
use crate::odometry::assessment::Status;
use crate::preprocess::deskew::{SweepMotion, deskew};

/// A sweep's estimate, and the motion that straightens its points.
pub struct SweepEstimate {
    /// The pose of the sensor at the time stamp of the frame, in the frame of the first one at its own.
    pub estimate: CloudEstimate,
    /// Velocities of the sensor during sweeps that are known from now on, with the numbers of the sweeps: the tangent of its motion in its
    /// own frame in a second (rotation first). That of the first sweep comes with the second one's; where sweeps turn out to have been
    /// straightened already, all are zero. Those of the first ones come once more when these are registered again, ...
    pub velocities: Vec<(usize, Vector6<f64>)>,
    /// ... with their poses from now on.
    pub earlier: Vec<(usize, Pose3)>,
}

/// Odometry of sweeps whose points have times. The world frame is that of the sensor at the time stamp of the first sweep.
pub struct SweepOdometry {
    pub(super) clouds: CloudOdometry,
    pub(super) options: CloudOptions,
    num_sweeps: usize,
    /// The first sweep with its number, as long as it is not straightened.
    pub(super) first: Option<(usize, Sweep)>,
    /// The first sweep in its middle, and at its time stamp.
    pub(super) T_world_first: Pose3,
    pub(super) T_world_stamp_of_first: Pose3,
    /// The first sweeps, as long as they are to be registered again.
    pub(super) start: Option<Vec<Started>>,
    /// When the last registered sweep was measured (s).
    last_time: Option<f64>,
    pub(super) velocity: Option<Vector6<f64>>,
    /// Whether the last registered sweep, whose velocity this is, was good.
    pub(super) is_last_good: bool,
    /// Whether the first two sweeps fit one another about as well at another rate of turn.
    pub(super) is_rate_open: bool,
    pub(super) gyro: Gyro,
    skew_test: SkewTest,
    /// The last sweep as it is, where the test is open.
    last_as_it_is: Option<PreparedCloud>,
    /// Furthest that the ends of a sweep were moved against each other (m).
    largest_bend: f64,
    has_times: bool,
}

/// A sweep as it was measured.
pub(super) struct Sweep {
    /// With normals, once they are estimated.
    cloud: PointCloud,
    /// The velocity by which it was straightened when its normals were estimated.
    velocity_of_normals: Vector6<f64>,
    /// From the time stamp to the middle of the sweep (s).
    middle: f64,
    /// Duration (s).
    pub(super) span: f64,
    /// When its middle was measured (s), where the frame has a time stamp.
    time: Option<f64>,
    /// Median distance of the points from the sensor (m).
    range: f64,
}

/// One of the first sweeps, which are registered again.
pub(super) struct Started {
    pub(super) number: usize,
    pub(super) sweep: Sweep,
    /// When its middle was measured, after that of the first one (s).
    pub(super) time: f64,
    pub(super) T_world_middle: Pose3,
    pub(super) velocity: Vector6<f64>,
}

/// A sweep that was found: its velocity, as it was registered, and where.
pub(super) type FoundSweep = (Vector6<f64>, PreparedCloud, Found);

impl Sweep {
    fn new(mut cloud: PointCloud, stamp: Option<f64>) -> Self {
        cloud.normals.take_if(|_| cloud.times.is_some());
        let span = cloud.times.as_ref().map_or(0.0, crate::geometry::PointTimes::span);
        let middle = cloud.times.as_ref().map_or(0.0, |times| times.origin + 0.5 * span);
        let mut ranges: Vec<f64> = cloud.positions.iter().map(|point| f64::from(point.length())).collect();
        let range = quantile(&mut ranges, 0.5).unwrap_or(0.0);
        let velocity_of_normals = Vector6::zeros();
        Self { cloud, velocity_of_normals, middle, span, time: stamp.map(|stamp| stamp + middle), range }
    }

    /// As it would be seen at once from where the sensor was in the middle. Normals are estimated anew where the velocity differs much
    /// from that of the last time, and turned otherwise.
    pub(super) fn straight(&mut self, velocity: &Vector6<f64>, options: &CloudOptions) -> PreparedCloud {
        let Some(times) = &self.cloud.times else { return PreparedCloud::from_cloud(self.cloud.clone()) };
        let straight = deskew(self.cloud.clone(), velocity, self.middle);
        if self.cloud.normals.is_some() && self.is_near(&(velocity - self.velocity_of_normals), options) {
            return PreparedCloud::from_cloud(straight);
        }
        let prepared = PreparedCloud::with_normals(straight, options);
        let back = SweepMotion::new(times, &-velocity, self.middle);
        self.cloud.normals = prepared.cloud().normals.as_ref().map(|normals| back.turned(normals, times));
        self.velocity_of_normals = *velocity;
        prepared
    }

    /// Whether this change of the velocity moves its ends as little as the last step of a registration that has converged.
    pub(super) fn is_near(&self, change: &Vector6<f64>, options: &CloudOptions) -> bool {
        self.bend(change) < super::MOVING_STEP * options.voxel_size
    }

    /// Times of points after the middle (s).
    pub(super) fn times_of(&self, points: &[usize]) -> Vec<f64> {
        let times = self.cloud.times.iter();
        let after = times
            .flat_map(|times| points.iter().map(|&point| times.origin + f64::from(times.offsets[point]) - self.middle));
        after.collect()
    }

    /// How far this velocity moves a point at the median range from the beginning of the sweep to its end (m).
    fn bend(&self, velocity: &Vector6<f64>) -> f64 {
        self.span * (velocity.fixed_rows::<3>(0).norm() * self.range + velocity.fixed_rows::<3>(3).norm())
    }

    /// The pose at the time stamp, from that in the middle.
    pub(super) fn at_stamp(&self, T_world_middle: &Pose3, velocity: &Vector6<f64>) -> Pose3 {
        T_world_middle * <Pose3 as RigidMotion>::exp(&(-self.middle * velocity))
    }
}

impl SweepOdometry {
    /// Odometry without sweeps.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(options: CloudOptions) -> Result<Self> {
        Ok(Self {
            clouds: CloudOdometry::new(options)?,
            options,
            num_sweeps: 0,
            first: None,
            T_world_first: Pose3::identity(),
            T_world_stamp_of_first: Pose3::identity(),
            start: None,
            last_time: None,
            velocity: None,
            is_last_good: false,
            is_rate_open: false,
            gyro: Gyro::default(),
            skew_test: SkewTest::default(),
            last_as_it_is: None,
            largest_bend: 0.0,
            has_times: false,
        })
    }

    /// Goes on with an odometry whose clouds turned out to be bent: the last one, of the frame before `num_sweeps`, with its times and its stamp
    /// (s), was measured with this velocity.
    pub(crate) fn resumed(
        clouds: CloudOdometry,
        (last, stamp): (PointCloud, Option<f64>),
        velocity: Vector6<f64>,
        num_sweeps: usize,
    ) -> Result<Self> {
        let options = clouds.options;
        let (mut resumed, mut last) = (Self::new(options)?, Sweep::new(last, stamp));
        (resumed.clouds, resumed.num_sweeps, resumed.has_times) = (clouds, num_sweeps, true);
        resumed.clouds.begin(last.straight(&velocity, &options));
        (resumed.last_time, resumed.velocity, resumed.is_last_good) = (last.time, Some(velocity), true);
        (resumed.largest_bend, resumed.skew_test.verdict) = (last.bend(&velocity), Some(true));
        Ok(resumed)
    }

    /// What was done about the motion of the sensor during sweeps, and what became of a gyroscope, in whole sentences.
    pub fn notes(&self) -> Vec<String> {
        let on_skew = if self.is_refuted() {
            Some(
                "The times of points are not used: sweeps fit one another better as they are. They seem to have been straightened \
                 already"
                    .to_owned(),
            )
        } else {
            self.has_times.then(|| {
                format!(
                    "Sweeps are straightened: the motion of the sensor moves the end of a sweep against its beginning by up to {:.2} m, \
                     at the median range of its points",
                    self.largest_bend
                )
            })
        };
        on_skew.into_iter().chain(self.gyro.note()).collect()
    }

    /// Whether sweeps fit one another better as they are than straightened: they seem to have been straightened already.
    pub fn is_refuted(&self) -> bool {
        self.skew_test.verdict == Some(false)
    }

    /// As [`CloudOdometry::are_in_largest_part`].
    pub fn are_in_largest_part(&self) -> Vec<bool> {
        self.clouds.are_in_largest_part()
    }

    /// The sweep that was registered last, as it is seen from its middle, in a world of its own; `None` before the start is registered
    /// again.
    pub(crate) fn last_registered(&self) -> Option<RegisteredCloud<'_>> {
        self.clouds.last_registered().filter(|_| self.first.is_none() && self.start.is_none())
    }

    /// A motion of that world as one of the world of the poses.
    pub(crate) fn of_poses(&self, motion: &Pose3) -> Pose3 {
        self.T_world_stamp_of_first.inverse() * motion * self.T_world_stamp_of_first
    }

    /// As [`CloudOdometry::connect`].
    pub(crate) fn connect(&mut self, clouds: [usize; 2]) {
        self.clouds.connect(clouds);
    }

    /// Adds what a gyroscope measured, up to the end of the next sweep: times (s, as the stamps of sweeps) and angular velocities in the
    /// frame of the lidar (rad/s). It is used where registrations do not refute it.
    pub fn add_gyro(&mut self, readings: &[(f64, Vector3<f64>)]) {
        self.gyro.add(readings);
    }

    /// Registers the next sweep, downsampled, whose times count from `stamp` (s). A sweep without times is taken as it is.
    pub fn register_sweep(&mut self, cloud: PointCloud, stamp: Option<f64>) -> SweepEstimate {
        let (mut sweep, number) = (Sweep::new(cloud, stamp), self.num_sweeps);
        self.num_sweeps += 1;
        self.has_times |= sweep.cloud.times.is_some();
        if self.clouds.last.is_none() {
            return self.begin(number, sweep);
        }
        let predicted = self.find(&mut sweep);
        let mut found = match self.find_turned(&mut sweep, predicted) {
            Ok(found) => self.without_look_alike(&mut sweep, found),
            Err(lost) => return self.lost(number, &sweep, *lost),
        };
        self.doubt_unknown_turn(&sweep, &mut found);
        let (mut velocity, frame, found) = found;
        let mut velocities = vec![(number, velocity)];
        let time = self.start.iter().flatten().last().map_or(0.0, |last| last.time) + self.interval(&sweep);
        if let Some((first_number, first)) = self.first.take() {
            self.T_world_stamp_of_first = first.at_stamp(&Pose3::identity(), &velocity);
            velocities.push((first_number, velocity));
            let (number, T_world_middle) = (first_number, Pose3::identity());
            self.start = Some(vec![Started { number, sweep: first, time: 0.0, T_world_middle, velocity }]);
        }
        self.test_skew(&mut sweep, &velocity, &frame, &found);
        self.compare_gyro(&sweep, &found);
        let mut estimate = self.clouds.accept(frame, found);
        if let Some(as_it_is) = self.last_as_it_is.take_if(|_| self.skew_test.verdict.is_some())
            && self.is_refuted()
        {
            self.clouds.begin(as_it_is);
            // As it is, a sweep is seen from where its time stamp is.
            (velocity, self.T_world_stamp_of_first) = (Vector6::zeros(), self.T_world_first);
            velocities = (0..=number).map(|number| (number, velocity)).collect();
        }
        (self.last_time, self.velocity) = (sweep.time, velocities.first().map(|(_, velocity)| *velocity));
        self.is_last_good = estimate.assessment.status == Status::Good;
        self.largest_bend = self.largest_bend.max(sweep.bend(&velocity));
        estimate.T_world_sensor = self.in_world(&sweep, &estimate.T_world_sensor, &velocity);
        let found = SweepEstimate { estimate, velocities, earlier: Vec::new() };
        let T_world_middle = self.clouds.T_world_last;
        self.with_start(found, Started { number, sweep, time, T_world_middle, velocity })
    }

    /// Registers a sweep from the last velocity, and from what a gyroscope says of it: from that alone where it is confirmed and comes to a
    /// good end, and otherwise from where it comes to the better one.
    fn find(&mut self, sweep: &mut Sweep) -> std::result::Result<FoundSweep, Box<CloudEstimate>> {
        let (velocity, motion) =
            (self.velocity.filter(|_| !self.is_refuted()).unwrap_or_default(), self.clouds.last_motion);
        let Some(measured) = self.motion_by_gyro(sweep) else { return self.find_from(sweep, velocity) };
        self.clouds.last_motion = measured;
        let velocity_by_gyro = if self.is_refuted() { velocity } else { measured.log() / self.interval(sweep) };
        self.straighten_first(&velocity_by_gyro);
        let by_gyro = self.find_from(sweep, velocity_by_gyro);
        self.clouds.last_motion = motion;
        if self.gyro.is_confirmed() && by_gyro.as_ref().is_ok_and(|(_, _, found)| found.candidate.is_good()) {
            return by_gyro;
        }
        self.straighten_first(&velocity);
        let from_last = self.find_from(sweep, velocity);
        match (by_gyro, from_last) {
            (Ok(by_gyro), Ok(from_last)) if from_last.2.candidate.is_no_worse_than(&by_gyro.2.candidate) => {
                Ok(from_last)
            }
            (Err(_), from_last) => from_last,
            (Ok(by_gyro), _) => {
                self.straighten_first(&by_gyro.0);
                Ok(by_gyro)
            }
        }
    }

    /// The motion from the last sweep to this one with the turn that a gyroscope measured, and the rest as it was the last time.
    pub(super) fn motion_by_gyro(&self, sweep: &Sweep) -> Option<Pose3> {
        let (from, to) = self.last_time.zip(sweep.time)?;
        let turn = UnitQuaternion::from_scaled_axis(self.gyro.rate(from, to)? * (to - from));
        Some(Pose3::from_parts(Translation3::from(self.clouds.last_motion.translation.vector), turn))
    }

    /// Compares a gyroscope with the turn that a good registration found.
    fn compare_gyro(&mut self, sweep: &Sweep, found: &Found) {
        let Some((from, to)) = self.last_time.zip(sweep.time).filter(|_| found.candidate.is_good()) else { return };
        self.gyro.compare(from, to, &(self.clouds.T_world_last.inverse() * found.T_world_sensor).rotation);
    }

    /// Straightens the first sweep, as long as that can still be done.
    pub(super) fn straighten_first(&mut self, velocity: &Vector6<f64>) {
        if let Some((_, first)) = &mut self.first {
            self.clouds.begin(first.straight(velocity, &self.options));
        }
    }

    /// [`find_after`](Self::find_after) the time from the last sweep to this one.
    pub(super) fn find_from(
        &mut self,
        sweep: &mut Sweep,
        velocity: Vector6<f64>,
    ) -> std::result::Result<FoundSweep, Box<CloudEstimate>> {
        self.find_after(sweep, velocity, (self.interval(sweep), None))
    }

    /// Compares this sweep and the last one as they are and straightened, where that makes a difference and is not decided. Normals are estimated
    /// anew for both: turned ones fit the straightened sweeps for which they were estimated, whichever is right.
    fn test_skew(&mut self, sweep: &mut Sweep, velocity: &Vector6<f64>, frame: &PreparedCloud, found: &Found) {
        if self.skew_test.verdict.is_some() || sweep.bend(velocity) < self.options.voxel_size {
            self.last_as_it_is = None;
            return;
        }
        let as_it_is = sweep.straight(&Vector6::zeros(), &self.options);
        if let (Some(last), Some(last_as_it_is)) = (&self.clouds.last, &self.last_as_it_is) {
            let T_last_this = self.clouds.T_world_last.inverse() * found.T_world_sensor;
            let left = |pair: [&PreparedCloud; 2]| left_over(pair, &T_last_this, &self.options);
            self.skew_test.add(left([last_as_it_is, &as_it_is]), left([last, frame]));
        }
        self.last_as_it_is = Some(as_it_is);
    }

    /// Time from the last registered sweep to this one (s). Where stamps do not tell, or stand still, a sweep follows the last one.
    pub(super) fn interval(&self, sweep: &Sweep) -> f64 {
        let by_stamps = sweep.time.zip(self.last_time).map(|(time, last)| time - last);
        by_stamps.filter(|interval| *interval > 0.0).unwrap_or(if sweep.span > 0.0 { sweep.span } else { 1.0 })
    }

    fn begin(&mut self, number: usize, mut sweep: Sweep) -> SweepEstimate {
        let estimate = self.clouds.begin(sweep.straight(&Vector6::zeros(), &self.options));
        if estimate.assessment.status != Status::Lost {
            self.last_time = sweep.time;
            self.first = Some((number, sweep));
        }
        SweepEstimate { estimate, velocities: Vec::new(), earlier: Vec::new() }
    }

    fn lost(&self, number: usize, sweep: &Sweep, mut estimate: CloudEstimate) -> SweepEstimate {
        let velocity = self.velocity.unwrap_or_default();
        estimate.T_world_sensor = self.in_world(sweep, &estimate.T_world_sensor, &velocity);
        SweepEstimate { estimate, velocities: vec![(number, velocity)], earlier: Vec::new() }
    }

    pub(super) fn in_world(&self, sweep: &Sweep, T_world_middle: &Pose3, velocity: &Vector6<f64>) -> Pose3 {
        let T = self.T_world_stamp_of_first.inverse() * sweep.at_stamp(T_world_middle, velocity);
        <Pose3 as RigidMotion>::renormalized(&T)
    }
}
