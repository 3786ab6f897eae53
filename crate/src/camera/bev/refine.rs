//! Refinement of a camera's pose from pairs of pixels that show the same point of the ground.
//!
//! The camera's pose is `T = Trans(h up + r right + a ahead) T_0 Rx(pitch)`: its height and its offset along the ground,
//! and a rotation about its own x axis. `up` is the plane's normal, `right` the camera's x axis projected onto the plane,
//! `ahead` perpendicular to both. The ground may be raised as well, `delta = delta_0 + g`: a simulator's floor is often a few
//! centimetres off the height to which its cameras refer. The sum of squared distances between projected and marked pixels in
//! the front view is minimised by Gauss-Newton, a step being halved as long as it increases the sum.

use nalgebra::{DMatrix, DVector, Matrix2x3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use super::ROUNDING;
use super::directions::{BevParameter, BevRefinementOptions, BevRole, Directions, Motion};
use super::scene::{BevPlane, BevPose, BevScene};
use super::transfer::PlaneTransfer;
use crate::error::{Error, Result};
use crate::geometry::Pose3;
use crate::geometry::jacobi::MAX_SWEEPS;

/// Two pixels that show the same point of the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevPair {
    /// Pixel of the top view.
    pub top: [f64; 2],
    /// Pixel of the front view.
    pub front: [f64; 2],
}

/// The refined scene and the evidence for it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevRefinement {
    /// The scene with the camera moved; poses keep their kind.
    pub scene: BevScene,
    /// Rotation of the camera upwards (rad).
    pub pitch: f64,
    /// Change of its height (m).
    pub height: f64,
    /// Translation to its right (m).
    pub right: f64,
    /// Translation ahead (m); for a camera that looks straight down, towards the upper edge of its image.
    pub ahead: f64,
    /// Change of the ground's height (m).
    pub ground: f64,
    /// For each pair the projected minus the marked pixel in the front view, before the refinement.
    pub residuals_before: Vec<[f64; 2]>,
    /// The same after the refinement.
    pub residuals: Vec<[f64; 2]>,
    /// Root mean square distance between projected and marked pixels, before the refinement.
    pub rmse_before: f64,
    /// The same after the refinement.
    pub rmse: f64,
    /// Number of steps.
    pub iterations: usize,
    /// Whether the last step was below the limit, or no part of it reduced the error.
    pub converged: bool,
}

/// Step below which the iteration has converged (rad, m).
const STEP_EPS: f64 = 1e-11;

/// Adjusts a camera until the projections of the pairs fall on their marks.
///
/// # Errors
/// When the scene is invalid, no parameter is to be refined, a pair cannot be projected, or the pairs do not determine the
/// parameters.
pub fn refine(scene: &BevScene, pairs: &[BevPair], options: &BevRefinementOptions) -> Result<BevRefinement> {
    let start = scene.front_from_top()?;
    let directions = Directions::of(&start, options);
    check(&start, pairs, &directions)?;

    let mut theta = DVector::zeros(directions.free.len());
    let mut residuals = residuals_of(&start, pairs).unwrap_or_default();
    let residuals_before = residuals.clone();
    let (mut iterations, mut converged) = (0, false);
    while iterations < MAX_SWEEPS && !converged {
        iterations += 1;
        let moved = directions.moved(&start, &theta);
        let step = gauss_newton_step(&moved, pairs, &residuals, &directions)?;
        let Some((share, better)) = shortened(&start, pairs, &directions, &theta, &step, squares(&residuals)) else {
            converged = true; // no shorter step is better either
            break;
        };
        converged = step.norm() * share < STEP_EPS;
        theta += step * share;
        residuals = better;
    }

    let moved = directions.moved(&start, &theta);
    let change = |motion: Motion| directions.free.iter().position(|&free| free == motion).map_or(0.0, |i| theta[i]);
    Ok(BevRefinement {
        scene: written_back(scene, &moved, options),
        pitch: change(Motion::Pitch),
        height: change(Motion::Height),
        right: change(Motion::Right),
        ahead: change(Motion::Ahead),
        ground: change(Motion::Ground),
        rmse_before: (squares(&residuals_before) / pairs.len() as f64).sqrt(),
        rmse: (squares(&residuals) / pairs.len() as f64).sqrt(),
        residuals_before,
        residuals,
        iterations,
        converged,
    })
}

