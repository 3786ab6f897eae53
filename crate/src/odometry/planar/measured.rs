//! A scan whose motion was measured: the measurement bounds the search, is weighed against the registration, and places the
//! scan where the registration cannot.

use nalgebra::Matrix3;

use super::assess::{GOOD_AGREEMENT, PLAUSIBLE_AGREEMENT};
use super::belief::{AwayFromOdometry, ByOdometry, Finding, WhyOdometry};
use super::hypothesis::{Hypothesis, NUM_SEARCHED_POINTS, agrees_as_well, thinned};
use super::information::{self, fuse, information_less_normal_noise, openness, seen_from, sigmas, softened_covariance};
use super::{
    FrameEstimate, Link, MeasuredMotion, Odometry, REGISTRATION_SIGMA, UNKNOWN_SIGMA, registered, unregistered,
};
use crate::geometry::mahalanobis;
use crate::geometry::quantile::THREE_SIGMA;
use crate::geometry::{Pose2, RigidMotion};
use crate::map::local::QueryScan;
use crate::odometry::assessment::Status;
use crate::registration::correlative::{LikelihoodGrid, SearchWindow};

/// Wheels slip now and then, mostly in turns: a good registration may differ from measured motion by this (rad, m) whatever the usual
/// noise of the wheels, ...
const MAX_SLIP: (f64, f64) = (0.35, 0.25);
/// ... to whose translation this share of the measured translation is added. Without it, the corridor with `wheels_stop` has 1770 good
/// frames (1829), and 3 of 1,245 pairs in small pieces are wrong (none).
const SLIP_SHARE: f64 = 0.1;

impl Odometry {
    /// Registers from the measured motion; where that leads nowhere, from the best pose near it. Where both contradict the
    /// measurement, either that is wrong, or the scan is placed by it. It is wrong as well where the scan fits better at the motion
    /// that the steps around it let expect: odometry that stops or comes late holds the search at a place that looks alike.
    pub(super) fn register_measured(
        &self,
        scan: &QueryScan,
        prediction: &Pose2,
        motion: &MeasuredMotion,
        as_neighbors: Option<&Pose2>,
    ) -> FrameEstimate {
        let best = self.register_near(scan, prediction, motion);
        match self.agreeing(best, scan, prediction, motion) {
            Ok(estimate) => as_neighbors
                .and_then(|expected| self.better_fit(scan, &estimate.T_world_sensor, expected))
                .unwrap_or(estimate),
            Err(failed) => {
                let (best, why) = *failed;
                self.refutation(scan, prediction).unwrap_or_else(|| placed(best, prediction, why))
            }
        }
    }

    /// A registration where a motion leads, at the pose that both make most likely; or else why it is not there.
    fn agreeing(
        &self,
        best: Hypothesis,
        scan: &QueryScan,
        prediction: &Pose2,
        motion: &MeasuredMotion,
    ) -> Result<FrameEstimate, Box<(Hypothesis, Option<WhyOdometry>)>> {
        if best.assessment.status == Status::Lost {
            return Err(Box::new((best, None)));
        }
        if let Some(why) = self.contradiction(scan, &best, prediction, motion) {
            return Err(Box::new((best, Some(why))));
        }
        match self.fused(scan, &best, prediction, motion) {
            Some((T_world_sensor, information)) => Ok(self.confirmed(best, T_world_sensor, information, motion)),
            None => Err(Box::new((best, Some(WhyOdometry::NotBetween)))),
        }
    }

    /// The registration where the motion before leads, where it shows that the measured motion is wrong: the scan does not fit at that,
    /// and fits where the robot's motion may have taken it.
    fn refutation(&self, scan: &QueryScan, measured: &Pose2) -> Option<FrameEstimate> {
        let (change, before) = (self.motion_change?, self.last_measured?);
        let estimate = self.better_fit(scan, measured, &self.last_motion)?;
        let off = (before.inverse() * (self.T_world_last.inverse() * estimate.T_world_sensor)).log();
        change.allows(&off).then_some(estimate)
    }

