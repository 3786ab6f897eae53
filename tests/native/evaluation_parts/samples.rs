//! A path to evaluate.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use scanstitch::io::trajectory::Trajectory;

/// A winding path in space.
pub fn winding(n: usize) -> Trajectory {
    let pose = |i: usize| {
        let s = i as f64 / 20.0;
        let rotation = UnitQuaternion::from_euler_angles(0.3 * s.sin(), 0.2 * (2.0 * s).cos(), s);
        Isometry3::from_parts(Translation3::new(3.0 * s.sin(), 2.0 * (0.7 * s).cos(), 0.1 * s), rotation)
    };
    let stamps = (0..n).map(|i| 100.0 + 0.1 * i as f64).collect();
    Trajectory::from_poses(&(0..n).map(pose).collect::<Vec<_>>()).with_stamps(stamps).unwrap()
}
