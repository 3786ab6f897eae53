//! Logs of planar laser scans: many scans in one file, with what the robot knew of its way.
//!
//! | format | a scan |
//! |---|---|
//! | CARMEN | a line `FLASER n r1 .. rn x y theta odom_x odom_y odom_theta time host time`, or `ROBOTLASER1 ...`, which gives its angles and its limit; `ODOM`, `PARAM` and `VERTEX2` lines are read along |
//! | CMU 16-831 | a line `L x y theta laser_x laser_y laser_theta r1 .. rn time`, in centimetres |
//! | rostopic | a row of `rostopic echo -p`, or of a table with the same names of columns |
//! | [tables](table) | a line of ranges, or a range a line, without words |
//! | CSM | a JSON object with `readings`, `theta` and poses; one or many, a line each or not |
//!
//! The poses in such logs are of two kinds and are kept apart: `odometry` is what the wheels told, `reference` is what
//! somebody computed or measured. Neither is needed to place the scans.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::geometry::{Pose2, RigidMotion};
use crate::io::text::{refuse_pointer_and_utf16, without_byte_order_mark};
use crate::{Error, Result};

pub(crate) mod carmen;
pub(crate) mod cmu;
pub(crate) mod csm;
mod fields;
mod lasers;
mod no_return;
pub(crate) mod rostopic;
pub mod stamps;
mod stated_limit;
pub mod table;
mod units;

/// The bearings of a scan's beams in the laser's frame: x ahead, y left, counter-clockwise (rad).
#[derive(Debug, Clone, PartialEq)]
pub enum Bearings {
    /// Beams at equal steps.
    Even {
        /// Of the first beam (rad).
        start: f64,
        /// From one beam to the next (rad).
        step: f64,
    },
    /// One bearing a beam (rad).
    Listed(Vec<f64>),
}

impl Bearings {
    /// Bearing of a beam (rad); NaN where none is listed.
    pub fn of(&self, beam: usize) -> f64 {
        match self {
            Self::Even { start, step } => start + step * beam as f64,
            Self::Listed(bearings) => bearings.get(beam).copied().unwrap_or(f64::NAN),
        }
    }
}

/// One scan of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserScan {
    /// Number of the scan in its file, from 0: those that were left out count.
    pub number: usize,
    /// Line of the file that it stands on or ends on, from 1.
    pub line: usize,
    /// Bearing of each beam.
    pub bearings: Bearings,
    /// Range of each beam (m); NaN where the log marks the reading as invalid.
    pub ranges: Vec<f32>,
    /// Ranges at or beyond this value mean no return (m); infinite where the log does not state it.
    pub max_range: f64,
    /// Time (s), from whatever zero the recorder had.
    pub time: Option<f64>,
    /// Reference pose of the robot: measured, or corrected by a program.
    pub reference: Option<Pose2>,
    /// Pose of the robot by odometry.
    pub odometry: Option<Pose2>,
}

impl LaserScan {
    /// x and y of every reading with a finite range, in the laser's frame (m); readings beyond `max_range` are included.
    pub fn points(&self) -> Vec<[f32; 2]> {
        let readings = self.ranges.iter().enumerate().filter(|(_, range)| range.is_finite());
        let point = |(beam, &range): (usize, &f32)| {
            let (sin, cos) = self.bearings.of(beam).sin_cos();
            [(f64::from(range) * cos) as f32, (f64::from(range) * sin) as f32]
        };
        readings.map(point).collect()
    }
}

/// Where the odometry of a log comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OdometryOrigin {
    /// From the wheels, by the format.
    Wheels,
    /// From the wheels: the poses repeat those of the log's own lines of odometry.
    RepeatsWheels,
    /// The log does not tell: a program may have corrected the poses.
    #[default]
    Unknown,
}

/// A log: its scans in their order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LaserLog {
    /// At least one.
    pub scans: Vec<LaserScan>,
    /// Where the laser sits on the robot; the identity where the log does not tell.
    pub T_robot_laser: Pose2,
    /// Where the odometry of the scans comes from.
    pub odometry_origin: OdometryOrigin,
    /// Whether the log does not tell which way the laser turns. The angles are read counter-clockwise; if the laser turns clockwise,
    /// the map is a mirror image, although its scans agree.
    pub may_be_mirrored: bool,
    /// Whether the user gave the bearings; otherwise the file did, or they were guessed.
    pub are_bearings_given: bool,
    /// What could not be used of what should have been, in whole sentences.
    pub losses: Vec<String>,
    /// What else is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

