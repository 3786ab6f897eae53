//! Logs of Carnegie Mellon's course 16-831, "Statistical Techniques in Robotics": centimetres and radians.
//!
//! - `L x y theta laser_x laser_y laser_theta r1 .. rn time`: the robot's pose by its wheels, the laser's, and readings over
//!   180 degrees, from the right to the left;
//! - `O x y theta time`: the robot's pose alone.

use super::fields::{Fields, is_comment, words};
use super::{LaserLog, LaserScan, OdometryOrigin, common_offset, front_laser};
use crate::Result;
use crate::geometry::Pose2;
use crate::io::length_unit::CENTIMETRE;
use crate::io::limits::MAX_BEAMS;
use crate::io::text::{lines, number, quote};

/// Numbers of an `O` line.
const NUM_ODOMETRY: usize = 4;
/// Numbers of an `L` line beside its readings.
const NUM_BESIDE_READINGS: usize = 7;

/// Whether the beginning of a file is one of such a log.
pub(super) fn looks_like_cmu(head: &[u8]) -> bool {
    let mut first = lines(head).map(|(_, line)| line).filter(|line| !is_comment(line)).take(3).peekable();
    let is_known = |line: &[u8]| {
        let mut words = words(line);
        let kind = words.next();
        let numbers = words.take_while(|word| number(word).is_some()).count();
        kind == Some(b"O") && numbers == NUM_ODOMETRY || kind == Some(b"L") && numbers > NUM_BESIDE_READINGS
    };
    // The head may end within its last line.
    first.peek().is_some() && first.all(is_known)
}

#[inline(never)]
pub(super) fn read(bytes: &[u8]) -> Result<LaserLog> {
    let mut scans: Vec<LaserScan> = Vec::new();
    let mut offsets: Vec<(Pose2, Pose2)> = Vec::new();
    for (line, text) in lines(bytes).filter(|(_, text)| !is_comment(text)) {
        let mut fields = Fields::new(text, line);
        fields.next = 1;
        match fields.words.first() {
            Some(&b"O") => {}
            Some(&b"L") => {
                let (scan, T_world_laser) = scan(&mut fields, scans.len())?;
                offsets.extend(scan.odometry.map(|T_world_robot| (T_world_robot, T_world_laser)));
                scans.push(scan);
            }
            word => {
                let problem = format!("{} begins no line of such a log", quote(word.copied().unwrap_or_default()));
                return Err(fields.fault(problem, "Lines begin with L or O: remove it"));
            }
        }
    }
    let T_robot_laser = common_offset(offsets.into_iter()).unwrap_or_else(Pose2::identity);
    Ok(LaserLog { scans, T_robot_laser, odometry_origin: OdometryOrigin::Wheels, ..LaserLog::default() })
}

/// A scan, and where the laser was by the robot's wheels.
fn scan(fields: &mut Fields<'_>, number: usize) -> Result<(LaserScan, Pose2)> {
    let in_metres = |pose: Pose2| Pose2::new(CENTIMETRE.metres * pose.translation.vector, pose.rotation.angle());
    let robot = in_metres(fields.pose("the robot's pose")?);
    let laser = in_metres(fields.pose("the laser's pose")?);
    let num_readings = fields.left().saturating_sub(1);
    if !(2..=MAX_BEAMS).contains(&num_readings) {
        let problem = format!("After the poses there are {num_readings} readings");
        return Err(fields.fault(problem, "The line may be cut off: complete it or remove it"));
    }
    // Less than nothing is no range: its point would lie behind the laser.
    let range = |reading: f64| if reading >= 0.0 { (CENTIMETRE.metres * reading) as f32 } else { f32::NAN };
    let ranges = (0..num_readings).map(|_| fields.number("a reading").map(range));
    let ranges = ranges.collect::<Result<Vec<f32>>>()?;
    let time = fields.number("the time")?;
    let scan = LaserScan {
        number,
        line: fields.line,
        bearings: front_laser(num_readings, None),
        ranges,
        max_range: f64::INFINITY,
        time: Some(time).filter(|time| time.is_finite()),
        reference: None,
        odometry: Some(robot),
    };
    Ok((scan, laser))
}
