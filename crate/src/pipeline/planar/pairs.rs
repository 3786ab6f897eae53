//! Pairs of scans and the motion between them by the scans alone: what every claim of a recording is compared with.

use std::rc::Rc;

use nalgebra::Matrix3;

use crate::geometry::Pose2;
use crate::map::local::{LocalMap, QueryScan};
use crate::odometry::assessment::Status;
use crate::odometry::planar::assess::assess;
use crate::odometry::planar::hypothesis::{Hypothesis, NUM_SEARCHED_POINTS, fits_as_well, thinned};
use crate::odometry::planar::information::{information_less_normal_noise, softened_covariance};
use crate::odometry::planar::odometry_model::UNREGISTERED;
use crate::odometry::planar::{PlanarOptions, REGISTRATION_SIGMA, RIVAL_SHARE_UNKNOWN_MOTION};
use crate::pipeline::recorded_scan::RecordedScans;
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::LikelihoodGrid;
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::free_space::beams::RangeProfile;

/// About this many pairs are compared, and always fewer than twice as many.
const NUM_PAIRS: usize = 48;
/// Largest number of scans between the two of a pair: the motion is then small enough for both to see the same.
const MAX_APART: usize = 64;
/// Two scans tell a motion where a smaller share of their returns than this agrees without any.
const MAX_STILL: f64 = 0.6;

/// A pair of scans that look different, as far as there are such.
pub struct ScanPair {
    pub(super) first: usize,
    pub(super) second: usize,
    target: Rc<PlanarScan>,
    source: Rc<PlanarScan>,
    /// By the scans alone, where nothing speaks against it.
    best: Option<Hypothesis>,
}

/// Pairs all over the log, registered by the scans alone.
pub fn registered_pairs(scans: &RecordedScans) -> Vec<ScanPair> {
    let stride = (scans.all.len() / NUM_PAIRS).max(1);
    let options = scans.settings.odometry_options();
    let pair = |first: usize| {
        let target = scans.cleaned(first);
        let profile = RangeProfile::new(&target.points);
        let apart = std::iter::successors(Some(1), |apart| Some(2 * apart)).take_while(|&apart| apart <= MAX_APART);
        let mut later = apart.map(|apart| first + apart).take_while(|&second| second < scans.all.len()).peekable();
        while let Some(second) = later.next() {
            let source = scans.cleaned(second);
            if later.peek().is_none() || still(&profile, &target, &source) < MAX_STILL {
                let best = Some(register_alone(&target, &source, &options).0).filter(is_good);
                return Some(ScanPair { first, second, target, source, best });
            }
        }
        None
    };
    (0..scans.all.len()).step_by(stride).filter_map(pair).collect()
}

impl ScanPair {
    /// The motions between the two by the scans alone, with their covariances: the best one, and the one next to what is `given`
    /// where the scans fit about as well there. A place that repeats itself contradicts nothing.
    pub(super) fn registrations(&self, given: Pose2, options: &PlanarOptions) -> Vec<(Pose2, Matrix3<f64>)> {
        let at_given = Some(register_pair(&self.target, &self.source, given, options).0).filter(is_good);
        let is_as_good = |given: &Hypothesis| {
            self.best.as_ref().is_none_or(|best| fits_as_well(given, best, RIVAL_SHARE_UNKNOWN_MOTION))
        };
        let at_given = at_given.filter(is_as_good);
        self.best.iter().chain(&at_given).map(known).collect()
    }
}

fn is_good(found: &Hypothesis) -> bool {
    found.assessment.status == Status::Good
}

/// Share of the returns of two scans that agree without any motion.
fn still(profile: &RangeProfile, target: &PlanarScan, source: &PlanarScan) -> f64 {
    let mut seen = profile.tally(source.points.iter().copied());
    seen += RangeProfile::new(&source.points).tally(target.points.iter().copied());
    seen.agreeing as f64 / (target.points.len() + source.points.len()).max(1) as f64
}

/// A registered motion with its covariance.
pub(super) fn known(Hypothesis { registration, .. }: &Hypothesis) -> (Pose2, Matrix3<f64>) {
    let information = information_less_normal_noise(registration);
    (registration.T_target_source, softened_covariance(&information, REGISTRATION_SIGMA, UNREGISTERED))
}

/// A scan registered to another one from the best pose around no motion.
pub(super) fn register_alone(
    target: &Rc<PlanarScan>,
    source: &PlanarScan,
    options: &PlanarOptions,
) -> (Hypothesis, FreeSpaceTally) {
    let searched = thinned(&source.points, NUM_SEARCHED_POINTS);
    let found = LikelihoodGrid::new(&target.points).search(&searched, &Pose2::identity(), options.search);
    register_pair(target, source, found.map_or_else(Pose2::identity, |found| found.T_target_source), options)
}

/// A scan registered to another one from a guess, and what the two see of each other then.
pub(super) fn register_pair(
    target: &Rc<PlanarScan>,
    source: &PlanarScan,
    guess: Pose2,
    options: &PlanarOptions,
) -> (Hypothesis, FreeSpaceTally) {
    let (mut map, source) = (LocalMap::new(1, options.metric), &QueryScan::new(source));
    map.insert(Rc::clone(target), Pose2::identity());
    let registration = map.register(source, guess, &options.icp);
    let seen = map.free_space(source, &registration.T_target_source);
    let assessment = assess(&registration, seen);
    (Hypothesis { registration, assessment }, seen)
}
