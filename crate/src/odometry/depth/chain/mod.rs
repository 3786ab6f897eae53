//! A chain of frames: each is looked for in the map of those before it.

mod in_doubt;

use super::color::SAME_PLACE_CORRELATION;
use super::found::{Found, Reach};
use super::guesses;
use super::habit::Habit;
use super::left_out::LeftOutFrame;
use super::matching::{Matching, TELLING_AGREEMENT, is_held_well};
use super::open_direction::OpenDirection;
use super::seen::Seen;
use super::unconfirmed::{Told, Unconfirmed};
use super::{DepthOptions, ESTABLISHED, Effort, SpatialEstimate, Verification};
use crate::geometry::Pose3;
use crate::map::keyframes::apart;
use crate::odometry::assessment::{Status, Verdict};
use crate::registration::prepared_surfels::PreparedSurfels;

/// Another place than where the last frame was is believed when it agrees better by this share ...
const BETTER_AGREEMENT: f64 = 0.02;
/// ... and has so much more support.
const BETTER_SUPPORT: f64 = 0.05;

/// Poses further apart than this are other places (m, turns included).
const ANOTHER_PLACE: f64 = 0.2;
/// Two places fit about as well where so much less agrees, ...
const AS_GOOD_AGREEMENT: f64 = 0.005;
/// ... of so much of the overlap.
const AS_GOOD_OVERLAP: f64 = 0.6;
/// So many frames tell how well brightness agrees in a recording: images may be of other frames, or of other light each time.
const TELLING_FRAMES: u32 = 3;
/// The last frame has this share in the mean, at the least.
const ALIKE_SHARE: f64 = 0.2;
/// Where brightness leaves so many times as much unexplained as usual, it is another place, or another light.
const UNLIKE: f64 = 3.0;

/// Frames are off along the direction that is held least by so many times what their residuals tell (root mean square, in
/// generated flats): surfaces err together. That is so where they hold them, however well, ...
const HELD_ERRING_TOGETHER: f64 = 10.0;
/// ... and this where they do not.
const OPEN_ERRING_TOGETHER: f64 = 40.0;
/// What is further from what is usual, in standard deviations, is something else: a frame may have been dropped.
const MOST_UNUSUAL: f64 = 3.0;

/// So many places that are not certain are remembered with what was known before them: it is a copy of the map.
const MOST_UNCONFIRMED: usize = 4;

/// Frames that hang together, and their map.
#[derive(Clone)]
pub(super) struct Chain {
    options: DepthOptions,
    seen: Seen,
    members: Vec<Member>,
    /// Where the last member was, and how it came there.
    T_world_last: Pose3,
    last_motion: Pose3,
    habit: Habit,
    /// Where the last frame seemed to be, if it was contradicted: the next one may be near.
    T_world_doubtful: Option<Pose3>,
    /// Frames since the last member.
    num_missed: u32,
    /// How well the brightness of frames agrees with the pictures of those before, in the mean of the last ones.
    alike: f64,
    /// Frames that have told that.
    num_alike: u32,
    /// Frames since ones whose place is not certain, each of them after the ones of the last.
    unconfirmed: Vec<Unconfirmed>,
}

/// A frame that is part of a chain's map.
#[derive(Clone)]
pub(super) struct Member {
    /// Its number among all frames.
    pub(super) number: u32,
    pub(super) T_world_sensor: Pose3,
    pub(super) verdict: Verdict,
}

/// What becomes of a frame, and what it tells of those before.
pub(super) struct Outcome {
    pub(super) estimate: SpatialEstimate,
    /// Members that are now where they are for sure.
    pub(super) confirmed: Vec<Member>,
    /// Frames that are members no longer, and where they seem to be.
    pub(super) dropped: Vec<Member>,
    /// The numbers of those of them whose own place nothing tells, so that trying them again tells no more.
    pub(super) uncertain: Vec<u32>,
}

