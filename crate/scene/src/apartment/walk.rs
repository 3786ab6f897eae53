//! A walk through the flat: steps and rotations on the spot, without collisions, back to its start.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector2, Vector3};
use rustc_hash::FxHashMap;

use super::super::random::Random;
use super::Apartment;
use super::plan::{Opening, OpeningKind, Room, RoomKind, Side};
use super::ways::{Ways, obstacles};
use scanstitch::geometry::Pose3;

/// Where a walk goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tour {
    /// Round the pier between living room and kitchen.
    Pier,
    /// Through every room.
    AllRooms,
}

/// How one walks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WalkOptions {
    /// Each seed gives another walk through the same flat.
    pub seed: u64,
    /// Where it goes.
    pub tour: Tour,
    /// Length of a step (m).
    pub step: f64,
    /// Angle of a turn on the spot, a whole fraction of a full turn (rad).
    pub turn: f64,
    /// The walk is cut off after so many frames; `None` for all of it.
    pub num_frames: Option<usize>,
    /// Height of the camera over the floor (m).
    pub camera_height: f64,
}

impl Default for WalkOptions {
    /// The motion of the homework's recordings, through all rooms.
    fn default() -> Self {
        Self {
            seed: 1,
            tour: Tour::AllRooms,
            step: 0.25,
            turn: 10f64.to_radians(),
            num_frames: None,
            camera_height: 1.25,
        }
    }
}

/// The camera keeps this far from everything (m).
pub const CLEARANCE: f64 = 0.22;
/// and rather this far; nearer steps count more.
const COMFORTABLE: f64 = 0.4;
/// Of so many looks ahead most should reach this far (m): walks rather turn away from a near wall than towards it.
const LOOKS: usize = 5;
const OPEN_VIEW: f64 = 1.3;
/// A blank view counts as so many steps.
const BLANK_VIEW: f64 = 4.0;
/// Squares of the floor (m).
const SQUARE: f64 = 0.04;
/// A place counts as reached from this far (m).
const REACHED: f64 = 0.2;
/// and the start, at the end of the walk.
const BACK: f64 = 0.13;
/// Positions this near count as one in the search for a way (m).
const SAME: f64 = 0.06;
/// Ways longer than the shortest by this factor will do: they are found far sooner.
const GREED: f64 = 1.5;
/// States of the search for a way, before it is given up.
const MAX_STATES: usize = 1_200_000;

/// Position on the floor and number of turns from x.
#[derive(Debug, Clone, Copy, PartialEq)]
struct State {
    position: Vector2<f64>,
    heading: usize,
}

struct Walker<'a> {
    apartment: &'a Apartment,
    options: &'a WalkOptions,
    headings: usize,
    /// Where one passes, and where with room to spare.
    ways: Ways,
    comfortable: Ways,
}

impl Apartment {
    /// The poses `T_world_camera` of a walk: camera frames with x right, y down, z forward, the camera level. Empty where
    /// the step or the turn is none, or no way is wide enough for it.
    pub fn walk(&self, options: &WalkOptions) -> Vec<Pose3> {
        let sound = options.step > 0.01 && options.step.is_finite() && (0.01..=PI).contains(&options.turn);
        if !sound {
            return Vec::new();
        }
        let walker = Walker::new(self, options);
        let states = walker.tour().unwrap_or_default();
        let frames = options.num_frames.unwrap_or(states.len());
        states.iter().take(frames).map(|state| walker.pose(state)).collect()
    }
}

/// The pose of a level camera: `heading` is the direction it looks in, from x towards y (rad).
pub fn level_pose(position: Vector3<f64>, heading: f64) -> Pose3 {
    // At heading 0: right is -y, down is -z, forward is x.
    let level = Quaternion::new(0.5, -0.5, 0.5, -0.5);
    let turn = Quaternion::new(libm::cos(heading / 2.0), 0.0, 0.0, libm::sin(heading / 2.0));
    let rotation = UnitQuaternion::new_unchecked(turn * level);
    Isometry3::from_parts(Translation3::from(position), rotation)
}

/// Poses as the homework's files have them: y of the world points up, and the camera looks along -z with y up.
pub fn in_homework_axes(T_world_camera: &Pose3) -> Pose3 {
    let half = 0.5f64.sqrt();
    let R_up = UnitQuaternion::new_unchecked(Quaternion::new(half, -half, 0.0, 0.0)); // z up to y up
    let flip = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0)); // half a turn about x
    let rotation = R_up * T_world_camera.rotation * flip;
    let rotation = if rotation.w < 0.0 { UnitQuaternion::new_unchecked(-rotation.into_inner()) } else { rotation };
    let p = T_world_camera.translation.vector;
    Isometry3::from_parts(Translation3::new(p.x, p.z, -p.y), rotation)
}

