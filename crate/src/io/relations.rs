//! Relations between poses: where pose j lies as seen from pose i.
//!
//! - `EDGE2 i j dx dy dtheta ...` and `EDGE_SE2` (g2o, TORO; m, rad), what follows being the information matrix;
//! - `EDGE3 i j dx dy dz roll pitch yaw ...`; `EDGE_SE3:QUAT i j dx dy dz qx qy qz qw ...`;
//! - `time_i time_j dx dy dz roll pitch yaw` (s, m, rad), as Kuemmerle et al. published them.
//!
//! Lines of other words (`VERTEX2`, `ROBOTLASER1`, ...) and comments are stepped over.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::text::{lines, number, quote, refuse_pointer_and_utf16, without_byte_order_mark};
use crate::geometry::Pose3;
use crate::{Error, Result};

/// How a relation names a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PoseKey {
    /// By its number, from 0.
    Index(usize),
    /// By its time (s).
    Time(f64),
}

/// The motion from one pose to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relation {
    /// Pose i.
    pub from: PoseKey,
    /// Pose j.
    pub to: PoseKey,
    /// T_i_j: pose j in the frame of pose i.
    pub motion: Pose3,
}

impl Relation {
    /// The times of its two poses (s), where it names them so.
    pub fn times(&self) -> Option<[f64; 2]> {
        match (self.from, self.to) {
            (PoseKey::Time(i), PoseKey::Time(j)) => Some([i, j]),
            _ => None,
        }
    }

    /// Whether it names poses by their number and joins one with the next.
    pub fn is_step(&self) -> bool {
        matches!((self.from, self.to), (PoseKey::Index(i), PoseKey::Index(j)) if i.abs_diff(j) == 1)
    }
}

/// Reads relations.
///
/// # Errors
/// When the file has no relation, or a line of one has too few numbers, a word in the place of a number, pose indices that are
/// not whole numbers from 0, or a quaternion of length zero.
pub fn read(bytes: &[u8]) -> Result<Vec<Relation>> {
    refuse_pointer_and_utf16(bytes)?;
    let mut relations = Vec::new();
    for (line, text) in lines(without_byte_order_mark(bytes)) {
        let values = text.split(|&byte| byte == b'#').next().unwrap_or_default();
        let mut words = values.split(|byte| b" \t,;".contains(byte)).filter(|word| !word.is_empty()).peekable();
        let fault = |problem: String| Error::line(line, problem, "See the forms of relations in the help");
        let Some(&first) = words.peek() else { continue };
        let kind = if number(first).is_some() { None } else { words.next() };
        let num_numbers = match kind {
            Some(b"EDGE2" | b"EDGE_SE2") => 5,
            Some(b"EDGE_SE3:QUAT") => 9,
            None | Some(b"EDGE3") => 8,
            Some(_) => continue,
        };
        let mut numbers = Vec::with_capacity(num_numbers);
        for word in words.take(num_numbers) {
            let value = number(word).filter(|value| value.is_finite());
            numbers.push(value.ok_or_else(|| fault(format!("{} is not a finite number", quote(word))))?);
        }
        if numbers.len() < num_numbers {
            return Err(fault(format!("The line has {} of {num_numbers} numbers", numbers.len())));
        }
        let relation = relation(kind.is_some(), &numbers).ok_or_else(|| {
            fault("The pose indices are not whole numbers from 0, or the quaternion is zero".to_owned())
        })?;
        relations.push(relation);
    }
    if relations.is_empty() {
        let remedy = "Give lines EDGE2 i j dx dy dtheta, or time_i time_j dx dy dz roll pitch yaw";
        return Err(Error::whole("The file has no relation", remedy));
    }
    Ok(relations)
}

fn relation(is_edge: bool, numbers: &[f64]) -> Option<Relation> {
    let (x, y, z, rotation) = match *numbers {
        [_, _, x, y, theta] => (x, y, 0.0, UnitQuaternion::from_axis_angle(&Vector3::z_axis(), theta)),
        [_, _, x, y, z, roll, pitch, yaw] => (x, y, z, UnitQuaternion::from_euler_angles(roll, pitch, yaw)),
        [_, _, x, y, z, qx, qy, qz, qw] => (x, y, z, UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-8)?),
        _ => return None,
    };
    let key = |value: f64| {
        if !is_edge {
            return Some(PoseKey::Time(value));
        }
        (value >= 0.0 && value.fract() == 0.0 && value < 1e9).then_some(PoseKey::Index(value as usize))
    };
    let motion = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
    Some(Relation { from: key(numbers[0])?, to: key(numbers[1])?, motion })
}