    /// The registration where an expected motion leads, if the scan fits better there than at a pose by the measured motion.
    fn better_fit(&self, scan: &QueryScan, measured: &Pose2, expected: &Pose2) -> Option<FrameEstimate> {
        let expected = self.motion_change?.after(expected);
        let prediction = self.T_world_last * expected.T_before_sensor;
        let best = self.register_near(scan, &prediction, &expected);
        let estimate = self.agreeing(best, scan, &prediction, &expected).ok()?;
        let fits_there = agrees_as_well(self.map.free_space(scan, measured).agreement(), estimate.registered.agreement);
        (!fits_there).then_some(FrameEstimate { instead_of_odometry: Some(expected), ..estimate })
    }

    /// A registration that agrees with the measured motion, at the pose that both make most likely.
    fn confirmed(
        &self,
        best: Hypothesis,
        T_world_sensor: Pose2,
        information: Matrix3<f64>,
        motion: &MeasuredMotion,
    ) -> FrameEstimate {
        let Hypothesis { registration, assessment } = best;
        let is_confirmed = assessment.status == Status::Doubtful && assessment.agreement > PLAUSIBLE_AGREEMENT;
        let left = self.left_open(&information, motion);
        let is_open = openness(&motion.T_before_sensor, &left) > 1.0;
        let (heading, position) = sigmas(&motion.T_before_sensor, &left);
        let is_registered =
            assessment.status == Status::Good || (is_confirmed && !registration.observability.is_undetermined());
        let link = if is_registered && !is_open { Link::Registered } else { Link::Doubted };
        FrameEstimate {
            by_odometry: if is_confirmed { ByOdometry::Confirmed } else { ByOdometry::Nothing },
            findings: is_open.then_some(Finding::LeftOpen(heading, position)).into_iter().collect(),
            ..registered(T_world_sensor, registration, information, assessment, link)
        }
    }

    /// Why a registration cannot be where the measured motion has taken the scan.
    fn contradiction(
        &self,
        scan: &QueryScan,
        best: &Hypothesis,
        prediction: &Pose2,
        motion: &MeasuredMotion,
    ) -> Option<WhyOdometry> {
        if !self.is_near(best, motion) {
            return Some(WhyOdometry::Known(sigmas(&motion.T_before_sensor, &motion.covariance).1));
        }
        // That the wheels slipped is believed where the scan does not fit without it.
        let fits = || agrees_as_well(self.map.free_space(scan, prediction).agreement(), best.assessment.agreement);
        (!self.is_likely(best, motion) && fits()).then_some(WhyOdometry::FitsThere)
    }

    /// The better of the registrations from the measured motion and, where that one is not sure, from the best pose near it.
    fn register_near(&self, scan: &QueryScan, prediction: &Pose2, motion: &MeasuredMotion) -> Hypothesis {
        let best = self.register_from(scan, *prediction);
        if best.assessment.status != Status::Lost
            && best.assessment.agreement >= GOOD_AGREEMENT
            && self.is_near(&best, motion)
        {
            return best;
        }
        let (rotation, translation) = sigmas(&motion.T_before_sensor, &motion.covariance);
        let window =
            SearchWindow { translation: 0.1 + THREE_SIGMA * translation, rotation: 0.02 + THREE_SIGMA * rotation };
        let grid = LikelihoodGrid::new(&self.map.points());
        let Some(found) = grid.search(&thinned(scan.points(), NUM_SEARCHED_POINTS), prediction, window) else {
            return best;
        };
        let searched = self.register_from(scan, found.T_target_source);
        let is_better = searched.assessment.agreement > best.assessment.agreement || !self.is_near(&best, motion);
        if is_better && self.is_near(&searched, motion) { searched } else { best }
    }