impl From<SpatialEstimate> for Outcome {
    fn from(estimate: SpatialEstimate) -> Self {
        Self { estimate, confirmed: Vec::new(), dropped: Vec::new(), uncertain: Vec::new() }
    }
}

impl Chain {
    /// The chain that begins with this frame, at the world's origin.
    pub(super) fn new(options: DepthOptions, number: u32, frame: &PreparedSurfels) -> (Self, SpatialEstimate) {
        let (mut seen, T_world_sensor) = (Seen::default(), Pose3::identity());
        let view = seen.map.view(&frame.image, &T_world_sensor);
        seen.insert(frame, number, &T_world_sensor, &view);
        let verdict = Verdict::first();
        let estimate = SpatialEstimate { T_world_sensor, registration: None, overlap: 1.0, verdict, is_in_map: true };
        let chain = Self {
            options,
            seen,
            members: vec![Member { number, T_world_sensor, verdict: Verdict::first() }],
            T_world_last: T_world_sensor,
            last_motion: Pose3::identity(),
            habit: Habit::default(),
            T_world_doubtful: None,
            num_missed: 0,
            alike: 0.0,
            num_alike: 0,
            unconfirmed: Vec::new(),
        };
        (chain, estimate)
    }

    pub(super) fn seen(&self) -> &Seen {
        &self.seen
    }

    /// The frames of the map, in the order in which they were added.
    pub(super) fn members(&self) -> &[Member] {
        &self.members
    }

    pub(super) fn is_member(&self, number: u32) -> bool {
        self.members.iter().rev().any(|member| member.number == number)
    }

    /// Frames since the last member.
    pub(super) fn num_missed(&self) -> u32 {
        self.num_missed
    }

    /// Moves what each frame has shown by `motion` (of the world) of its number, frames being counted from 0. The next frame
    /// is looked for from where that leaves the last one.
    pub(super) fn move_frames(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.seen.move_frames(motion);
        for unconfirmed in &mut self.unconfirmed {
            unconfirmed.move_frames(motion);
        }
        let moved = self.members.last().map_or_else(Pose3::identity, |last| motion(last.number));
        self.T_world_last = moved * self.T_world_last;
        self.T_world_doubtful = self.T_world_doubtful.map(|doubtful| moved * doubtful);
        for member in &mut self.members {
            member.T_world_sensor = motion(member.number) * member.T_world_sensor;
        }
    }

    /// Registers the frame after the last one. One that is contradicted, or where too little says that it is there, is no part of
    /// the map.
    pub(super) fn register(&mut self, number: u32, frame: &PreparedSurfels) -> Outcome {
        if self.options.verification == Verification::Off {
            let found = self.find_near(&Matching::new(&self.seen, frame, self.options));
            let verdict = Verdict { agreement: found.agreement, ..Verdict::first() };
            return self.append(number, frame, found, Some(verdict)).into();
        }
        let found = self.find(frame);
        let reach = self.reach_of(&found);
        if self.is_firm(&found, reach) {
            return self.believe(number, frame, found);
        }
        if let Some((level, found)) = self.find_without_unconfirmed(frame, &found) {
            return self.believe_without(level, number, frame, found);
        }
        // Of a few frames it is not known yet whether they belong.
        let may_be_there = found.may_be_there(reach) && (found.is_open || self.members.len() > ESTABLISHED);
        if may_be_there {
            if self.unconfirmed.last().is_none_or(Unconfirmed::has_certain_end)
                && self.unconfirmed.len() < MOST_UNCONFIRMED
            {
                self.unconfirmed.push(Unconfirmed::new(self.seen.clone(), self.T_world_last));
            }
            let verdict = found.verdict_at(reach, self.looks_like_it(&found));
            return self.append(number, frame, found, Some(verdict)).into();
        }
        self.doubt(&found, reach).into()
    }

