//! What may move when a camera or the ground is adjusted, and where to.

use nalgebra::{DVector, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::transfer::{Plane, PlaneTransfer, PosedCamera};

/// One of the two cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevRole {
    /// The camera in which points are marked.
    Top,
    /// The camera that they are looked for in.
    Front,
}

/// A parameter that is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevParameter {
    /// The rotation about the camera's own x axis.
    Pitch,
    /// The height above the ground.
    Height,
    /// The position along the ground: two parameters.
    Offset,
    /// The height of the ground itself, both cameras staying where they are.
    Ground,
}

/// Options of the refinement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevRefinementOptions {
    /// The camera that is adjusted; the other one is fixed.
    pub camera: BevRole,
    /// The parameters that are refined.
    pub parameters: Vec<BevParameter>,
}

impl Default for BevRefinementOptions {
    fn default() -> Self {
        let parameters = vec![BevParameter::Pitch, BevParameter::Height, BevParameter::Offset];
        Self { camera: BevRole::Front, parameters }
    }
}

/// One of the numbers that are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Motion {
    Pitch,
    Height,
    Right,
    Ahead,
    Ground,
}

/// What may move, and where to.
pub(super) struct Directions {
    pub camera: BevRole,
    pub free: Vec<Motion>,
    /// 1 where the plane's normal points to the side of the top camera, -1 otherwise.
    pub ground_side: f64,
    up: Vector3<f64>,
    right: Vector3<f64>,
    ahead: Vector3<f64>,
}

impl Directions {
    pub fn of(start: &PlaneTransfer, options: &BevRefinementOptions) -> Self {
        let camera = match options.camera {
            BevRole::Top => &start.marked,
            BevRole::Front => &start.projected,
        };
        let Plane { normal, .. } = start.plane;
        let up = normal * start.plane.height_of(camera).signum();
        let on_plane = |axis: Vector3<f64>| axis - up * up.dot(&axis);
        let R = camera.T_world_camera.rotation;
        let x = on_plane(R * Vector3::x());
        // A camera that lies on its side has its y axis along the plane.
        let right = if x.norm() > 0.1 { x } else { on_plane(R * Vector3::y()) }.normalize();
        let free = [
            (Motion::Pitch, BevParameter::Pitch),
            (Motion::Height, BevParameter::Height),
            (Motion::Right, BevParameter::Offset),
            (Motion::Ahead, BevParameter::Offset),
            (Motion::Ground, BevParameter::Ground),
        ];
        let free = free.iter().filter(|(_, parameter)| options.parameters.contains(parameter));
        Self {
            camera: options.camera,
            free: free.map(|&(motion, _)| motion).collect(),
            ground_side: start.plane.height_of(&start.marked).signum(),
            up,
            right,
            ahead: up.cross(&right),
        }
    }

    /// Where the camera goes; `None` for what is no shift of it.
    pub fn direction(&self, motion: Motion) -> Option<Vector3<f64>> {
        match motion {
            Motion::Pitch | Motion::Ground => None,
            Motion::Height => Some(self.up),
            Motion::Right => Some(self.right),
            Motion::Ahead => Some(self.ahead),
        }
    }

    /// The cameras with one of them moved by `theta`.
    pub fn moved(&self, start: &PlaneTransfer, theta: &DVector<f64>) -> PlaneTransfer {
        let mut shift = Vector3::zeros();
        let mut pitch = 0.0;
        let mut plane = start.plane;
        for (&motion, &amount) in self.free.iter().zip(theta.iter()) {
            match motion {
                Motion::Pitch => pitch = amount,
                Motion::Ground => plane.offset += self.ground_side * amount,
                _ => shift += self.direction(motion).unwrap_or_default() * amount,
            }
        }
        let moved = |camera: &PosedCamera| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pitch);
            let T_world_camera = Translation3::from(shift) * camera.T_world_camera * turn;
            PosedCamera { T_world_camera, ..*camera }
        };
        match self.camera {
            BevRole::Top => PlaneTransfer::new(moved(&start.marked), start.projected, plane),
            BevRole::Front => PlaneTransfer::new(start.marked, moved(&start.projected), plane),
        }
    }
}