    /// The most likely pose by a registration and a measured motion, and the registration's information. If fewer returns agree at
    /// that pose than at the registered one, the walls do constrain the direction in which the motion has moved it, and what the
    /// normals tell of it counts, too. `None` if the returns agree as well at the prediction: either may be wrong then.
    fn fused(
        &self,
        scan: &QueryScan,
        Hypothesis { registration, assessment }: &Hypothesis,
        prediction: &Pose2,
        motion: &MeasuredMotion,
    ) -> Option<(Pose2, Matrix3<f64>)> {
        let T_last_found = self.T_world_last.inverse() * registration.T_target_source;
        let information = information_less_normal_noise(registration);
        let fused_by = |information: &Matrix3<f64>| {
            let link = self.link_covariance(information);
            self.T_world_last * fuse((&T_last_found, &link), (&motion.T_before_sensor, &motion.covariance))
        };
        let fits = |pose: &Pose2| agrees_as_well(self.map.free_space(scan, pose).agreement(), assessment.agreement);
        let fused = fused_by(&information);
        if fits(&fused) {
            return Some((fused, information));
        }
        let information = information::information(registration);
        (!fits(prediction)).then(|| (fused_by(&information), information))
    }

    /// Whether a registration lies where the measured motion allows, or is good and lies where wheels that slipped allow it.
    fn is_near(&self, hypothesis: &Hypothesis, motion: &MeasuredMotion) -> bool {
        let Hypothesis { registration, assessment } = hypothesis;
        let T_last_found = self.T_world_last.inverse() * registration.T_target_source;
        let slip = motion.T_before_sensor.inverse() * T_last_found;
        let most = MAX_SLIP.1 + SLIP_SHARE * motion.T_before_sensor.translation_norm();
        let may_have_slipped = slip.rotation_angle() < MAX_SLIP.0 && slip.translation_norm() < most;
        (assessment.status == Status::Good && may_have_slipped) || self.is_likely(hypothesis, motion)
    }

    /// Whether a registration lies where the measured motion allows by its usual noise.
    fn is_likely(&self, Hypothesis { registration, .. }: &Hypothesis, motion: &MeasuredMotion) -> bool {
        let T_last_found = self.T_world_last.inverse() * registration.T_target_source;
        let off = (motion.T_before_sensor * T_last_found.inverse()).log();
        let covariance = motion.covariance + self.link_covariance(&information_less_normal_noise(registration));
        covariance
            .try_inverse()
            .is_some_and(|information| off.dot(&(information * off)) < mahalanobis::ONE_IN_TEN_THOUSAND)
    }

    /// Covariance of the motion from the last frame, of a registration and a measured motion together.
    fn left_open(&self, information: &Matrix3<f64>, motion: &MeasuredMotion) -> Matrix3<f64> {
        let [registered, measured] = [self.link_covariance(information), motion.covariance].map(Matrix3::try_inverse);
        registered.zip(measured).and_then(|(a, b)| (a + b).try_inverse()).unwrap_or(motion.covariance)
    }

    /// Covariance of the motion from the last frame, of information about a pose in the world.
    fn link_covariance(&self, information: &Matrix3<f64>) -> Matrix3<f64> {
        softened_covariance(&seen_from(information, &self.T_world_last), REGISTRATION_SIGMA, UNKNOWN_SIGMA)
    }
}

/// A frame that is placed by measured motion alone, whatever its registration, and why that one is not believed.
fn placed(
    Hypothesis { registration, assessment }: Hypothesis,
    prediction: &Pose2,
    why: Option<WhyOdometry>,
) -> FrameEstimate {
    let off = prediction.inverse() * registration.T_target_source;
    let away = |why| AwayFromOdometry { distance: off.translation_norm(), turn: off.rotation_angle(), why };
    FrameEstimate {
        registration: Some(registration),
        by_odometry: ByOdometry::Placed(why.map(away)),
        ..unregistered(*prediction, assessment, Link::Carried)
    }
}