impl<'a> Walker<'a> {
    fn new(apartment: &'a Apartment, options: &'a WalkOptions) -> Self {
        let mut ways = Ways::new(apartment.plan.size, SQUARE);
        let mut comfortable = ways.clone();
        for obstacle in obstacles(apartment.space.solids()) {
            ways.block(&obstacle, CLEARANCE);
            comfortable.block(&obstacle, COMFORTABLE);
        }
        let headings = (TAU / options.turn).round().max(1.0) as usize;
        Self { apartment, options, headings, ways, comfortable }
    }

    fn pose(&self, state: &State) -> Pose3 {
        let position = Vector3::new(state.position.x, state.position.y, self.options.camera_height);
        level_pose(position, self.angle(state.heading))
    }

    fn angle(&self, heading: usize) -> f64 {
        TAU * heading as f64 / self.headings as f64
    }

    /// All of the walk, from its start back to it.
    fn tour(&self) -> Option<Vec<State>> {
        let mut random = Random::new(self.options.seed);
        let places = match self.options.tour {
            Tour::Pier => self.round_the_pier()?,
            Tour::AllRooms => self.through_all_rooms(&mut random),
        };
        let (&first, others) = places.split_first()?;
        let quarter = random.uniform(0.0, 4.0).floor() * FRAC_PI_2;
        let heading = match self.options.tour {
            // Into the living room.
            Tour::Pier => {
                let ahead = self.apartment.plan.room(RoomKind::Living)?.inner().way_from(&first);
                libm::atan2(ahead.y, ahead.x)
            }
            Tour::AllRooms => quarter,
        };
        let heading = (heading.rem_euclid(TAU) / TAU * self.headings as f64).round() as usize % self.headings;
        let start = State { position: first, heading };
        let mut states = vec![start];
        for place in others {
            let from = *states.last()?;
            states.extend(self.way_near(&from, place, REACHED, None)?);
        }
        let from = *states.last()?;
        states.extend(self.way_near(&from, &first, BACK, Some(heading))?);
        Some(states)
    }

    /// In one passage, before the pier in the living room, in the other passage, behind the pier.
    fn round_the_pier(&self) -> Option<Vec<Vector2<f64>>> {
        let plan = &self.apartment.plan;
        let (living, kitchen) = (plan.room(RoomKind::Living)?, plan.room(RoomKind::Kitchen)?);
        let between = |opening: &&Opening| {
            opening.kind == OpeningKind::Passage
                && Side::ALL.iter().any(|side| opening.is_in(living, *side))
                && Side::ALL.iter().any(|side| opening.is_in(kitchen, *side))
        };
        let passages: Vec<Vector2<f64>> = plan.openings.iter().filter(between).map(Opening::center).collect();
        let [a, b] = passages[..] else { return None };
        let pier = a.lerp(&b, 0.5);
        let beside = |towards: Vector2<f64>| {
            let across = (b - a).normalize();
            let off = towards - pier;
            let off = (off - across * across.dot(&off)).normalize();
            let places = || (5..14).map(|tenth| pier + off * (0.1 * f64::from(tenth)));
            places()
                .find(|place| self.comfortable.is_free(place))
                .or_else(|| places().find(|place| self.ways.is_free(place)))
        };
        Some(vec![b, beside(living.inner().center())?, a, beside(kitchen.inner().center())?])
    }

    /// The places of all rooms with the most room around them, each the nearest of those left.
    fn through_all_rooms(&self, random: &mut Random) -> Vec<Vector2<f64>> {
        let rooms = &self.apartment.plan.rooms;
        let mut left: Vec<Vector2<f64>> = rooms.iter().filter_map(|room| self.lookout(room, random)).collect();
        let mut places = Vec::new();
        let mut next = if left.is_empty() { None } else { Some(random.uniform(0.0, left.len() as f64) as usize) };
        while let Some(index) = next {
            let place = left.swap_remove(index.min(left.len() - 1));
            let distances = self.ways.distances(&place);
            let distance = |to: &Vector2<f64>| self.ways.cell(to).map_or(u32::MAX, |cell| distances[cell]);
            left.retain(|to| distance(to) < u32::MAX);
            next = (0..left.len()).min_by_key(|&index| distance(&left[index]));
            places.push(place);
        }
        places
    }

