//! Registration of beams to the walls of a map: Gauss-Newton on distances to walls, weighted by how likely a return is one of a wall.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::field::MapField;
use super::likelihood::{Beam, BeamModel};
use crate::geometry::{Pose2, RigidMotion};

/// A pose known beforehand, with its information (perturbation on the right, rotation first).
#[derive(Debug, Clone, Copy)]
pub struct Prior {
    pub pose: Pose2,
    pub information: Matrix3<f64>,
}

/// A registered pose.
#[derive(Debug, Clone, Copy)]
pub struct Refined {
    pub pose: Pose2,
    /// What the beams alone tell of it (perturbation on the right, rotation first).
    pub information: Matrix3<f64>,
}

/// The share of the information of beams that is independent.
pub(super) const INDEPENDENT_BEAMS: f64 = 0.2;
/// Standard deviations in turn, as multiples of the model's: from the step of a search down.
const WIDTHS: [f64; 6] = [3.0, 2.0, 1.5, 1.0, 1.0, 1.0];
/// Keeps the equations solvable where walls leave a direction open: less than one beam tells.
const DAMPING: f64 = 1e-6;

/// Registers beams from a pose.
pub fn refine(field: &MapField, model: &BeamModel, beams: &[Beam], from: &Pose2, prior: Option<&Prior>) -> Refined {
    let mut pose = *from;
    for width in WIDTHS {
        let (mut H, mut b) = equations(field, model, beams, &pose, width);
        if let Some(prior) = prior {
            H += prior.information;
            b += prior.information * (pose.inverse() * prior.pose).log();
        }
        H += Matrix3::identity() * (DAMPING * H.trace()).max(f64::MIN_POSITIVE);
        let Some(step) = H.cholesky().map(|factor| factor.solve(&b)) else { break };
        pose = (pose * Pose2::exp(&step)).renormalized();
    }
    Refined { pose, information: equations(field, model, beams, &pose, 1.0).0 }
}

/// The inverse of a symmetric matrix that has one but for rounding.
pub(super) fn inverse(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let symmetric = 0.5 * (matrix + matrix.transpose());
    symmetric.try_inverse().unwrap_or_else(|| Matrix3::identity() * 1e6)
}

/// The normal equations H * step = b of a perturbation on the right, by standard deviations so many times wider than the model's.
fn equations(
    field: &MapField,
    model: &BeamModel,
    beams: &[Beam],
    pose: &Pose2,
    width: f64,
) -> (Matrix3<f64>, Vector3<f64>) {
    let (mut H, mut b) = (Matrix3::zeros(), Vector3::zeros());
    let back = pose.rotation.inverse();
    for beam in beams {
        let end = pose.act(&beam.end);
        let Some(cell) = field.index(&end) else { continue };
        let Some(wall) = field.nearest_wall(cell) else { continue };
        let sigma = width * model.sigma(wall.variance);
        let weight = INDEPENDENT_BEAMS / (sigma * sigma) * model.weight(field.distance(cell, &end), width);
        let mut add = |direction: Vector2<f64>| {
            let residual = direction.dot(&(end - wall.point));
            let local = back * direction;
            let J = Vector3::new(beam.end.perp(&local), local.x, local.y);
            H += weight * J * J.transpose();
            b -= weight * residual * J;
        };
        match wall.normal {
            Some(normal) => add(normal),
            None => [Vector2::x(), Vector2::y()].into_iter().for_each(add),
        }
    }
    (H, b)
}
