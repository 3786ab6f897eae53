//! One scan after the other: where it was taken.
//!
//! At the start the scans are searched for in the whole map as one rigid window, which grows until the search has found all places where it
//! may have been taken and these are few. Each of them is then followed by registering keyframes to the map, until one stands alone and the
//! map explains what the scans see there. That place is followed scan by scan, until the map no longer explains them: then the robot is
//! searched for again.

use std::rc::Rc;

use nalgebra::Matrix3;

use super::belief::{Belief, Estimate, Hypothesis};
use super::field::MapField;
use super::likelihood::{Beam, BeamModel, Fit, NEW};
use super::location::{Location, Place, Verdict};
use super::places::{CERTAIN, MAX_LOG_ODDS_OF_PLACE, Places, log_odds, odds_of, places};
use super::search::Search;
use super::window::{Window, WindowScan, beams_of};
use crate::geometry::Pose2;
use crate::odometry::assessment::Status;
use crate::odometry::planar::MeasuredMotion;
use crate::odometry::planar::information::CERTAIN_SIGMA;
use crate::preprocess::planar_scan::PlanarScan;

/// Scans with fewer beams do not tell a place.
const MIN_BEAMS: usize = 8;
/// The window is searched again when it shows this many times as many pieces of walls: all searches together take about twice the last; ...
const GROWTH: f64 = 2.0;
/// ... or after so many keyframes, for the longest window does not grow any more; twice as many each time, up to the second number.
const KEYFRAMES_BETWEEN_SEARCHES: (usize, usize) = (10, 40);
/// Most places that are followed: following one takes a tenth of a millisecond a keyframe.
const MAX_FOLLOWED: usize = 100;
/// The way over which scans must fit the map together before a place is certain (m).
const CHECKED_WAY: f64 = 3.0;

/// What is known of the robot's place.
enum State {
    /// It is searched for; what the last search found for the frame of the window's middle, and that in the window.
    Searching(Option<(Places, Pose2)>),
    /// These are all the places where it may be.
    Following(Belief),
    /// It is here, with these log odds to being elsewhere.
    Tracking(Estimate, f64),
}

/// When the map is searched for the window again.
#[derive(Debug, Clone, Copy)]
struct NextSearch {
    /// When it shows so many pieces of walls, ...
    num_pieces: usize,
    /// ... or after so many keyframes, ...
    num_keyframes: usize,
    /// ... of these many from the last search on.
    wait: usize,
}

impl NextSearch {
    const NOW: Self = Self { num_pieces: 0, num_keyframes: 0, wait: KEYFRAMES_BETWEEN_SEARCHES.0 };

    /// Whether the next keyframe of a window with so many pieces is searched for.
    fn is_due(&mut self, num_pieces: usize) -> bool {
        self.num_keyframes = self.num_keyframes.saturating_sub(1);
        if num_pieces < self.num_pieces && self.num_keyframes > 0 {
            return false;
        }
        let wait = self.wait;
        *self = Self {
            num_pieces: (GROWTH * num_pieces as f64) as usize,
            num_keyframes: wait,
            wait: (2 * wait).min(KEYFRAMES_BETWEEN_SEARCHES.1),
        };
        true
    }
}

/// Locates scans in a map.
pub struct Localizer {
    field: Rc<MapField>,
    has_odometry: bool,
    model: BeamModel,
    search: Search,
    state: State,
    window: Window,
    /// The scans before those of the window, while the robot is searched for.
    earlier: Vec<WindowScan>,
    next_search: NextSearch,
    locations: Vec<Location>,
}

impl Localizer {
    /// Prepares a map. Where no odometry measures the motions, no place is called certain: of 1,226 such places in halves of four
    /// buildings 4 were wrong, by up to 3 m (`cargo measure localize halves --alone`).
    pub fn new(field: Rc<MapField>, has_odometry: bool) -> Self {
        let (model, search) = (BeamModel::of(&field), Search::new(&field));
        Self {
            field,
            has_odometry,
            model,
            search,
            state: State::Searching(None),
            window: Window::default(),
            earlier: Vec::new(),
            next_search: NextSearch::NOW,
            locations: Vec::new(),
        }
    }

    /// The map.
    pub fn field(&self) -> &Rc<MapField> {
        &self.field
    }

    /// Where each scan so far was taken, by all scans so far.
    pub fn locations(&self) -> &[Location] {
        &self.locations
    }

    /// What is known after all scans.
    pub fn verdict(&self) -> Verdict {
        let is_elsewhere = || match &self.state {
            State::Searching(Some((places, _))) => places.are_all_wrong(),
            _ => false,
        };
        if self.locations.iter().any(|location| location.status == Status::Good) {
            Verdict::Found
        } else if is_elsewhere() {
            Verdict::NotInMap
        } else {
            Verdict::Undecided
        }
    }