    /// A place of a room where one can stand, rather free, rather in the middle.
    fn lookout(&self, room: &Room, random: &mut Random) -> Option<Vector2<f64>> {
        let inner = room.inner();
        let mut best: Option<(f64, Vector2<f64>)> = None;
        for _ in 0..300 {
            let share = Vector2::from_fn(|_, _| random.uniform(0.0, 1.0));
            let place = inner.low + inner.size().component_mul(&share);
            let off = (place - inner.center()).norm() + if self.comfortable.is_free(&place) { 0.0 } else { 2.0 };
            if self.ways.is_free(&place) && best.is_none_or(|(least, _)| off < least) {
                best = Some((off, place));
            }
        }
        best.map(|(_, place)| place)
    }

    /// As near as long steps and wide turns allow.
    fn way_near(&self, from: &State, to: &Vector2<f64>, reach: f64, heading: Option<usize>) -> Option<Vec<State>> {
        (1..=3).find_map(|times| self.way(from, to, f64::from(times) * reach, heading))
    }

    /// Few turns and steps to within `reach` of a place, looking in a direction if one is given, by A* (Hart,
    /// Nilsson and Raphael 1968) over positions and headings. Without the state it starts from.
    fn way(&self, from: &State, to: &Vector2<f64>, reach: f64, heading: Option<usize>) -> Option<Vec<State>> {
        let distances = self.ways.distances(to);
        let steps_left = |position: &Vector2<f64>| {
            let length = self.ways.cell(position).map_or(u32::MAX, |cell| distances[cell]);
            // Lengths along squares are up to a tenth more than the straight way.
            (self.ways.metres(length) * 0.9 - reach).max(0.0) / self.options.step
        };
        let key = |state: &State| {
            let square = |value: f64| (value / SAME).round() as i32;
            (square(state.position.x), square(state.position.y), state.heading)
        };
        let mut known: Vec<(State, usize)> = vec![(*from, 0)];
        let mut costs = FxHashMap::from_iter([(key(from), 0.0)]);
        let mut prices = FxHashMap::default();
        let mut open = BinaryHeap::from([Candidate { estimate: 0.0, cost: 0.0, index: 0 }]);
        while let Some(Candidate { cost, index, .. }) = open.pop() {
            let (state, _) = known[index];
            if costs.get(&key(&state)).is_some_and(|&least| least < cost) {
                continue;
            }
            let there = (state.position - to).norm() < reach && heading.is_none_or(|heading| heading == state.heading);
            if there {
                return Some(trace(&known, index));
            }
            if known.len() > MAX_STATES {
                return None;
            }
            for next in self.moves(&state) {
                let price = *prices.entry(key(&next)).or_insert_with(|| self.price(&next));
                let (total, left) = (cost + price, steps_left(&next.position));
                let better = costs.get(&key(&next)).is_none_or(|&least| total < least);
                if better && left.is_finite() {
                    costs.insert(key(&next), total);
                    open.push(Candidate { estimate: total + GREED * left, cost: total, index: known.len() });
                    known.push((next, index));
                }
            }
        }
        None
    }

    /// A turn to either side, and a step where there is room.
    fn moves(&self, state: &State) -> impl Iterator<Item = State> {
        let turned = |by: usize| State { heading: (state.heading + by) % self.headings, ..*state };
        let angle = self.angle(state.heading);
        let position = state.position + Vector2::new(libm::cos(angle), libm::sin(angle)) * self.options.step;
        let step = self.ways.is_free_between(&state.position, &position).then_some(State { position, ..*state });
        [turned(1), turned(self.headings - 1)].into_iter().chain(step)
    }

    /// What a frame counts: one, more in narrow places, more where nothing but a near wall is seen.
    fn price(&self, state: &State) -> f64 {
        let narrow = if self.comfortable.is_free(&state.position) { 0.0 } else { 0.6 };
        let from = Vector3::new(state.position.x, state.position.y, self.options.camera_height);
        let open = (0..LOOKS).filter(|&look| {
            let angle = self.angle(state.heading) + 0.35 * (look as f64 - (LOOKS / 2) as f64);
            let along = Vector3::new(libm::cos(angle), libm::sin(angle), 0.0);
            self.apartment.space.cast(&from, &along).is_none_or(|hit| hit.distance > OPEN_VIEW)
        });
        let blank = if open.count() > LOOKS / 2 { 0.0 } else { BLANK_VIEW };
        1.0 + narrow + blank
    }
}

/// The states after the first one up to this one.
fn trace(known: &[(State, usize)], end: usize) -> Vec<State> {
    let (mut states, mut index) = (Vec::new(), end);
    while index > 0 {
        let (state, before) = known[index];
        states.push(state);
        index = before;
    }
    states.reverse();
    states
}

/// A state to go on from; the one with the least estimate first, of equals the one found first.
struct Candidate {
    estimate: f64,
    cost: f64,
    index: usize,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.estimate.total_cmp(&self.estimate).then(other.index.cmp(&self.index))
    }
}