/// Largest distance of a laser from the centre of its robot (m): poses at a larger distance are not of one robot at one time.
const MAX_OFFSET: f64 = 2.0;
/// Largest difference between the offsets of one laser in several scans, from the rounding of the file (m, rad).
const SAME_OFFSET: f64 = 0.01;

/// First bytes from which a file's kind is told: enough for a table of a thousand named columns and its first row.
const HEAD_BYTES: usize = 32_768;

/// Whether a file that begins like this is a laser log.
pub fn is_laser_log(head: &[u8]) -> bool {
    let head = without_byte_order_mark(head);
    let text = &head[head.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(head.len())..];
    match text.first() {
        Some(b'{' | b'[') => csm::looks_like_csm(text),
        _ => {
            carmen::looks_like_carmen(text)
                || cmu::looks_like_cmu(text)
                || rostopic::looks_like_rostopic(text)
                || table::looks_like_table(text)
        }
    }
}

/// Reads a laser log of any of these kinds.
///
/// The readers of the kinds are functions of their own (`inline(never)`), and so is what they do line by line: a browser's
/// compiler takes whole functions, and would compile all of them again for the one that runs.
///
/// # Errors
/// Names the line that is wrong; or says that there is no scan in the file, or that its angles are of no unit.
pub fn read(bytes: &[u8]) -> Result<LaserLog> {
    refuse_pointer_and_utf16(bytes)?;
    let text = without_byte_order_mark(bytes);
    let first = text.iter().find(|byte| !byte.is_ascii_whitespace());
    let head = &text[..text.len().min(HEAD_BYTES)];
    let mut log = match first {
        Some(b'{' | b'[') => csm::read(text),
        _ if cmu::looks_like_cmu(head) => cmu::read(text),
        _ if rostopic::looks_like_rostopic(head) => rostopic::read(text),
        _ if carmen::looks_like_carmen(head) => carmen::read(text),
        _ if table::looks_like_table(head) || table::looks_like_column(head) => table::read_guessed(text),
        _ => carmen::read(text),
    }?;
    if log.scans.is_empty() {
        return Err(Error::whole(
            "There is no laser scan in this log",
            "Give a CARMEN log with FLASER or ROBOTLASER1 lines, or JSON objects with readings",
        ));
    }
    units::in_metres_and_radians(&mut log)?;
    log.notes.extend(no_return::drop_number_for_none(&mut log.scans));
    Ok(log)
}

/// The offset that poses of laser and robot have in common; `None` where they differ: then one of the two has been
/// corrected and the other has not.
fn common_offset(pairs: impl Iterator<Item = (Pose2, Pose2)>) -> Option<Pose2> {
    let offsets: Vec<Pose2> =
        pairs.map(|(T_world_robot, T_world_laser)| T_world_robot.inverse() * T_world_laser).collect();
    let first = offsets.first()?;
    let is_same = |offset: &Pose2| lasers::is_same_offset(first, offset);
    (first.translation_norm() < MAX_OFFSET && offsets.iter().all(is_same)).then_some(*first)
}

/// The bearings of a log that does not tell them: a SICK laser looks over 180 degrees, in steps of 1 or 0.5 degrees, or over 100
/// degrees in steps of 0.25; with an even number of readings the last beam is left out.
fn front_laser(num_readings: usize, field_of_view: Option<f64>) -> Bearings {
    let view = field_of_view.unwrap_or(if num_readings == 401 { 100f64.to_radians() } else { PI });
    let num_steps = if num_readings.is_multiple_of(2) { num_readings } else { num_readings - 1 };
    let start = if field_of_view.is_none() && num_readings != 401 { -FRAC_PI_2 } else { -view / 2.0 };
    Bearings::Even { start, step: view / num_steps.max(1) as f64 }
}

/// A pose of three finite numbers.
fn pose(x: f64, y: f64, theta: f64) -> Option<Pose2> {
    [x, y, theta].iter().all(|value| value.is_finite()).then(|| Pose2::new(nalgebra::Vector2::new(x, y), theta))
}