    /// Registers a frame after the last one if it is where such a frame is to be expected; for chains that are not it yet.
    pub(super) fn register_aside(&mut self, number: u32, frame: &PreparedSurfels) -> Outcome {
        let found = self.find_near(&Matching::new(&self.seen, frame, self.options));
        let reach = self.reach_of(&found);
        if self.is_firm(&found, reach) { self.believe(number, frame, found) } else { self.doubt(&found, reach).into() }
    }

    fn reach_of(&self, found: &Found) -> Reach {
        Reach::between(&self.T_world_last, &found.registration.T_target_source, self.num_missed)
    }

    /// Whether a frame is placed beyond doubt: by its surfaces, and it looks about as much like the pictures as frames do.
    fn is_firm(&self, found: &Found, reach: Reach) -> bool {
        found.is_firm(reach) && self.looks_like_it(found)
    }

    fn looks_like_it(&self, found: &Found) -> bool {
        if self.num_alike < TELLING_FRAMES {
            return true;
        }
        let usual = 1.0 - UNLIKE * (1.0 - self.alike);
        found.alike.is_none_or(|alike| alike > usual.min(SAME_PLACE_CORRELATION))
    }

    fn is_settled(&self, found: &Found) -> bool {
        let reach = self.reach_of(found);
        self.is_firm(found, reach) || found.may_be_open_there(reach)
    }

    /// Near where the last frame was, or seemed to be, then all around, then in all places seen before: as far as the
    /// evidence sends it.
    fn find(&self, frame: &PreparedSurfels) -> Found {
        let matching = Matching::new(&self.seen, frame, self.options);
        let mut found = self.find_near(&matching);
        if !self.is_settled(&found) {
            found = better_of(found, matching.best_of_all_around(&self.T_world_last));
        }
        if found.is_contradicted() {
            let further = matching.best_of_anywhere(&self.T_world_last);
            if self.is_firm(&further, self.reach_of(&further)) {
                return further;
            }
            if let Some(elsewhere) = matching.best_of_everywhere().filter(|found| self.is_firm(found, Reach::Afar)) {
                return elsewhere;
            }
        }
        self.as_usual(&matching, found)
    }

    /// Where little or nothing holds a frame along a direction, it has moved there as it usually does, as far as that is known
    /// better, and unless it contradicts what is known. What was open is open all the same.
    fn as_usual(&self, matching: &Matching<'_>, found: Found) -> Found {
        if found.alike.is_some() || self.num_missed > 0 || !found.is_plausible() {
            return found;
        }
        let (weakest, share) = OpenDirection::weakest(&found.registration);
        let deviation = weakest.deviation(&found.registration);
        if !found.is_open && is_held_well(share, deviation) {
            return found;
        }
        let T_world_found = found.registration.T_target_source;
        let motion = self.T_world_last.inverse() * T_world_found;
        let direction = self.T_world_last.rotation.inverse() * weakest.direction;
        let Some(expected) = self.habit.expected(&motion, &direction) else { return found };
        let deviation = match (found.registration.converged, found.is_open) {
            // What is still moving tells nothing.
            (false, _) => f64::INFINITY,
            (true, true) => OPEN_ERRING_TOGETHER * deviation,
            (true, false) => HELD_ERRING_TOGETHER * deviation,
        };
        let off = expected.along - direction.dot(&motion.translation.vector);
        let sq_deviation = deviation * deviation;
        if off * off > MOST_UNUSUAL * MOST_UNUSUAL * (expected.variance + sq_deviation) {
            return found;
        }
        let moved = weakest.direction * (off / (1.0 + expected.variance / sq_deviation));
        let guess = Pose3::translation(moved.x, moved.y, moved.z) * T_world_found;
        let mut usual = matching.register_across(&weakest, guess);
        let is_contradicted = usual.agreement < found.agreement - TELLING_AGREEMENT;
        if is_contradicted || !(usual.registration.converged || found.is_open) {
            return found;
        }
        // What the registration holds fast is known no better for it.
        usual.registration.information = found.registration.information;
        Found { is_open: found.is_open, ..usual }
    }

