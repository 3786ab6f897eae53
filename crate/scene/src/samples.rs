//! The samples of the page that are rendered from the synthetic flat, as they are committed.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::apartment::walk::level_pose;
use super::apartment::{Apartment, Tour, WalkOptions};
use scanstitch::Result;
use scanstitch::camera::Pinhole;
use scanstitch::geometry::Pose3;

/// Cameras in a flat.
#[derive(Debug, Clone)]
pub struct CameraSample {
    /// The flat.
    pub apartment: Apartment,
    /// The camera.
    pub camera: Pinhole,
    /// Poses `T_world_camera`, x right, y down, z forward; the floor is z = 0.
    pub T_world_camera: Vec<Pose3>,
}

/// The flat of the depth images.
pub const APARTMENT_SEED: u64 = 12;
/// The flat of the top and the front view.
pub const BEV_SEED: u64 = 12;
/// Where both cameras of the views stand (m), and which way they look (rad from x).
const BEV_PLACE: [f64; 3] = [2.4, 3.5, -std::f64::consts::FRAC_PI_2];
/// Heights of the top and the front camera (m).
pub const BEV_HEIGHTS: [f64; 2] = [2.5, 1.0];

/// `www/samples/apartment`: a walk round the pier between living room and kitchen with the homework's camera; steps of
/// 0.3 m and turns of 15 degrees, so that few frames close the loop.
///
/// # Errors
/// No input causes an error: the camera is valid.
pub fn apartment() -> Result<CameraSample> {
    let apartment = Apartment::generate(APARTMENT_SEED);
    let options =
        WalkOptions { tour: Tour::Pier, step: 0.3, turn: std::f64::consts::PI / 12.0, ..WalkOptions::default() };
    let T_world_camera = apartment.walk(&options);
    Ok(CameraSample { camera: Pinhole::new(512, 512, [256.0; 4])?, apartment, T_world_camera })
}

/// `www/samples/bev`: first the camera that looks straight down, then the one that looks ahead, in the homework's layout:
/// 90 degrees of view, 2.5 and 1.0 m above one place of the floor. The top of the upper image is what lies ahead.
///
/// # Errors
/// No input causes an error: the camera is valid.
pub fn bev() -> Result<CameraSample> {
    let [x, y, heading] = BEV_PLACE;
    let [top, front] = BEV_HEIGHTS;
    let T_world_camera = vec![looking_down(x, y, top, heading), level_pose(Vector3::new(x, y, front), heading)];
    Ok(CameraSample {
        camera: Pinhole::new(1024, 1024, [512.0; 4])?,
        apartment: Apartment::generate(BEV_SEED),
        T_world_camera,
    })
}

/// A camera that looks straight down; upwards in its image is the direction `heading` (rad from x).
pub fn looking_down(x: f64, y: f64, z: f64, heading: f64) -> Pose3 {
    // At heading 0: right is -y, down is -x, forward is -z.
    let half = 0.5f64.sqrt();
    let down = Quaternion::new(0.0, half, -half, 0.0);
    let turn = Quaternion::new(libm::cos(heading / 2.0), 0.0, 0.0, libm::sin(heading / 2.0));
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::new_unchecked(turn * down))
}
