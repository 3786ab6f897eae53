//! Loop closure of clouds: places to which a lidar comes back are recognised, and the poses of all clouds corrected.
//!
//! The odometry's map forgets what was last seen long ago, so that a place that is driven through again is mapped again, however far the
//! path has drifted. Stretches of the way are kept as places. Each new one is searched for in the earlier ones that the drift may have
//! brought it to: it is registered from a grid of positions, and recognised where it fits one place alone, no free space contradicts that,
//! and the next place confirms it. The pose graph distributes the drift over the path.
//! Read [`CloudLoops::add`] first.

mod place;

use nalgebra::Vector3;

use self::place::{Fit, Place, Stretch, options_of_places};
use super::spatial::{FrameMotions, LoopReport, between_factor};
use crate::geometry::{Pose3, RigidMotion};
use crate::graph::pose_graph::{BetweenFactor, SpatialFactor, optimize_poses};
use crate::odometry::cloud::{CloudOptions, LIMITS, MIN_LEAD, RegisteredCloud};

/// Length of a place (voxels): two and a half median ranges.
const PLACE_LENGTH: f64 = 100.0;
/// Largest drift, as a share of the path. Lidar odometry drifts by 0.5 % in the mean on KITTI (Vizzo et al., "KISS-ICP", RA-L 2023), by 0.13 %
/// at most in `cargo measure streets`. Floors of a building that look alike lie 1.5 % of the path from one to the next apart.
const MAX_DRIFT: f64 = 0.01;
/// Earlier places that one is searched for in, the nearest first.
const MAX_CANDIDATES: usize = 2;
/// A loop whose weight in the solution is less is no loop.
const MIN_WEIGHT: f64 = 0.5;

/// A registered cloud.
struct Node {
    /// Its number among all frames, ...
    frame: u32,
    /// ... and among those that are registered.
    number: usize,
    T_world_cloud: Pose3,
    /// Length of the path up to it (m).
    path_length: f64,
}

/// Loop detection and closure along a chain of clouds.
pub struct CloudLoops {
    options: CloudOptions,
    /// Those by which places are registered.
    of_places: CloudOptions,
    nodes: Vec<Node>,
    /// The pose of the last cloud by the odometry alone.
    T_odometry_last: Pose3,
    places: Vec<Place>,
    /// The place that is being driven through.
    stretch: Option<Stretch>,
    /// The factor of each node to the next one.
    chain: Vec<SpatialFactor>,
    loops: Vec<SpatialFactor>,
    /// A place that was found in an earlier one, until the next one confirms it.
    unconfirmed: Option<SpatialFactor>,
    /// How many of the loops were there when the graph was last solved.
    num_solved: usize,
    report: LoopReport,
}

impl CloudLoops {
    /// Without clouds, of an odometry with these options.
    pub fn new(options: CloudOptions) -> Self {
        Self {
            options,
            of_places: options_of_places(&options),
            nodes: Vec::new(),
            T_odometry_last: Pose3::identity(),
            places: Vec::new(),
            stretch: None,
            chain: Vec::new(),
            loops: Vec::new(),
            unconfirmed: None,
            num_solved: 0,
            report: LoopReport::default(),
        }
    }

    /// The loops that have been closed.
    pub fn report(&self) -> LoopReport {
        self.report
    }

    /// The motion of the world from poses by the odometry alone to poses with the loops, at the last cloud.
    pub fn correction(&self) -> Pose3 {
        self.nodes.last().map_or_else(Pose3::identity, |last| last.T_world_cloud * self.T_odometry_last.inverse())
    }

    /// Numbers of the clouds, in the order of their registration, that each loop connects.
    pub(crate) fn connections(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.loops.iter().map(|found| [found.from, found.to].map(|node| self.nodes[node].number))
    }