    fn find_near(&self, matching: &Matching<'_>) -> Found {
        let mut found = match self.options.effort {
            Effort::Thorough => near(matching, &self.T_world_last, &self.last_motion),
            Effort::Quick => matching.best_of(&guesses::few(&self.T_world_last, &self.last_motion), &self.T_world_last),
        };
        if self.options.effort == Effort::Quick && !self.is_firm(&found, self.reach_of(&found)) {
            found = near(matching, &self.T_world_last, &self.last_motion);
        }
        if let Some(T_world_doubtful) = self.T_world_doubtful.filter(|_| !self.is_settled(&found)) {
            let other = near(matching, &T_world_doubtful, &Pose3::identity());
            if other.support > found.support {
                found = other;
            }
        }
        found
    }

    /// Looks for a frame around where members near it in the recording are, and where it seemed to be, and in all places
    /// seen before if `everywhere`.
    pub(super) fn find_again(&self, left: &LeftOutFrame, everywhere: bool) -> Option<Found> {
        let matching = Matching::new(&self.seen, &left.frame, self.options);
        let between = |member: &&Member| member.number.abs_diff(left.number);
        let before = self.members.iter().filter(|member| member.number < left.number).min_by_key(between);
        let after = self.members.iter().filter(|member| member.number > left.number).min_by_key(between);
        let neighbors: Vec<&Member> = before.into_iter().chain(after).collect();
        let is_firm = |found: &Found| {
            let T_world_found = &found.registration.T_target_source;
            let from =
                |member: &&Member| Reach::between(&member.T_world_sensor, T_world_found, between(member).max(1) - 1);
            neighbors.iter().map(from).any(|reach| self.is_firm(found, reach)) || self.is_firm(found, Reach::Afar)
        };
        let around = neighbors.iter().map(|member| member.T_world_sensor).chain([left.T_world_sensor]);
        let mut found: Vec<Found> =
            around.map(|T_world_near| near(&matching, &T_world_near, &Pose3::identity())).collect();
        if everywhere && !found.iter().any(is_firm) {
            found.extend(neighbors.first().map(|member| matching.best_of_all_around(&member.T_world_sensor)));
        }
        let best = found.into_iter().max_by(|a, b| a.support.total_cmp(&b.support)).filter(is_firm);
        let elsewhere = || matching.best_of_everywhere().filter(|found| self.is_firm(found, Reach::Afar));
        let found = best.or_else(|| everywhere.then(elsewhere).flatten())?;
        // Of two places that fit about as well neither is believed.
        let seemed = matching.settled(left.T_world_sensor);
        let is_another =
            apart(&seemed.registration.T_target_source, &found.registration.T_target_source) > ANOTHER_PLACE;
        let fits_as_well =
            seemed.agreement > found.agreement - AS_GOOD_AGREEMENT && seemed.overlap > AS_GOOD_OVERLAP * found.overlap;
        (!is_another || !fits_as_well).then_some(found)
    }

    /// A frame that is where it is for sure. What was known before frames that are not tells where those are, once it is seen
    /// again.
    fn believe(&mut self, number: u32, frame: &PreparedSurfels, mut found: Found) -> Outcome {
        let (mut confirmed, mut dropped, mut uncertain) = (Vec::new(), Vec::new(), Vec::new());
        let is_next = self.num_missed == 0 && self.reach_of(&found) != Reach::Afar;
        while let Some(unconfirmed) = self.unconfirmed.pop() {
            match unconfirmed.told_by(frame, &found.registration.T_target_source, self.options) {
                Told::Nothing => {
                    self.unconfirmed.push(unconfirmed);
                    break;
                }
                // Found far from them, it says nothing of where they are.
                Told::Confirmed(found) if !is_next => {
                    self.unconfirmed.push(unconfirmed);
                    return self.believe_without(self.unconfirmed.len() - 1, number, frame, *found);
                }
                Told::Confirmed(_) => confirmed.extend(self.confirm(&unconfirmed)),
                Told::Moved(anchored) => {
                    uncertain.extend(unconfirmed.uncertain());
                    let (certain, others) = self.move_by(unconfirmed, &found, &anchored);
                    confirmed.extend(certain);
                    dropped.extend(others);
                    found = *anchored;
                    found.view = self.seen.map.view(&frame.image, &found.registration.T_target_source);
                }
            }
        }
        Outcome { estimate: self.append(number, frame, found, None), confirmed, dropped, uncertain }
    }

