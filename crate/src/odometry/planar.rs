//! The chain: each scan is registered to the map of the scans before it.

use std::rc::Rc;

use serde::{Deserialize, Serialize};

use crate::geometry::Pose2;
use crate::map::local::{LocalMap, MetricName, PlanarRegistration};
use crate::odometry::assessment::{Assessment, MIN_POINTS, Status, assess};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::{LikelihoodGrid, SearchWindow};
use crate::registration::icp::IcpOptions;

/// What a registration starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum InitialGuess {
    /// Where the last scan was.
    Identity,
    /// The last motion once more.
    ConstantVelocity,
    /// The best pose in a window around constant velocity, by correlative search.
    Correlative,
}

/// Options of planar odometry.
#[derive(Debug, Clone)]
pub struct PlanarOptions {
    /// How many earlier scans form the local map.
    pub map_capacity: usize,
    /// What a registration starts from.
    pub initial_guess: InitialGuess,
    /// Half widths of the correlative search.
    pub search: SearchWindow,
    /// What a correspondence measures.
    pub metric: MetricName,
    /// The registration loop.
    pub icp: IcpOptions,
}

/// Where a scan was found, and why that is believed or not.
pub struct FrameEstimate {
    /// Pose of the sensor in the frame of the first scan. Where the frame is lost, it is the prediction.
    pub T_world_sensor: Pose2,
    /// The registration to the local map; `None` for the first scan and for scans without points.
    pub registration: Option<PlanarRegistration>,
    /// Whether it is believed.
    pub assessment: Assessment,
}

/// Scan-to-map odometry in the plane. The world frame is the frame of the first scan.
pub struct Odometry {
    options: PlanarOptions,
    map: LocalMap,
    T_world_last: Pose2,
    /// The last motion, from one scan to the next, in the frame of the earlier.
    last_motion: Pose2,
}

impl Odometry {
    /// Odometry without any scan so far; the first one will be at `T_world_first`.
    pub fn new(options: PlanarOptions, T_world_first: Pose2) -> Self {
        let map = LocalMap::new(options.map_capacity);
        Self { options, map, T_world_last: T_world_first, last_motion: Pose2::identity() }
    }

    /// Registers the next scan, which is expected at this motion from the last one; without any, the last motion is
    /// expected once more. A scan that is lost is not added to the map; the scans after it start from the prediction all
    /// the same.
    pub fn register_frame(&mut self, scan: &Rc<PlanarScan>, motion: Option<Pose2>) -> FrameEstimate {
        let prediction = self.T_world_last * motion.unwrap_or(self.last_motion);
        let unregistered = |assessment| FrameEstimate { T_world_sensor: prediction, registration: None, assessment };
        let estimate = if scan.points.len() < MIN_POINTS {
            unregistered(Assessment::too_few_points(scan.points.len()))
        } else if self.map.is_empty() {
            unregistered(Assessment::first())
        } else {
            self.register_to_map(scan, &prediction, motion.is_some())
        };
        if estimate.assessment.status != Status::Lost {
            self.last_motion = self.T_world_last.inverse() * estimate.T_world_sensor;
            self.map.insert(Rc::clone(scan), estimate.T_world_sensor);
        }
        self.T_world_last = estimate.T_world_sensor;
        estimate
    }

    /// Registers from the guess that the options ask for; where the result is not good and a search is allowed, once
    /// more from the best pose in a wide window, and the better of the two is kept.
    ///
    /// Measured motion is a better guess than any search: one runs only where that guess leads nowhere.
    fn register_to_map(&self, scan: &PlanarScan, prediction: &Pose2, is_measured: bool) -> FrameEstimate {
        if is_measured {
            let measured = self.register_from(scan, *prediction, prediction);
            if measured.assessment.status == Status::Good || self.options.initial_guess != InitialGuess::Correlative {
                return measured;
            }
            let searched = self.register_by_search(scan, prediction);
            return if searched.assessment.agreement > measured.assessment.agreement { searched } else { measured };
        }
        match self.options.initial_guess {
            InitialGuess::Identity => self.register_from(scan, self.T_world_last, prediction),
            InitialGuess::ConstantVelocity => self.register_from(scan, *prediction, prediction),
            InitialGuess::Correlative => self.register_by_search(scan, prediction),
        }
    }

    fn register_by_search(&self, scan: &PlanarScan, prediction: &Pose2) -> FrameEstimate {
        let window = self.options.search;
        let grid = LikelihoodGrid::new(&self.map.points());
        let search = |center: &Pose2, window| {
            let guess = grid.search(&scan.points, center, window).map_or(*center, |best| best.T_target_source);
            self.register_from(scan, guess, prediction)
        };
        let first = search(prediction, window);
        if first.assessment.status == Status::Good {
            return first;
        }
        let wide = SearchWindow { translation: 2.0 * window.translation, rotation: std::f64::consts::PI };
        let second = search(&self.T_world_last, wide);
        if second.assessment.agreement > first.assessment.agreement { second } else { first }
    }

    fn register_from(&self, scan: &PlanarScan, guess: Pose2, prediction: &Pose2) -> FrameEstimate {
        let registration = self.map.register(scan, guess, self.options.metric, &self.options.icp);
        let assessment = assess(&registration, self.map.free_space(scan, &registration.T_target_source));
        let believed = assessment.status != Status::Lost;
        FrameEstimate {
            T_world_sensor: if believed { registration.T_target_source } else { *prediction },
            registration: Some(registration),
            assessment,
        }
    }
}
