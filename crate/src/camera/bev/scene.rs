//! Two cameras and the ground as a user gives them, and their validation.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::ROUNDING;
use super::axes::{BevAxes, EulerOrder};
use super::transfer::{Plane, PlaneTransfer, PosedCamera};
use crate::camera::Pinhole;
use crate::error::{Error, Result};
use crate::geometry::Pose3;
use crate::geometry::rotation::{ROTATION_TOLERANCE, nearest_rotation, rotation_defect};

/// Two cameras over a plane. This is the contents of `scene.json`: SI units and radians.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevScene {
    /// Which way the axes of both cameras and of the world point.
    pub axes: BevAxes,
    /// The ground.
    pub plane: BevPlane,
    /// The camera that points are marked in.
    pub top: BevCamera,
    /// The camera that they are looked for in.
    pub front: BevCamera,
}

/// The ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevPlane {
    /// Level, at this height along the world's up axis.
    Level {
        /// m.
        height: f64,
    },
    /// All points X with `normal . X = offset`.
    Tilted {
        /// At right angles to the plane; of any length but zero, and `offset` is divided by that length.
        normal: [f64; 3],
        /// m, for a normal of length 1.
        offset: f64,
    },
}

/// A camera: its image, intrinsics and pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevCamera {
    /// File of the picture, beside `scene.json`. For the page; nothing is computed from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<String>,
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The intrinsics.
    pub intrinsics: BevIntrinsics,
    /// The pose, in the axes of the scene.
    pub pose: BevPose,
}

/// The side of the image along which a field of view is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevSide {
    /// Along the rows, as Habitat's `hfov` is.
    Horizontal,
    /// Along the columns, as Three.js' `fov` is.
    Vertical,
}

/// The intrinsics of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevIntrinsics {
    /// Square pixels, the optical axis at (width / 2, height / 2).
    FieldOfView {
        /// rad.
        field_of_view: f64,
        /// The side that it is measured along.
        side: BevSide,
    },
    /// All four numbers (pixels).
    Focal {
        /// Focal length along the rows.
        fx: f64,
        /// Focal length along the columns.
        fy: f64,
        /// Column of the optical axis.
        cx: f64,
        /// Row of the optical axis.
        cy: f64,
    },
}

/// The pose of a camera: maps its points, in the scene's camera axes, into the scene's world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevPose {
    /// Position and three turns.
    Euler {
        /// m.
        position: [f64; 3],
        /// The order of the turns.
        order: EulerOrder,
        /// About x, y and z, whatever the order (rad).
        angles: [f64; 3],
    },
    /// Position and quaternion; its length does not matter, unless it is zero.
    Quaternion {
        /// m.
        position: [f64; 3],
        /// i.
        qx: f64,
        /// j.
        qy: f64,
        /// k.
        qz: f64,
        /// The real part.
        qw: f64,
    },
    /// Four rows of a 4 x 4 matrix.
    Matrix {
        /// Rotation and position; the last row is 0 0 0 1.
        T_world_camera: [[f64; 4]; 4],
    },
}

/// The representations of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevPoseKind {
    /// Position and three turns.
    #[default]
    Euler,
    /// Position and quaternion.
    Quaternion,
    /// A 4 x 4 matrix.
    Matrix,
}

/// Largest side of an image (pixels); more is an input error.
const MAX_SIDE: usize = 100_000;

impl BevScene {
    /// Reads `scene.json`.
    ///
    /// # Errors
    /// When the file is no such scene, with the line; what the numbers in it mean is checked where they are used.
    pub fn read(bytes: &[u8]) -> Result<Self> {
        let remedy = "A scene has axes, plane, top and front, as the documentation shows";
        serde_json::from_slice(bytes).map_err(|error| Error::json(&error, remedy))
    }

    /// From pixels of the top view to pixels of the front view.
    ///
    /// # Errors
    /// When a camera or the plane is none, or the plane passes through a camera; the message names which.
    pub fn front_from_top(&self) -> Result<PlaneTransfer> {
        let plane = self.plane.resolve(self.axes)?;
        let top = self.top.resolve(self.axes, "top")?;
        let front = self.front.resolve(self.axes, "front")?;
        for (camera, name) in [(&top, "top"), (&front, "front")] {
            if plane.height_of(camera).abs() < ROUNDING {
                let problem = format!("The ground passes through the {name} camera, which sees it edge on: as a line");
                return Err(Error::whole(problem, "Give the camera a height above the ground, or move the ground"));
            }
        }
        Ok(PlaneTransfer::new(top, front, plane))
    }

    /// From pixels of the front view to pixels of the top view.
    ///
    /// # Errors
    /// As [`front_from_top`](Self::front_from_top).
    pub fn top_from_front(&self) -> Result<PlaneTransfer> {
        let PlaneTransfer { marked, projected, plane, .. } = self.front_from_top()?;
        Ok(PlaneTransfer::new(projected, marked, plane))
    }

