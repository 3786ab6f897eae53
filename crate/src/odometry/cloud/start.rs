//! The first sweeps of a lidar that moves are registered again, from the last one of them backwards.
//!
//! The first sweep is straightened along with the second one, by the motion between them: what bends both alike hardly shows, as a pitch rate that makes a
//! street a hill. That velocity bends the map to which all others are registered, and turns the world of all poses, which is the first sweep at its
//! time stamp and not in its middle. A few sweeps later the velocity is right, and backwards from there the first sweep is registered to a map as
//! well. At either end the velocity is that of a fit to the motion of all these sweeps.

use std::iter;

use nalgebra::{DMatrix, Matrix6, Vector6};

use super::sweeps::{Started, SweepEstimate, SweepOdometry};
use super::{CloudEstimate, CloudOdometry};
use crate::geometry::RigidMotion;
use crate::odometry::assessment::Status;

/// Sweeps that are registered again. Five in place of eight leave 1.24 of the error without skew of a rosette, in place of 1.05 (18 drives,
/// docs/measurements/clouds.md).
const NUM_SWEEPS: usize = 8;
/// Ratio of variances from which the velocity is taken to change: by chance one start in a million has as much if errors are independent (F distribution,
/// 6 and 30 degrees of freedom). They are not: with that of one in a hundred, half of the starts at a constant velocity were left as they were.
const SIGNIFICANT: f64 = 12.0;

impl SweepOdometry {
    /// Adds a sweep to the start, as long as all are good, and to its estimate what registering all again finds.
    pub(super) fn with_start(&mut self, mut found: SweepEstimate, started: Started) -> SweepEstimate {
        let is_good = found.estimate.assessment.status == Status::Good;
        let is_bent = started.sweep.span > 0.0 && !self.is_refuted();
        let Some(mut start) = self.start.take().filter(|_| is_good && is_bent) else { return found };
        start.push(started);
        if start.len() < NUM_SWEEPS {
            self.start = Some(start);
            return found;
        }
        let Ok(empty) = CloudOdometry::new(self.options) else { return found };
        let before = std::mem::replace(&mut self.clouds, empty);
        if self.register_backwards(&mut start, &before).is_none() {
            self.clouds = before;
            return found;
        }
        let first = &start[0];
        self.T_world_first = first.T_world_middle;
        self.T_world_stamp_of_first = first.sweep.at_stamp(&first.T_world_middle, &first.velocity);
        self.velocity = start.last().map(|last| last.velocity);
        let pose = |one: &Started| self.in_world(&one.sweep, &one.T_world_middle, &one.velocity);
        found.earlier = start.iter().map(|one| (one.number, pose(one))).collect();
        found.velocities = start.iter().map(|one| (one.number, one.velocity)).collect();
        if let Some((_, T_world_sensor)) = found.earlier.pop() {
            found.estimate.T_world_sensor = T_world_sensor;
        }
        found
    }

    /// Registers the sweeps of the start from the last one backwards, which stays where it was `before` and remains the last one. `None` where one is not
    /// good.
    fn register_backwards(&mut self, start: &mut [Started], before: &CloudOdometry) -> Option<()> {
        let backwards: Vec<&Started> = start.iter().rev().collect();
        let velocity = velocity_at_first(&backwards, &before.step_information)?;
        let (last, earlier) = start.split_last_mut()?;
        last.velocity = velocity;
        self.clouds.T_world_last = last.T_world_middle;
        self.clouds.begin(last.sweep.straight(&velocity, &self.options));
        let (mut time, mut T_world_after) = (last.time, last.T_world_middle);
        for one in earlier.iter_mut().rev() {
            let motion = T_world_after.inverse() * one.T_world_middle;
            let since = (one.time - time, Some(motion));
            (time, T_world_after) = (one.time, one.T_world_middle);
            self.clouds.last_motion = motion;
            let (velocity, frame, found) = self.find_after(&mut one.sweep, one.velocity, since).ok()?;
            let CloudEstimate { T_world_sensor, assessment, .. } = self.clouds.accept(frame, found);
            (one.T_world_middle, one.velocity) = (T_world_sensor, velocity);
            if assessment.status != Status::Good {
                return None;
            }
        }
        let forwards: Vec<&Started> = start.iter().collect();
        start[0].velocity = velocity_at_first(&forwards, &before.step_information)?;
        let [.., one_before, last] = start else { return None };
        self.clouds.last = Some(last.sweep.straight(&last.velocity, &self.options));
        self.clouds.T_world_last = last.T_world_middle;
        self.clouds.last_motion = one_before.T_world_middle.inverse() * last.T_world_middle;
        self.clouds.step_information = before.step_information;
        Some(())
    }
}

/// The velocity during the first of these sweeps by least squares over the motion up to each: a polynomial of time, of the lowest degree from which the
/// residuals, weighed by this information of a step, become significantly smaller neither with the next one nor with the one after that, as one that is
/// even, or odd, hides from one of them. `None` where the motion is no such polynomial, as where a lidar starts to move.
fn velocity_at_first(sweeps: &[&Started], information: &Matrix6<f64>) -> Option<Vector6<f64>> {
    let steps = sweeps.windows(2).map(|pair| (pair[0].T_world_middle.inverse() * pair[1].T_world_middle).log());
    let sums = steps.scan(Vector6::zeros(), |way, step| {
        *way += step;
        Some(*way)
    });
    let ways: Vec<Vector6<f64>> = iter::once(Vector6::zeros()).chain(sums).collect();
    let ways = DMatrix::from_fn(ways.len(), 6, |row, column| ways[row][column]);
    let fit = |degree: usize| {
        let since = |row: usize| sweeps[row].time - sweeps[0].time;
        let powers =
            DMatrix::from_fn(sweeps.len(), degree + 1, |row, power| (0..power).map(|_| since(row)).product::<f64>());
        let coefficients = powers.clone().svd(true, true).solve(&ways, f64::EPSILON).ok()?;
        let residuals = &ways - powers * &coefficients;
        let left = (&residuals * information * residuals.transpose()).trace();
        Some((Vector6::from_iterator(coefficients.row(1).iter().copied()), left))
    };
    let fits: Vec<_> = (1..=sweeps.len() / 2).map_while(fit).collect();
    let rises = |from: usize, to: usize| {
        let freedom = (sweeps.len() - to - 2) as f64 / (to - from) as f64;
        freedom * (fits[from].1 - fits[to].1) > SIGNIFICANT * fits[to].1
    };
    let degree = (0..fits.len().saturating_sub(2)).find(|&at| !rises(at, at + 1) && !rises(at, at + 2))?;
    Some(fits[degree].0)
}