    /// Takes in the frame after the last one; with a verdict, if its own place is not certain.
    fn append(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        found: Found,
        doubt: Option<Verdict>,
    ) -> SpatialEstimate {
        let T_world_sensor = found.registration.T_target_source;
        self.last_motion = self.T_world_last.inverse() * T_world_sensor;
        if doubt.is_none() && self.num_missed == 0 {
            self.habit.push(&self.last_motion);
        }
        (self.T_world_last, self.T_world_doubtful, self.num_missed) = (T_world_sensor, None, 0);
        if let Some(alike) = found.alike {
            self.num_alike += 1;
            self.alike += ALIKE_SHARE.max(1.0 / f64::from(self.num_alike)) * (alike - self.alike);
        }
        for unconfirmed in &mut self.unconfirmed {
            unconfirmed.push(number, doubt.is_some().then(|| found.doubt()));
        }
        let mut verdict = doubt.unwrap_or_else(|| found.verdict());
        if self.may_be_elsewhere() {
            verdict.mark_hanging_on_an_open_place();
        }
        self.insert(number, frame, found, verdict)
    }

    /// Takes in a frame.
    pub(super) fn insert(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        found: Found,
        verdict: Verdict,
    ) -> SpatialEstimate {
        let T_world_sensor = found.registration.T_target_source;
        self.seen.insert(frame, number, &T_world_sensor, &found.view);
        self.members.push(Member { number, T_world_sensor, verdict: verdict.clone() });
        let registration = Some(found.registration);
        SpatialEstimate { T_world_sensor, overlap: found.overlap, verdict, registration, is_in_map: true }
    }

    /// A frame that is not believed is no part of the map, but where it seems to be the next one may be.
    fn doubt(&mut self, found: &Found, reach: Reach) -> SpatialEstimate {
        let verdict = found.verdict_at(reach, self.looks_like_it(found));
        self.num_missed += 1;
        if verdict.status == Status::Lost {
            return self.lost(verdict.reason, found.overlap);
        }
        let T_world_sensor = found.registration.T_target_source;
        self.T_world_doubtful = Some(T_world_sensor);
        let registration = Some(found.registration.clone());
        SpatialEstimate { T_world_sensor, overlap: found.overlap, verdict, registration, is_in_map: false }
    }

    /// A frame of which nothing is known.
    pub(super) fn lost(&self, reason: String, overlap: f64) -> SpatialEstimate {
        let verdict = Verdict { status: Status::Lost, reason, agreement: 0.0 };
        let T_world_sensor = self.T_world_doubtful.unwrap_or(self.T_world_last);
        SpatialEstimate { T_world_sensor, registration: None, overlap, verdict, is_in_map: false }
    }
}

fn near(matching: &Matching<'_>, T_world_near: &Pose3, motion: &Pose3) -> Found {
    matching.best_of(&guesses::near(T_world_near, motion), T_world_near)
}

/// What is found all around must be held by what is known, and agree the better by something.
fn better_of(found: Found, again: Found) -> Found {
    let is_better =
        again.agreement > found.agreement + BETTER_AGREEMENT && again.support > found.support + BETTER_SUPPORT;
    if is_better && again.is_anchored() { again } else { found }
}