    /// The same scene, its two poses given another way. Angles are in the order that is given.
    ///
    /// # Errors
    /// When a camera is none.
    pub fn with_poses(&self, kind: BevPoseKind, order: EulerOrder) -> Result<Self> {
        let given = |camera: &BevCamera, name: &str| -> Result<BevCamera> {
            let T = camera.resolve(self.axes, name)?.T_world_camera;
            let R = T.rotation.to_rotation_matrix().into_inner();
            let pose = BevPose::of(kind, self.axes, &R, &T.translation.vector, order);
            Ok(BevCamera { pose, ..camera.clone() })
        };
        Ok(Self { top: given(&self.top, "top")?, front: given(&self.front, "front")?, ..self.clone() })
    }

    /// The same scene in other axes. Poses keep their kind; angles take the order that the axes are used with.
    ///
    /// # Errors
    /// When a camera is none.
    pub fn in_axes(&self, axes: BevAxes) -> Result<Self> {
        let R_new_old = axes.R_named_world() * self.axes.R_named_world().transpose();
        let plane = match self.plane {
            level @ BevPlane::Level { .. } => level,
            BevPlane::Tilted { normal, offset } => {
                BevPlane::Tilted { normal: (R_new_old * Vector3::from(normal)).into(), offset }
            }
        };
        let turned = |camera: &BevCamera, name: &str| -> Result<BevCamera> {
            let T = camera.resolve(self.axes, name)?.T_world_camera;
            let R = R_new_old * T.rotation.to_rotation_matrix().into_inner();
            let pose =
                BevPose::of(camera.pose.kind(), axes, &R, &(R_new_old * T.translation.vector), axes.euler_order());
            Ok(BevCamera { pose, ..camera.clone() })
        };
        Ok(Self { axes, plane, top: turned(&self.top, "top")?, front: turned(&self.front, "front")? })
    }
}

impl BevPlane {
    /// The plane in the world.
    ///
    /// # Errors
    /// When a number is not finite or the normal is zero.
    pub fn resolve(&self, axes: BevAxes) -> Result<Plane> {
        let (normal, offset) = match *self {
            Self::Level { height } => (axes.up(), height),
            Self::Tilted { normal, offset } => (Vector3::from(normal), offset),
        };
        let length = normal.norm();
        if !(length.is_finite() && offset.is_finite()) {
            return Err(Error::whole("The ground has a number that is not finite", "Give decimal numbers"));
        }
        if length < ROUNDING {
            return Err(Error::whole(
                "The ground's normal is zero, so it points nowhere",
                "Give a direction, say 0 1 0",
            ));
        }
        Ok(Plane { normal: normal / length, offset: offset / length })
    }
}

impl BevCamera {
    /// The camera in the world, its axes x right, y down, z forward. `name` is for the messages.
    ///
    /// # Errors
    /// When the image has no pixels or the intrinsics or the pose are none.
    pub fn resolve(&self, axes: BevAxes, name: &str) -> Result<PosedCamera> {
        let pinhole = self.pinhole(name)?;
        let (R_world_named, position) = self.pose.parts(name)?;
        let R = R_world_named * axes.R_named_camera();
        let rotation = nearest_rotation(&R).unwrap_or_default(); // `parts` gives nothing but rotations
        Ok(PosedCamera { pinhole, T_world_camera: Pose3::from_parts(position.into(), rotation) })
    }

    fn pinhole(&self, name: &str) -> Result<Pinhole> {
        let Self { width, height, .. } = *self;
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            let problem = format!("The {name} camera has {width} x {height} pixels");
            return Err(Error::whole(problem, "Give the size of its image, 512 x 512 for example"));
        }
        match self.intrinsics {
            BevIntrinsics::FieldOfView { field_of_view, side } => {
                if !(field_of_view > 0.0 && field_of_view < PI) {
                    let degrees = field_of_view.to_degrees();
                    let problem = format!("The {name} camera's field of view is {degrees} degrees");
                    return Err(Error::whole(problem, "A plane image shows more than 0 and less than 180 degrees"));
                }
                let horizontal = match side {
                    BevSide::Horizontal => field_of_view,
                    BevSide::Vertical => other_field_of_view(field_of_view, height, width),
                };
                Pinhole::from_field_of_view(width, height, horizontal)
            }
            BevIntrinsics::Focal { fx, fy, cx, cy } => Pinhole::new(width, height, [fx, fy, cx, cy]),
        }
        .map_err(|error| Error::whole(format!("The {name} camera: {}", error.problem), error.remedy))
    }

    /// Whether an image is of the size that this camera is said to have.
    ///
    /// # Errors
    /// When it is not, with both sizes.
    pub fn check_image(&self, name: &str, width: usize, height: usize) -> Result<()> {
        if (width, height) == (self.width, self.height) {
            return Ok(());
        }
        let problem = format!(
            "The image of the {name} view has {width} x {height} pixels, but its camera has {} x {}",
            self.width, self.height
        );
        Err(Error::whole(problem, "Choose the image that belongs to this camera, or give the camera the image's size"))
    }
}

