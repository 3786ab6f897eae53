//! Whether a registration is believed, and the reason in plain words.

use serde::Serialize;

use crate::map::local::PlanarRegistration;
use crate::registration::free_space::beams::Visibility;

/// How far a frame's pose is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Status {
    /// Registered, and nothing speaks against it.
    Good,
    /// Registered, but something speaks against it.
    Doubtful,
    /// Not registered: the pose is a prediction, and the frame is no part of the map.
    Lost,
}

/// A status with its reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// How far the pose is to be trusted.
    pub status: Status,
    /// Plain words; empty when good.
    pub reason: String,
    /// Share of the returns visible to both sides that agree with what the other saw, 0..=1.
    pub agreement: f64,
}

/// Fewer points than this make no scan.
pub const MIN_POINTS: usize = 10;
/// Below this share of agreeing returns a registration is not believed, ... On the real and on 60 generated recordings right
/// registrations agree by 0.96 to 1, and ones that are wrong by half a metre or more mostly by less than 0.8.
const LOST_AGREEMENT: f64 = 0.6;
/// ... and below this it is doubtful.
const DOUBTFUL_AGREEMENT: f64 = 0.9;
/// Below this share of points with a partner a registration is not believed.
const LOST_FITNESS: f64 = 0.25;
/// A last step that is still as large as this (m) or ...
const RESTLESS_TRANSLATION: f64 = 0.005;
/// ... this (rad) tells of a registration that was cut off on its way.
const RESTLESS_ROTATION: f64 = 0.002;

impl Assessment {
    /// The first scan is where the world begins: there is nothing to doubt.
    pub fn first() -> Self {
        Self { status: Status::Good, reason: String::new(), agreement: 1.0 }
    }

    /// A scan with fewer than [`MIN_POINTS`] points.
    pub fn too_few_points(num_points: usize) -> Self {
        let reason = format!("it has {num_points} usable points, too few to place it");
        Self { status: Status::Lost, reason, agreement: 0.0 }
    }
}

impl Assessment {
    /// Good in itself, but the way to it leads over a scan that is not.
    pub fn hangs_on_a_doubt(&mut self) {
        if self.status == Status::Good {
            self.status = Status::Doubtful;
            "it fits the scans before it, but where these lie is not certain: the way to them leads over a scan that \
             could not be placed for sure, and no place seen again confirms it"
                .clone_into(&mut self.reason);
        }
    }

    /// One of a few that more frames do not hang together with.
    pub fn mark_outnumbered(&mut self) {
        self.status = Status::Lost;
        "more frames fit each other, but not this one: it shows another place".clone_into(&mut self.reason);
    }

    /// Good in itself, but found by frames before it whose own place is in doubt.
    pub fn mark_hanging_on_an_open_place(&mut self) {
        if self.status == Status::Good {
            self.status = Status::Doubtful;
            "it fits the frames before it, but where these lie is not certain, and it shows too little of what is known \
             for sure"
                .clone_into(&mut self.reason);
        }
    }
}

/// Judges a registration by its evidence and by what the sensors saw.
pub fn assess(registration: &PlanarRegistration, visibility: Visibility) -> Assessment {
    let agreement = visibility.agreement();
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let with = |status, reason| Assessment { status, reason, agreement };
    let last = &registration.last;

    if last.num_inliers < MIN_POINTS || registration.fitness < LOST_FITNESS {
        let reason = format!(
            "only {} of its points lie near the scans before it: too little overlap, or a motion larger than the search",
            percent(registration.fitness)
        );
        return with(Status::Lost, reason);
    }
    if agreement < LOST_AGREEMENT {
        let reason = format!(
            "only {} of its returns agree with what the scans before it saw, the others stand in their free space: \
             it shows another place, or the motion is larger than the search",
            percent(agreement)
        );
        return with(Status::Lost, reason);
    }
    if agreement < DOUBTFUL_AGREEMENT {
        let reason = format!("{} of its returns stand where earlier scans saw free space", percent(1.0 - agreement));
        return with(Status::Doubtful, reason);
    }
    if registration.observability.is_undetermined() {
        let direction = registration.observability.weakest_direction;
        let motion = if direction[0].abs() > 0.7 { "the heading" } else { "the position along one direction" };
        return with(Status::Doubtful, format!("the walls in view leave {motion} open"));
    }
    if last.translation_step > RESTLESS_TRANSLATION || last.rotation_step > RESTLESS_ROTATION {
        let reason = format!("the registration was still moving after {} iterations", registration.history.len());
        return with(Status::Doubtful, reason);
    }
    with(Status::Good, String::new())
}
