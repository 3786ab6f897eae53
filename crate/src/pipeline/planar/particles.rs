//! A particle filter beside a localisation, to be looked at after any of its scans.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::Localization;
use crate::error::Result;
use crate::geometry::Pose2;
use crate::odometry::localization::{MAX_PARTICLES, Particle, ParticleFilter, ParticleOptions};
use crate::odometry::planar::MeasuredMotion;
use crate::preprocess::planar_scan::PlanarScan;

/// A particle filter over the scans that a localisation has located, with their motions: those of the odometry, or of registration where
/// there is none. It starts over all of the map.
pub struct ParticleRun {
    scans: Vec<Rc<PlanarScan>>,
    motions: Vec<Option<MeasuredMotion>>,
    T_laser_robot: Vec<Pose2>,
    /// Before the first scan.
    start: ParticleFilter,
    /// After scan `last`.
    filter: ParticleFilter,
    last: Option<usize>,
    /// After some of the scans, at least `interval` apart, so that going back takes no new start.
    kept: BTreeMap<usize, ParticleFilter>,
    interval: usize,
}

impl Localization {
    /// A particle filter over the scans located so far.
    ///
    /// # Errors
    /// Options out of their limits.
    pub fn particle_run(&self, options: ParticleOptions) -> Result<ParticleRun> {
        let start = ParticleFilter::new(self.localizer.field(), options)?;
        let num_located = self.locations().len();
        Ok(ParticleRun {
            scans: self.scans[..num_located].to_vec(),
            motions: self.motions[..num_located].to_vec(),
            T_laser_robot: self.T_laser_robot[..num_located].to_vec(),
            filter: start.clone(),
            start,
            last: None,
            kept: BTreeMap::new(),
            interval: 1,
        })
    }
}

impl ParticleRun {
    /// The scan that was weighed last; `None` before the first.
    pub fn last(&self) -> Option<usize> {
        self.last
    }

    /// The filter after that scan.
    pub fn filter(&self) -> &ParticleFilter {
        &self.filter
    }

    /// Its particles as poses of the robot that carries the laser, or of the laser where nothing tells where it sits.
    pub fn particles(&self) -> impl Iterator<Item = Particle> {
        let T_laser_robot = self.last.map_or_else(Pose2::identity, |last| self.T_laser_robot[last]);
        let moved = move |particle: &Particle| Particle {
            T_world_sensor: particle.T_world_sensor * T_laser_robot,
            weight: particle.weight,
        };
        self.filter.particles().iter().map(moved)
    }

    /// Weighs the next scan on the way to this one; earlier scans are gone back to. False when it is there, or after the last scan.
    pub fn step_towards(&mut self, scan: usize) -> bool {
        let scan = scan.min(self.scans.len().saturating_sub(1));
        let nearest = self.kept.range(..=scan).next_back().map(|(&kept, _)| kept);
        if self.last > Some(scan) || self.last < nearest {
            self.filter = nearest.map_or(&self.start, |kept| &self.kept[&kept]).clone();
            self.last = nearest;
        }
        let next = self.last.map_or(0, |last| last + 1);
        if next > scan || next >= self.scans.len() {
            return false;
        }
        self.filter.add_scan(&self.scans[next], self.motions[next].as_ref());
        self.last = Some(next);
        self.keep(next);
        next < scan
    }

    /// Keeps the filter after a scan; where all have more particles than one may have, every second one at twice the interval.
    fn keep(&mut self, scan: usize) {
        if !scan.is_multiple_of(self.interval) {
            return;
        }
        self.kept.insert(scan, self.filter.clone());
        while self.kept.len() > 1 && self.kept.len() * self.filter.particles().len() > MAX_PARTICLES {
            self.interval *= 2;
            self.kept.retain(|kept, _| kept.is_multiple_of(self.interval));
        }
    }
}