/// The field of view along another side of an image with square pixels (rad), eq. (2): through the tangents.
pub fn other_field_of_view(field_of_view: f64, side: usize, other_side: usize) -> f64 {
    2.0 * ((field_of_view / 2.0).tan() * other_side as f64 / side as f64).atan()
}

impl BevPose {
    /// Rotation and position as given, in the scene's own axes.
    fn parts(&self, name: &str) -> Result<(Matrix3<f64>, Vector3<f64>)> {
        let (R, position) = match *self {
            Self::Euler { position, order, angles } => (order.rotation(angles), position),
            Self::Quaternion { position, qx, qy, qz, qw } => {
                let q = Quaternion::new(qw, qx, qy, qz);
                if q.norm() < 1e-12 {
                    let problem = format!("The {name} camera's quaternion is zero, so it is not a rotation");
                    return Err(Error::whole(problem, "Without any turn it is qx = qy = qz = 0, qw = 1"));
                }
                (UnitQuaternion::from_quaternion(q).to_rotation_matrix().into_inner(), position)
            }
            Self::Matrix { T_world_camera } => parts_of_matrix(&T_world_camera, name)?,
        };
        let position = Vector3::from(position);
        if !(R.iter().all(|value| value.is_finite()) && position.iter().all(|value| value.is_finite())) {
            let problem = format!("The {name} camera's position or orientation has a number that is not finite");
            return Err(Error::whole(problem, "Give decimal numbers"));
        }
        Ok((R, position))
    }

    /// How this pose is given.
    pub fn kind(&self) -> BevPoseKind {
        match self {
            Self::Euler { .. } => BevPoseKind::Euler,
            Self::Quaternion { .. } => BevPoseKind::Quaternion,
            Self::Matrix { .. } => BevPoseKind::Matrix,
        }
    }

    /// The pose with this rotation of our camera axes and this position, in the named axes.
    pub(super) fn of(
        kind: BevPoseKind,
        axes: BevAxes,
        R_ours: &Matrix3<f64>,
        position: &Vector3<f64>,
        order: EulerOrder,
    ) -> Self {
        let R = R_ours * axes.R_named_camera().transpose();
        let position: [f64; 3] = (*position).into();
        match kind {
            BevPoseKind::Euler => Self::Euler { position, order, angles: order.angles(&R) },
            BevPoseKind::Quaternion => {
                let q = nearest_rotation(&R).unwrap_or_default();
                Self::Quaternion { position, qx: q.i, qy: q.j, qz: q.k, qw: q.w }
            }
            BevPoseKind::Matrix => {
                let row = |i: usize| [R[(i, 0)], R[(i, 1)], R[(i, 2)], position[i]];
                Self::Matrix { T_world_camera: [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]] }
            }
        }
    }
}

fn parts_of_matrix(rows: &[[f64; 4]; 4], name: &str) -> Result<(Matrix3<f64>, [f64; 3])> {
    let T = Matrix4::from_fn(|row, column| rows[row][column]);
    let refuse = |what: String, remedy: &str| {
        Err(Error::whole(format!("The 4 x 4 matrix of the {name} camera {what}"), remedy.to_owned()))
    };
    if !T.iter().all(|value| value.is_finite()) {
        return refuse("has a number that is not finite".into(), "Give sixteen decimal numbers");
    }
    let R: Matrix3<f64> = T.fixed_view::<3, 3>(0, 0).into();
    let scale = R.norm();
    let determinant = R.determinant();
    if determinant.abs() <= ROUNDING * scale.powi(3) {
        let what = format!("is singular (determinant {determinant}): it maps space onto a plane");
        return refuse(what, "Its upper left 3 x 3 is a rotation, with determinant 1");
    }
    if rows[3] != [0.0, 0.0, 0.0, 1.0] {
        let what = format!("ends in the row {:?}", rows[3]);
        let remedy = "The last row is 0 0 0 1; is the matrix transposed, so that its position stands at the bottom?";
        return refuse(what, remedy);
    }
    if determinant < 0.0 {
        let what = format!("mirrors (determinant {determinant})");
        return refuse(what, "Its upper left 3 x 3 is a rotation; flip the sign of one axis");
    }
    let Some(rotation) = nearest_rotation(&R).map(|q| q.to_rotation_matrix().into_inner()) else {
        return refuse("is not a rotation".into(), "Its upper left 3 x 3 is a rotation");
    };
    if rotation_defect(&R) > ROTATION_TOLERANCE {
        let deviation = (rotation - R).abs().max();
        let what = format!("is not a rotation: its entries are off by up to {deviation:.3}");
        return refuse(what, "The columns of its upper left 3 x 3 have length 1 and stand at right angles");
    }
    Ok((rotation, [rows[0][3], rows[1][3], rows[2][3]]))
}