    /// Adds the cloud that was registered last, of the frame of this number.
    pub fn add(&mut self, frame: u32, registered: &RegisteredCloud<'_>) {
        let RegisteredCloud { cloud, T_world_cloud: T_odometry, number, step_information } = registered;
        let step = self.T_odometry_last.inverse() * T_odometry;
        let node = self.nodes.len();
        let (T_world_cloud, path_length) = match self.nodes.last() {
            None => (*T_odometry, 0.0),
            Some(last) => {
                self.chain.push(between_factor(node - 1, node, step, step_information));
                (last.T_world_cloud * step, last.path_length + step.translation_norm())
            }
        };
        self.T_odometry_last = *T_odometry;
        self.nodes.push(Node { frame, number: *number, T_world_cloud, path_length });
        let is_full =
            |stretch: &mut Stretch| path_length - stretch.path_length > PLACE_LENGTH * self.options.voxel_size;
        if let Some(full) = self.stretch.take_if(is_full) {
            self.finish_place(full);
        }
        // Within a stretch, poses by the odometry are one map.
        match &mut self.stretch {
            Some(stretch) => stretch.add(cloud, T_odometry),
            None => self.stretch = Some(Stretch::new(node, cloud, *T_odometry, path_length, &self.of_places)),
        }
    }

    /// No cloud will follow: the place that is being driven through is searched for, too.
    pub fn finish(&mut self) {
        if let Some(stretch) = self.stretch.take() {
            self.finish_place(stretch);
        }
    }

    fn finish_place(&mut self, stretch: Stretch) {
        self.places.push(stretch.into_place());
        self.detect();
    }

    /// Searches for the last place in earlier ones.
    fn detect(&mut self) {
        let here = self.places.len() - 1;
        let mut found: Vec<SpatialFactor> = self.unconfirmed.take().into_iter().collect();
        for place in self.candidates(here) {
            found.extend(self.recognise(place, here));
        }
        // Two that tell the same drift confirm each other.
        let Some(&last) = found.last() else { return };
        let confirmed: Vec<SpatialFactor> =
            found.iter().filter(|other| **other != last && self.agree(other, &last)).copied().collect();
        if confirmed.is_empty() {
            self.unconfirmed = Some(last);
            return;
        }
        for factor in confirmed.into_iter().chain([last]) {
            if !self.loops.contains(&factor) {
                self.loops.push(factor);
            }
        }
        self.unconfirmed = Some(last);
    }

    /// Earlier places that may be the same as this one.
    fn candidates(&self, here: usize) -> Vec<usize> {
        let this = self.node_of(here);
        let reach = PLACE_LENGTH * self.options.voxel_size;
        let distance = |place: &usize| {
            let there = self.node_of(*place);
            let is_forgotten = this.path_length - there.path_length > self.options.max_age() + reach;
            let apart = (this.T_world_cloud.translation.vector - there.T_world_cloud.translation.vector).norm();
            (is_forgotten && apart < reach + self.drift_between(*place, here)).then_some(apart)
        };
        let mut near: Vec<(f64, usize)> = (0..here).filter_map(|place| Some((distance(&place)?, place))).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter().take(MAX_CANDIDATES).map(|(_, place)| place).collect()
    }

    fn node_of(&self, place: usize) -> &Node {
        &self.nodes[self.places[place].node]
    }

    /// The most that the path between two places may have drifted (m): along it, or by way of a loop.
    fn drift_between(&self, from: usize, to: usize) -> f64 {
        let length = |node: usize| self.nodes[node].path_length;
        let [from, to] = [from, to].map(|place| self.places[place].node);
        let along = |a: usize, b: usize| (length(a) - length(b)).abs();
        let by_loop = |found: &SpatialFactor| along(from, found.from) + along(found.to, to);
        let shortest = self.loops.iter().map(by_loop).fold(along(from, to), f64::min);
        MAX_DRIFT * shortest
    }

