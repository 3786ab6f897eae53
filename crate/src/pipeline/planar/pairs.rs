//! Two scans and the motion between them by the scans alone: what the claims of a recording are compared with.

use std::rc::Rc;

use nalgebra::Matrix3;

use crate::geometry::Pose2;
use crate::map::local::{LocalMap, QueryScan};
use crate::odometry::planar::assess::assess;
use crate::odometry::planar::hypothesis::{Hypothesis, NUM_SEARCHED_POINTS, thinned};
use crate::odometry::planar::information::{information_less_normal_noise, softened_covariance};
use crate::odometry::planar::odometry_model::UNREGISTERED;
use crate::odometry::planar::{PlanarOptions, REGISTRATION_SIGMA};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::LikelihoodGrid;
use crate::registration::free_space::FreeSpaceTally;

/// So many pairs of scans or stretches of the way, at most, are compared all over a recording.
pub(in crate::pipeline) const COMPARED: usize = 48;

/// Pairs of these scans, spread over all of them: of each the one with the nearest later scan that makes a pair with it.
pub(in crate::pipeline) fn spread_pairs<T>(scans: &[usize], pair: impl Fn(usize, usize) -> Option<T>) -> Vec<T> {
    let stride = scans.len().div_ceil(COMPARED).max(1);
    let pair_of = |place: usize| {
        let apart = std::iter::successors(Some(1), |apart| Some(2 * apart));
        apart.map_while(|apart| scans.get(place + apart)).find_map(|&later| pair(scans[place], later))
    };
    (0..scans.len()).step_by(stride).filter_map(pair_of).collect()
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
