//! A scan whose motion was not measured: registered near the prediction or else in a wide window, and compared with the other places
//! where it may fit as well.

use super::assess::{GOOD_AGREEMENT, MIN_OVERLAP, MOST};
use super::belief::Finding;
use super::hypothesis::{Hypothesis, NUM_SEARCHED_POINTS, fits_as_well, rival_of_best, thinned};
use super::information::information_less_normal_noise;
use super::{
    BRIEF_ITERATIONS, FrameEstimate, InitialGuess, Link, MIN_FRAMES_KNOWN_MOTION, MIN_RIVAL_DISTANCE, Odometry,
    RIVAL_SHARE, UNKNOWN_SIGMA, is_continuation, registered,
};
use crate::geometry::{Pose2, RigidMotion};
use crate::map::local::QueryScan;
use crate::odometry::assessment::Status;
use crate::registration::correlative::{LikelihoodGrid, RESOLUTION, SearchWindow, WindowSearch};

/// Distance from the last pose within which another place is searched, under any heading, where the motion is not known (m). With 0.7
/// and 1.4 times as much nothing changes on logs (`docs/measurements/laser.md`, thresholds); worlds that repeat themselves need it.
const WIDE_SEARCH_RADIUS: f64 = 4.0 * UNKNOWN_SIGMA.1;
/// Number of other places that are refined.
const MAX_RIVALS: usize = 3;

impl Odometry {
    /// Registers from the guess that the settings ask for; where the result is not good and a search is allowed, once
    /// more from the best pose in a wide window, and the better of the two is kept.
    pub(super) fn register_unmeasured(&self, scan: &QueryScan, prediction: &Pose2) -> FrameEstimate {
        let (best, finding) = match self.options.initial_guess {
            InitialGuess::Identity => (self.register_from(scan, self.T_world_last), None),
            InitialGuess::ConstantVelocity => (self.register_from(scan, *prediction), None),
            InitialGuess::Correlative => self.register_by_search(scan, prediction),
        };
        let Hypothesis { registration, assessment } = best;
        let findings: Vec<Finding> =
            finding.into_iter().chain(self.stray.is_some().then_some(Finding::StrayBefore)).collect();
        let (T_world_sensor, link) = match assessment.status {
            Status::Good if findings.is_empty() => (registration.T_target_source, Link::Registered),
            Status::Good | Status::Doubtful => (registration.T_target_source, Link::Doubted),
            Status::Lost => (*prediction, Link::Lost),
        };
        let information = information_less_normal_noise(&registration);
        FrameEstimate { findings, ..registered(T_world_sensor, registration, information, assessment, link) }
    }

    /// The best registration near the prediction, or else in a wide window, and what speaks against it.
    fn register_by_search(&self, scan: &QueryScan, prediction: &Pose2) -> (Hypothesis, Option<Finding>) {
        let window = self.options.search;
        let grid = LikelihoodGrid::new(&self.map.points());
        let searched = thinned(scan.points(), NUM_SEARCHED_POINTS);
        let near = grid.window(&searched, prediction, window);
        let found = near.best().map(|found| found.T_target_source);
        let mut best = self.register_from(scan, found.unwrap_or(*prediction));
        if best.assessment.status != Status::Good {
            let wide = SearchWindow { translation: 2.0 * window.translation, rotation: std::f64::consts::PI };
            let wide = grid.window(&searched, &self.T_world_last, wide);
            let second =
                wide.best_from(&found.unwrap_or(*prediction)).map_or(self.T_world_last, |found| found.T_target_source);
            let second = self.register_from(scan, second);
            if second.assessment.agreement > best.assessment.agreement {
                best = second;
            }
        }
        let finding = self.ambiguity(&best, scan, prediction, &near);
        (best, finding)
    }

    /// What leaves open whether a good registration is at the right place: little overlap, or another place that fits about as well.
    fn ambiguity(
        &self,
        best: &Hypothesis,
        scan: &QueryScan,
        prediction: &Pose2,
        near: &WindowSearch,
    ) -> Option<Finding> {
        if best.assessment.status != Status::Good {
            return None;
        }
        let is_expected = self.is_expected(prediction, &best.registration.T_target_source);
        let overlap = best.registration.fitness;
        // Where the motion is not known, most of a scan has to lie on the map.
        if !is_expected && overlap < MOST {
            return Some(Finding::LittleOverlap(overlap));
        }
        let rival = if is_expected {
            self.rival_of(best, scan, near, RIVAL_SHARE)
        } else {
            let grid = LikelihoodGrid::with_resolution(&self.map.points(), 2.0 * RESOLUTION);
            let anywhere = SearchWindow { translation: WIDE_SEARCH_RADIUS, rotation: std::f64::consts::PI };
            let searched = thinned(scan.points(), NUM_SEARCHED_POINTS / 2);
            let anywhere = grid.window(&searched, &self.T_world_last, anywhere);
            self.rival_of(best, scan, &anywhere, MIN_OVERLAP)
        };
        rival.map(|rival| rival_of_best(best, &rival))
    }

    /// Another place of a window where the scan fits about as well, if there is one, and lies on the map with this share of
    /// what it does at the best.
    fn rival_of(&self, best: &Hypothesis, scan: &QueryScan, search: &WindowSearch, share: f64) -> Option<Hypothesis> {
        let found = best.registration.T_target_source;
        let score = search.score(&found);
        let mut known = vec![found];
        for _ in 0..MAX_RIVALS {
            let guess = search.rival(&known, MIN_RIVAL_DISTANCE, share * score, score)?.T_target_source;
            known.push(guess);
            let Some(rival) = self.plausible(scan, guess, best) else { continue };
            let rival = self.register_from(scan, rival);
            if is_other(&found, &rival.registration.T_target_source) && fits_as_well(&rival, best, share) {
                return Some(rival);
            }
        }
        None
    }

    /// Where a few iterations lead from a guess, if that is elsewhere than the best and brings about as much agreement: most
    /// guesses are wrong, and those take the most iterations.
    fn plausible(&self, scan: &QueryScan, guess: Pose2, best: &Hypothesis) -> Option<Pose2> {
        let mut brief = self.options.icp;
        brief.criteria.max_iterations = brief.criteria.max_iterations.min(BRIEF_ITERATIONS);
        let T_world_sensor = self.map.register(scan, guess, &brief).T_target_source;
        let is_plausible = is_other(&best.registration.T_target_source, &T_world_sensor)
            && self.map.free_space(scan, &T_world_sensor).agreement()
                > best.assessment.agreement - (1.0 - GOOD_AGREEMENT);
        is_plausible.then_some(T_world_sensor)
    }

    /// Whether a pose continues the motion of the frames before, which are sure.
    fn is_expected(&self, prediction: &Pose2, found: &Pose2) -> bool {
        let off = prediction.inverse() * found;
        self.num_registered >= MIN_FRAMES_KNOWN_MOTION && is_continuation(&off, self.last_motion.translation_norm())
    }
}

/// Whether a registration has not led to the best place.
fn is_other(best: &Pose2, found: &Pose2) -> bool {
    let off = best.inverse() * found;
    off.translation_norm() > 0.5 * MIN_RIVAL_DISTANCE.translation
        || off.rotation_angle() > 0.5 * MIN_RIVAL_DISTANCE.rotation
}