    /// Locates the next scan, after this motion from the one before; `None` where nothing tells it.
    pub fn add_scan(&mut self, scan: &PlanarScan, motion: Option<&MeasuredMotion>) -> &Location {
        let (frame, beams) = (self.locations.len(), beams_of(scan));
        if motion.is_none() {
            self.search_from(frame);
        }
        let unknown = MeasuredMotion { T_before_sensor: Pose2::identity(), covariance: Matrix3::zeros() };
        let num_new = self.window.add(frame, beams.clone(), motion.unwrap_or(&unknown));
        self.earlier.extend(self.window.shorten());
        let state = std::mem::replace(&mut self.state, State::Searching(None));
        self.state = match (state, motion) {
            (State::Tracking(last, odds), Some(motion)) => self.track(&last, odds, &beams, motion, num_new),
            (State::Following(belief), Some(motion)) => self.follow(belief, &beams, motion, num_new),
            (State::Searching(found), _) => self.look_around(found, num_new.is_some()),
            _ => State::Searching(None),
        };
        if self.locations.len() == frame {
            self.locations.push(self.located(&beams));
        }
        &self.locations[frame]
    }

    /// Begins to search with the scans from this one on.
    fn search_from(&mut self, frame: usize) {
        self.window.cut_before(frame);
        self.earlier.clear();
        self.state = State::Searching(None);
        self.next_search = NextSearch::NOW;
    }

    /// Searches the map where the window has grown enough.
    fn look_around(&mut self, found: Option<(Places, Pose2)>, is_keyframe: bool) -> State {
        if !is_keyframe {
            return State::Searching(found);
        }
        let joined = self.window.joined();
        if joined.beams.len() < MIN_BEAMS || !self.next_search.is_due(joined.num_pieces) {
            return State::Searching(found);
        }
        let found = places(&self.field, &self.model, &self.search, &joined);
        let T_window_middle = self.window.scans[joined.middle].pose;
        let is_known = found.is_complete && found.elsewhere() < CERTAIN && found.all.len() <= MAX_FOLLOWED;
        match self.window.scans.last() {
            Some(last) if is_known => {
                State::Following(Belief::begun(&found.all, &(T_window_middle.inverse() * last.pose)))
            }
            _ => State::Searching(Some((found, T_window_middle))),
        }
    }

    /// Follows all places where the robot may be, until one stands alone.
    fn follow(&mut self, mut belief: Belief, beams: &[Beam], motion: &MeasuredMotion, num_new: Option<usize>) -> State {
        belief.move_on(motion);
        let Some(num_new) = num_new else { return State::Following(belief) };
        belief.weigh(&self.field, &self.model, beams, num_new, self.window.shared());
        let (probabilities, elsewhere) = belief.probabilities();
        if elsewhere >= CERTAIN {
            self.next_search = NextSearch::NOW;
            return State::Searching(None);
        }
        let best = belief.hypotheses.first().filter(|_| probabilities[0] >= CERTAIN);
        match best.filter(|best| self.odds_of_stretch(&best.estimate) > 0.0) {
            Some(&Hypothesis { estimate, log_odds, .. }) => {
                self.place_scans_before(&estimate);
                State::Tracking(estimate, log_odds.min(MAX_LOG_ODDS_OF_PLACE))
            }
            None => State::Following(belief),
        }
    }

    /// Places the scans from the last one back, where they are not certain yet, as far as the map explains them.
    fn place_scans_before(&mut self, now: &Estimate) {
        let (mut estimate, mut shared, mut odds) = (*now, 1.0, MAX_LOG_ODDS_OF_PLACE);
        // Those of the window fit together.
        let in_window = self.window.scans.iter().rev().map(|scan| (scan, 0));
        let earlier = self.earlier.iter().rev().map(|scan| (scan, scan.num_new.unwrap_or(0)));
        for (scan, num_new) in in_window.chain(earlier) {
            let (registered, fit) = estimate.registered(&self.field, &self.model, &scan.beams, shared);
            (estimate, shared) = (registered.moved_back(&scan.motion), scan.shared);
            odds = (odds + log_odds(&self.model, num_new, fit.mean())).min(MAX_LOG_ODDS_OF_PLACE);
            let location = self.certain(&registered, &fit, odds);
            match self.locations.get_mut(scan.frame) {
                _ if odds <= -odds_of(CERTAIN) => break,
                Some(known) if known.status == Status::Good => break,
                Some(known) => *known = Location { is_known_at_once: false, ..location },
                None => self.locations.push(location),
            }
        }
        self.earlier.clear();
    }

