//! The scans that saw a place of the map: those whose beams ended in a cell, or passed through it.

use nalgebra::Vector2;
use serde::Serialize;

use super::Reconstruction;
use crate::geometry::RigidMotion;

/// A scan with beams that met a cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct ScanAt {
    /// Its number, from 0.
    pub scan: usize,
    /// Where its laser was, in the map (m).
    pub laser: [f64; 2],
    /// Beams that ended in the cell.
    pub num_ended: usize,
    /// Beams that passed through it.
    pub num_passed: usize,
}

impl Reconstruction {
    /// The scans of the map with beams that end in the square cell around a place or pass through it, by their numbers. `side` of the
    /// cell and the place in the map in m.
    pub fn scans_at(&self, place: [f64; 2], side: f64) -> Vec<ScanAt> {
        let Some(run) = &self.run else { return Vec::new() };
        let (place, half) = (Vector2::from(place), side / 2.0);
        let of_scan = |scan: usize| {
            let T_map_laser = run.pose_in_map(scan);
            let laser = T_map_laser.translation.vector;
            let (mut num_ended, mut num_passed) = (0, 0);
            for point in &run.scans[scan].points {
                let (from, to) = (laser - place, T_map_laser.act(point) - place);
                if to.amax() <= half {
                    num_ended += 1;
                } else if meets(&from, &to, half) {
                    num_passed += 1;
                }
            }
            let is_of_it = num_ended + num_passed > 0;
            is_of_it.then_some(ScanAt { scan, laser: laser.into(), num_ended, num_passed })
        };
        run.mapped().filter_map(of_scan).collect()
    }
}

/// Whether a line meets the square of this half side around the origin.
fn meets(from: &Vector2<f64>, to: &Vector2<f64>, half: f64) -> bool {
    let along = to - from;
    let (mut near, mut far) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        if along[axis] == 0.0 {
            if from[axis].abs() > half {
                return false;
            }
            continue;
        }
        let [a, b] = [-half, half].map(|border| (border - from[axis]) / along[axis]);
        (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
    }
    near <= far
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_meet_the_square_that_they_cross_touch_or_begin_in() {
        let meets = |from: [f64; 2], to: [f64; 2]| meets(&from.into(), &to.into(), 1.0);
        assert!(meets([-3.0, 0.5], [3.0, 0.5]) && meets([0.0, 0.0], [9.0, 0.0]) && meets([-2.0, 0.0], [0.0, 2.0]));
        assert!(!meets([-3.0, 1.5], [3.0, 1.5]) && !meets([2.0, 0.0], [9.0, 0.0]) && !meets([-3.0, 0.0], [0.0, 3.0]));
        assert!(!meets([-3.0, 0.0], [-1.5, 0.0]), "it ends before");
    }
}