fn check(start: &PlaneTransfer, pairs: &[BevPair], directions: &Directions) -> Result<()> {
    if directions.free.is_empty() {
        return Err(Error::whole("Nothing is to be refined", "Choose pitch, height or offset"));
    }
    for (index, pair) in pairs.iter().enumerate() {
        if start.point(pair.top).projected.is_none() {
            let problem = format!("The top pixel of pair {} is not seen by the front camera", index + 1);
            return Err(Error::whole(problem, "Remove the pair, or turn the cameras roughly right first"));
        }
    }
    if pairs.len() * 2 < directions.free.len() {
        let problem =
            format!("{} pairs give {} numbers, but {} are wanted", pairs.len(), pairs.len() * 2, directions.free.len());
        return Err(Error::whole(problem, "Mark more pairs, or refine less"));
    }
    Ok(())
}

/// Projected less marked pixel of each pair; `None` where a projection is none.
fn residuals_of(transfer: &PlaneTransfer, pairs: &[BevPair]) -> Option<Vec<[f64; 2]>> {
    let residual = |pair: &BevPair| {
        let [u, v] = transfer.point(pair.top).projected?;
        Some([u - pair.front[0], v - pair.front[1]])
    };
    pairs.iter().map(residual).collect()
}

fn squares(residuals: &[[f64; 2]]) -> f64 {
    residuals.iter().map(|[u, v]| u * u + v * v).sum()
}

/// Solves H step = -b with H = sum J^T J, b = sum J^T residual.
fn gauss_newton_step(
    transfer: &PlaneTransfer,
    pairs: &[BevPair],
    residuals: &[[f64; 2]],
    directions: &Directions,
) -> Result<DVector<f64>> {
    let size = directions.free.len();
    let mut H = DMatrix::zeros(size, size);
    let mut b = DVector::zeros(size);
    for (pair, residual) in pairs.iter().zip(residuals) {
        let Some(J) = jacobian(transfer, pair, directions) else { continue };
        H += J.transpose() * &J;
        b += J.transpose() * DVector::from_row_slice(residual);
    }
    // Radians and metres are made comparable before asking whether H has an inverse.
    let scale: DVector<f64> = H.diagonal().map(|value: f64| if value > 0.0 { 1.0 / value.sqrt() } else { 1.0 });
    let scaled = DMatrix::from_fn(size, size, |i, j| H[(i, j)] * scale[i] * scale[j]);
    let smallest = scaled.clone().symmetric_eigenvalues().min();
    // Scaled to a unit diagonal.
    let solved = if smallest > ROUNDING { scaled.cholesky() } else { None };
    let Some(cholesky) = solved else {
        return Err(Error::whole(
            "The pairs do not tell apart what is to be refined",
            "Spread them over near and far, left and right, or refine less at once",
        ));
    };
    Ok(-cholesky.solve(&b.component_mul(&scale)).component_mul(&scale))
}

/// Derivative of the projected pixel by the numbers that are estimated; a column each.
fn jacobian(transfer: &PlaneTransfer, pair: &BevPair, directions: &Directions) -> Option<DMatrix<f64>> {
    let X = transfer.ground(pair.top)?;
    let front = &transfer.projected;
    let point = front.T_world_camera.inverse_transform_point(&X.into()).coords;
    if point.z <= 0.0 {
        return None;
    }
    let of_pixel: Matrix2x3<f64> = front.pinhole.projection_jacobian(&point);
    let R_front = front.T_world_camera.rotation.to_rotation_matrix();
    let column = |motion: Motion| -> Vector3<f64> {
        match (directions.camera, directions.direction(motion)) {
            // Of X' = Rx^T R_0^T (X - C), eq. (5), by C and by the turn.
            (BevRole::Front, Some(direction)) => -(R_front.inverse() * direction),
            (BevRole::Front, None) if motion == Motion::Pitch => -Vector3::x().cross(&point),
            _ => R_front.inverse() * ground_derivative(transfer, pair, directions, motion),
        }
    };
    let columns: Vec<_> = directions.free.iter().map(|&motion| of_pixel * column(motion)).collect();
    Some(DMatrix::from_fn(2, columns.len(), |row, index| columns[index][row]))
}