    /// The pose of a place in an earlier one, if it is the same and nowhere else.
    fn recognise(&self, there: usize, here: usize) -> Option<SpatialFactor> {
        let [earlier, later] = [there, here].map(|place| &self.places[place]);
        let guess = self.node_of(there).T_world_cloud.inverse() * self.node_of(here).T_world_cloud;
        let (target, sample) = (earlier.map(&self.of_places), later.sample());
        let fit_from = |offset: Vector3<f64>| {
            let guess = Pose3::from_parts((offset + guess.translation.vector).into(), guess.rotation);
            earlier.fit(later, &target, &sample, &guess, &self.of_places)
        };
        let fits: Vec<Fit> = self.offsets(there, here).map(fit_from).collect();
        let best = fits.iter().max_by(|a, b| a.score().total_cmp(&b.score()))?;
        let place_of = |fit: &Fit| fit.registration.T_target_source.translation.vector;
        let tolerance = self.of_places.max_correspondence_distance;
        let is_elsewhere = |fit: &&Fit| (place_of(fit) - place_of(best)).norm() > tolerance;
        let rival = fits.iter().filter(is_elsewhere).map(Fit::score).fold(f64::NEG_INFINITY, f64::max);
        let found = earlier.refine(later, &target, &best.registration.T_target_source, &self.of_places)?;
        let drift = found.registration.T_target_source.translation.vector - guess.translation.vector;
        let is_sound = drift.norm() <= self.drift_between(there, here)
            && found.registration.fitness >= LIMITS.doubtful_overlap
            && found.agreement >= LIMITS.doubtful_agreement
            && best.score() - rival >= MIN_LEAD;
        let registration = &found.registration;
        let factor = between_factor(earlier.node, later.node, registration.T_target_source, &registration.information);
        is_sound.then_some(BetweenFactor { is_switchable: true, ..factor })
    }

    /// Where to search for a place, from where it should be: over the ground, as far as the path may have drifted.
    fn offsets(&self, there: usize, here: usize) -> impl Iterator<Item = Vector3<f64>> {
        let step = self.of_places.stages().0.rejection.max_correspondence_distance;
        let count = (self.drift_between(there, here) / step).ceil() as i32;
        let ground = self.places[there].ground();
        let all = (-count..=count).flat_map(move |x| (-count..=count).map(move |y| (x, y)));
        let within = all.filter(move |(x, y)| x * x + y * y <= count * count);
        within.map(move |(x, y)| (ground[0] * f64::from(x) + ground[1] * f64::from(y)) * step)
    }

    /// Whether two places that were found in earlier ones tell the same drift.
    fn agree(&self, a: &SpatialFactor, b: &SpatialFactor) -> bool {
        let drift = |found: &SpatialFactor| {
            let T = self.nodes[found.from].T_world_cloud * found.T_from_to;
            T * self.nodes[found.to].T_world_cloud.inverse()
        };
        let at = self.nodes[b.to].T_world_cloud;
        let difference = (drift(a) * at).inverse() * (drift(b) * at);
        let between = (self.nodes[a.to].path_length - self.nodes[b.to].path_length).abs();
        difference.translation_norm() < self.of_places.max_correspondence_distance + MAX_DRIFT * between
    }

    /// Closes the loops that have been found since the last time: the corrections of all frames.
    pub fn close(&mut self) -> Option<FrameMotions> {
        if self.loops.len() == self.num_solved {
            return None;
        }
        let mut poses: Vec<Pose3> = self.nodes.iter().map(|node| node.T_world_cloud).collect();
        let fixed = self.loops.iter().map(|found| BetweenFactor { is_switchable: false, ..*found });
        optimize_poses(&mut poses, &self.chain.iter().copied().chain(fixed).collect::<Vec<_>>());
        let all: Vec<SpatialFactor> = self.chain.iter().chain(&self.loops).copied().collect();
        optimize_poses(&mut poses, &all);
        let is_believed = |found: &SpatialFactor| found.weight(found.squared_distance(&poses)) >= MIN_WEIGHT;
        if !self.loops[self.num_solved..].iter().all(is_believed) {
            self.loops.truncate(self.num_solved);
            self.unconfirmed = None;
            return None;
        }
        self.num_solved = self.loops.len();
        self.report.num_closed = self.num_solved;
        let first = poses[0];
        let mut motions = Vec::with_capacity(self.nodes.len());
        for (node, pose) in self.nodes.iter_mut().zip(poses) {
            let pose = first * self.options.motion.nearest(&(first.inverse() * pose));
            let moved = (node.T_world_cloud.inverse() * pose).translation_norm();
            self.report.farthest_move = self.report.farthest_move.max(moved);
            motions.push((node.frame, pose * node.T_world_cloud.inverse()));
            node.T_world_cloud = pose;
        }
        Some(motions)
    }
}