    /// Follows the robot from its last place.
    fn track(
        &mut self,
        last: &Estimate,
        odds: f64,
        beams: &[Beam],
        motion: &MeasuredMotion,
        num_new: Option<usize>,
    ) -> State {
        self.earlier.clear();
        let (estimate, fit) = last.moved(motion).registered(&self.field, &self.model, beams, self.window.shared());
        let odds = (odds + log_odds(&self.model, num_new.unwrap_or(0), fit.mean())).min(MAX_LOG_ODDS_OF_PLACE);
        self.locations.push(self.certain(&estimate, &fit, odds));
        if odds > -odds_of(CERTAIN) {
            return State::Tracking(estimate, odds);
        }
        self.search_from(self.window.first_within(CHECKED_WAY));
        State::Searching(None)
    }

    /// The log odds of the last stretch to being elsewhere, where the robot is here.
    fn odds_of_stretch(&self, estimate: &Estimate) -> f64 {
        let mut stretch = self.window.clone();
        stretch.cut_before(self.window.first_within(CHECKED_WAY));
        let joined = stretch.joined();
        let Some((middle, last)) = stretch.scans.get(joined.middle).zip(stretch.scans.last()) else { return 0.0 };
        let pose = estimate.pose * (last.pose.inverse() * middle.pose);
        log_odds(&self.model, joined.num_pieces, self.field.fit(&self.model, &joined.beams, &pose).mean())
    }

    /// The location of a scan where the robot is tracked, with these log odds to being elsewhere.
    fn certain(&self, estimate: &Estimate, fit: &Fit, odds: f64) -> Location {
        let probability = 1.0 / (1.0 + (-odds).exp());
        let place = Place::new(&self.field, &estimate.pose, &estimate.covariance, fit, probability);
        let (position, heading) = place.sigmas();
        let reason = if fit.num_beams < MIN_BEAMS {
            format!("it has {} usable beams, too few to tell a place", fit.num_beams)
        } else if probability < CERTAIN || log_odds(&self.model, fit.num_beams, fit.mean()) < NEW.ln() {
            "most of what it sees there is not in the map".to_owned()
        } else if position > CERTAIN_SIGMA.1 || heading > CERTAIN_SIGMA.0 {
            let heading = heading.to_degrees();
            format!("its pose is uncertain by {position:.2} m and {heading:.1} degrees (one standard deviation)")
        } else if !self.has_odometry {
            "registrations of scans alone can mislead: with odometry it would be certain".to_owned()
        } else {
            String::new()
        };
        let status = if reason.is_empty() { Status::Good } else { Status::Doubtful };
        Location {
            place: Some(place),
            rivals: Vec::new(),
            elsewhere: 1.0 - probability,
            status,
            reason,
            agreement: fit.explained(),
            is_known_at_once: true,
        }
    }

    /// The location of the last scan by the state.
    fn located(&self, beams: &[Beam]) -> Location {
        match &self.state {
            State::Tracking(estimate, odds) => {
                self.certain(estimate, &self.field.fit(&self.model, beams, &estimate.pose), *odds)
            }
            State::Following(belief) => self.undecided(belief, true),
            State::Searching(None) => Location::unknown("too little was seen so far to tell a place"),
            State::Searching(Some((found, T_window_middle))) => {
                let last = self.window.scans.last().map_or_else(Pose2::identity, |last| last.pose);
                self.undecided(&Belief::of(&found.all, &(T_window_middle.inverse() * last)), found.is_complete)
            }
        }
    }

    /// The location of a scan that may be at several places.
    fn undecided(&self, belief: &Belief, is_complete: bool) -> Location {
        let (probabilities, elsewhere) = belief.probabilities();
        let place = |(hypothesis, probability): (&Hypothesis, &f64)| {
            let Estimate { pose, covariance, .. } = &hypothesis.estimate;
            Place::new(&self.field, pose, covariance, &hypothesis.fit, *probability)
        };
        let mut all: Vec<Place> = belief.hypotheses.iter().zip(&probabilities).map(place).collect();
        if all.is_empty() {
            return Location { elsewhere, ..Location::unknown("it fits nowhere in the map") };
        }
        let rivals = all.split_off(1);
        let (count, percent) = (belief.hypotheses.len(), 100.0 * probabilities[0]);
        let reason = if !is_complete {
            format!("it may be at more than {count} places, which were not all compared")
        } else if elsewhere > 0.5 {
            format!("it fits nowhere in the map well ({:.1} % likely to be elsewhere)", 100.0 * elsewhere)
        } else if probabilities[0] < CERTAIN {
            format!("it may be at {count} places or elsewhere; the most likely place has {percent:.1} %")
        } else {
            "what was seen on the last metres does not confirm its place yet".to_owned()
        };
        Location {
            place: all.pop(),
            rivals,
            elsewhere,
            status: if elsewhere > 0.5 { Status::Lost } else { Status::Doubtful },
            reason,
            agreement: belief.hypotheses[0].fit.explained(),
            is_known_at_once: false,
        }
    }
}