/// Derivative of the point of the ground, eqs. (3) and (4), by a motion of the top camera or of the ground. Whatever moves
/// the ray's point by dX without the plane moves it by `dX - r (n . dX) / (n . r)` on it.
fn ground_derivative(
    transfer: &PlaneTransfer,
    pair: &BevPair,
    directions: &Directions,
    motion: Motion,
) -> Vector3<f64> {
    let top = &transfer.marked;
    let normal = transfer.plane.normal;
    let r = top.ray(pair.top);
    if motion == Motion::Ground {
        return r * (directions.ground_side / normal.dot(&r));
    }
    let moved = directions.direction(motion).unwrap_or_else(|| {
        let t = -transfer.plane.height_of(top) / normal.dot(&r);
        let d = top.pinhole.ray(pair.top[0], pair.top[1]);
        top.T_world_camera.rotation * Vector3::x().cross(&d) * t
    });
    moved - r * (normal.dot(&moved) / normal.dot(&r))
}

/// The largest of the shares 1, 1/2, 1/4, ... of a step that makes the sum of squares smaller, and the residuals there.
fn shortened(
    start: &PlaneTransfer,
    pairs: &[BevPair],
    directions: &Directions,
    theta: &DVector<f64>,
    step: &DVector<f64>,
    before: f64,
) -> Option<(f64, Vec<[f64; 2]>)> {
    let halved = |share: &f64| Some(share / 2.0).filter(|share| step.norm() * share >= STEP_EPS);
    std::iter::successors(Some(1.0), halved).find_map(|share| {
        let moved = directions.moved(start, &(theta + step * share));
        let residuals = residuals_of(&moved, pairs)?;
        (squares(&residuals) < before).then_some((share, residuals))
    })
}

/// The scene with the moved camera and ground, written as they were given.
fn written_back(scene: &BevScene, moved: &PlaneTransfer, options: &BevRefinementOptions) -> BevScene {
    let mut scene = scene.clone();
    if options.parameters.contains(&BevParameter::Ground) {
        scene.plane = match scene.plane {
            BevPlane::Level { .. } => BevPlane::Level { height: moved.plane.offset },
            BevPlane::Tilted { normal, .. } => {
                BevPlane::Tilted { normal, offset: moved.plane.offset * Vector3::from(normal).norm() }
            }
        };
        if options.parameters.len() == 1 {
            return scene; // the camera was not touched, not even in its last digit
        }
    }
    let (camera, posed) = match options.camera {
        BevRole::Top => (&mut scene.top, &moved.marked),
        BevRole::Front => (&mut scene.front, &moved.projected),
    };
    let Pose3 { rotation, translation } = posed.T_world_camera;
    let order = match camera.pose {
        BevPose::Euler { order, .. } => order,
        BevPose::Quaternion { .. } | BevPose::Matrix { .. } => scene.axes.euler_order(),
    };
    let R = Rotation3::from(rotation).into_inner();
    camera.pose = BevPose::of(camera.pose.kind(), scene.axes, &R, &translation.vector, order);
    scene
}

#[cfg(test)]
mod tests {
    use super::super::presets::homework_views;
    use super::*;

    #[test]
    fn jacobian_is_the_numeric_one_for_either_camera() {
        let mut scene = homework_views();
        if let BevPose::Euler { angles, .. } = &mut scene.front.pose {
            *angles = [-0.2, 0.1, 0.05];
        }
        if let BevPose::Euler { angles, .. } = &mut scene.top.pose {
            angles[1] += 0.15;
        }
        let start = scene.front_from_top().unwrap();
        let pair = BevPair { top: [300.0, 90.0], front: [0.0, 0.0] };
        for camera in [BevRole::Top, BevRole::Front] {
            let parameters =
                vec![BevParameter::Pitch, BevParameter::Height, BevParameter::Offset, BevParameter::Ground];
            let directions = Directions::of(&start, &BevRefinementOptions { camera, parameters });
            let J = jacobian(&start, &pair, &directions).unwrap();
            assert_eq!(J.shape(), (2, 5));
            for column in 0..5 {
                let at = |step: f64| {
                    let theta = DVector::from_fn(5, |row, _| if row == column { step } else { 0.0 });
                    DVector::from_row_slice(&residuals_of(&directions.moved(&start, &theta), &[pair]).unwrap()[0])
                };
                let numeric = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((J.column(column) - &numeric).norm() < 1e-5 * numeric.norm().max(1.0), "{camera:?}, {column}");
            }
        }
    }
}
