//! The least-squares similarity between corresponding points: Umeyama, "Least-squares estimation of transformation parameters
//! between two point patterns", IEEE PAMI 13 (1991).

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use crate::geometry::jacobi::MAX_SWEEPS;
use crate::{Error, Result};

/// Ratio of the second to the largest singular value of the covariance below which the points lie on a line to within the
/// rounding of a file with nine decimals, so that the rotation about the line is arbitrary.
const MIN_SINGULAR_RATIO: f64 = 1e-9;

/// A rotation, a scale and a translation: p -> scale * rotation * p + translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// R.
    pub rotation: Matrix3<f64>,
    /// t (m).
    pub translation: Vector3<f64>,
    /// c.
    pub scale: f64,
}

impl Similarity {
    /// Rotation and translation zero, scale 1.
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), translation: Vector3::zeros(), scale: 1.0 }
    }
}

/// A fitted similarity, and whether the points determine all of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The similarity with the least sum of squared distances.
    pub similarity: Similarity,
    /// Whether one of the two point sets lies on a line to within rounding. The rotation about that line is then arbitrary: no
    /// distance between the points depends on it, but every orientation does.
    pub is_about_a_line: bool,
    /// Whether one of the two point sets stays in one place, so that neither the rotation nor the scale is determined.
    pub is_in_place: bool,
}

/// The similarity with the least sum of squared distances from the mapped `source` points to the `target` points of the
/// same index; with scale 1 unless `with_scale`.
///
/// # Errors
/// When the points do not determine a rotation, by evo's rule: two singular values of their covariance must be larger than the
/// epsilon of double precision, which excludes fewer than three points, coincident points and collinear points.
pub fn umeyama(source: &[Vector3<f64>], target: &[Vector3<f64>], with_scale: bool) -> Result<Fit> {
    let n = source.len().min(target.len());
    let Moments { mean_source, mean_target, variance, covariance: Svd { U, D, V } } = moments(source, target)?;
    if D.x <= f64::EPSILON {
        return Err(degenerate(n, "one of the two stays in one place"));
    }
    if D.y <= f64::EPSILON {
        return Err(degenerate(n, "one of the two stays on a straight line, about which it may be turned at will"));
    }
    // S, eq. 43, which gives a rotation even where a reflection would fit better.
    let mirrored = U.determinant() * V.determinant() < 0.0;
    let S = Vector3::new(1.0, 1.0, if mirrored { -1.0 } else { 1.0 });
    // Eqs. 40, 42 and 41.
    let rotation = U * Matrix3::from_diagonal(&S) * V.transpose();
    let scale = if with_scale { D.dot(&S) / variance } else { 1.0 };
    let translation = mean_target - scale * (rotation * mean_source);
    let similarity = Similarity { rotation, translation, scale };
    Ok(Fit { similarity, is_about_a_line: D.y <= MIN_SINGULAR_RATIO * D.x, is_in_place: false })
}

/// As [`umeyama`], also for collinear points, which are turned no more than their direction demands, and for points that stay
/// in one place, which are shifted alone: where the points do not determine the rotation, all rotations have the same sum of
/// squared distances.
///
/// # Errors
/// When there are fewer than three points, or their spread is too large for double precision.
pub fn best_fit(source: &[Vector3<f64>], target: &[Vector3<f64>], with_scale: bool) -> Result<Fit> {
    let fit = umeyama(source, target, with_scale);
    if fit.is_ok() || source.len().min(target.len()) < 3 {
        return fit;
    }
    let Moments { mean_source, mean_target, variance, covariance: Svd { U, D, V } } = moments(source, target)?;
    let is_in_place = D.x <= f64::EPSILON;
    let (from, to): (Vector3<f64>, Vector3<f64>) = (V.column(0).into(), U.column(0).into());
    let half_turn = || Rotation3::from_axis_angle(&Unit::new_normalize(any_perpendicular(&from)), std::f64::consts::PI);
    let turned = || Rotation3::rotation_between(&from, &to).unwrap_or_else(half_turn).into_inner();
    let rotation = if is_in_place { Matrix3::identity() } else { turned() };
    let scale = if with_scale && !is_in_place { D.x / variance } else { 1.0 };
    let translation = mean_target - scale * (rotation * mean_source);
    Ok(Fit { similarity: Similarity { rotation, translation, scale }, is_about_a_line: !is_in_place, is_in_place })
}

/// What the fit depends on.
struct Moments {
    mean_source: Vector3<f64>,
    mean_target: Vector3<f64>,
    /// Of the source.
    variance: f64,
    /// Of target and source.
    covariance: Svd,
}

fn moments(source: &[Vector3<f64>], target: &[Vector3<f64>]) -> Result<Moments> {
    let n = source.len().min(target.len());
    if n == 0 {
        return Err(degenerate(n, "there are none"));
    }
    // Means, eqs. 34 and 35.
    let mean = |points: &[Vector3<f64>]| points[..n].iter().sum::<Vector3<f64>>() / n as f64;
    let (mean_source, mean_target) = (mean(source), mean(target));
    // Variance of the source, eq. 36, and covariance, eq. 38.
    let mut variance = 0.0;
    let mut covariance = Matrix3::zeros();
    for (x, y) in source.iter().zip(target) {
        let (x, y) = (x - mean_source, y - mean_target);
        variance += x.norm_squared();
        covariance += y * x.transpose();
    }
    let covariance = svd(&(covariance / n as f64));
    if !covariance.D.x.is_finite() {
        return Err(degenerate(n, "their spread is too large for double precision"));
    }
    Ok(Moments { mean_source, mean_target, variance: variance / n as f64, covariance })
}

fn degenerate(n: usize, why: &str) -> Error {
    Error::whole(
        format!("{n} pairs of positions do not fix the alignment: {why}"),
        "Give three poses or more that have a partner, or do not align",
    )
}

/// A singular value decomposition, U diag(D) V^T, D sorted from the largest.
struct Svd {
    U: Matrix3<f64>,
    D: Vector3<f64>,
    V: Matrix3<f64>,
}

/// One-sided Jacobi rotations, which compute small singular values to the same relative accuracy as large ones: Demmel and
/// Veselic, "Jacobi's method is more accurate than QR", SIAM J. Matrix Anal. Appl. 13 (1992).
fn svd(matrix: &Matrix3<f64>) -> Svd {
    let (mut A, mut V) = (*matrix, Matrix3::identity());
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (alpha, beta) = (A.column(p).norm_squared(), A.column(q).norm_squared());
            let gamma = A.column(p).dot(&A.column(q));
            if gamma.abs() <= f64::EPSILON * (alpha * beta).sqrt() || gamma == 0.0 {
                continue;
            }
            rotated = true;
            let zeta = (beta - alpha) / (2.0 * gamma);
            let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            let sine = cosine * tangent;
            for matrix in [&mut A, &mut V] {
                let (a, b) = (matrix.column(p).into_owned(), matrix.column(q).into_owned());
                matrix.set_column(p, &(a * cosine - b * sine));
                matrix.set_column(q, &(a * sine + b * cosine));
            }
        }
        if !rotated {
            break;
        }
    }
    let lengths = [0, 1, 2].map(|column| A.column(column).norm());
    let mut order = [0, 1, 2];
    order.sort_by(|&a: &usize, &b| lengths[b].total_cmp(&lengths[a]));
    let D = Vector3::from(order.map(|column| lengths[column]));
    let columns = |M: &Matrix3<f64>| Matrix3::from_columns(&order.map(|column| M.column(column).into_owned()));
    let (A, V) = (columns(&A), columns(&V));
    let u0 = A.column(0).try_normalize(0.0).unwrap_or_else(Vector3::x);
    let u1 = A.column(1).try_normalize(0.0).unwrap_or_else(|| any_perpendicular(&u0));
    // For coplanar points the third column is a rounding error; the other two fix its direction up to the sign.
    let third = A.column(2);
    let normal = u0.cross(&u1).normalize();
    let u2 = if third.dot(&normal) < 0.0 { -normal } else { normal };
    Svd { U: Matrix3::from_columns(&[u0, u1, u2]), D, V }
}

fn any_perpendicular(direction: &Vector3<f64>) -> Vector3<f64> {
    let axis = if direction.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    direction.cross(&axis).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_points_leave_open_is_told_and_the_rest_is_fitted() {
        let along = |direction: Vector3<f64>, offset: Vector3<f64>| -> Vec<_> {
            (0..20).map(|i| offset + direction * f64::from(i)).collect()
        };
        let target = along(Vector3::new(0.3, 0.1, -0.2), Vector3::zeros());
        for direction in [Vector3::new(0.1, 0.3, 0.2), Vector3::new(-0.3, -0.1, 0.2), Vector3::new(0.3, 0.1, -0.2)] {
            let source = along(2.0 * direction, Vector3::new(4.0, 5.0, 6.0));
            let fit = best_fit(&source, &target, true).unwrap();
            let Similarity { rotation, translation, scale } = fit.similarity;
            assert!((scale - 0.5).abs() < 1e-12 && (rotation.determinant() - 1.0).abs() < 1e-12 && fit.is_about_a_line);
            for (from, to) in source.iter().zip(&target) {
                assert!((scale * (rotation * from) + translation - to).norm() < 1e-12);
            }
        }
        let still = vec![Vector3::new(1.0, 2.0, 3.0); 20];
        for (source, goal) in [(&target, &still), (&still, &target), (&still, &still)] {
            let fit = best_fit(source, goal, true).unwrap();
            assert!(fit.is_in_place && !fit.is_about_a_line);
            assert!(fit.similarity.scale == 1.0 && fit.similarity.rotation == Matrix3::identity());
            let sum: Vector3<f64> = source.iter().zip(goal).map(|(s, g)| s + fit.similarity.translation - g).sum();
            assert!(sum.norm() < 1e-12);
        }
        assert!(best_fit(&target[..2], &target[..2], false).is_err());
    }

    #[test]
    fn singular_values_large_and_small() {
        let rotation = |x: f64| nalgebra::Rotation3::from_euler_angles(x, 2.0 * x, -x).into_inner();
        for values in [[3.0, 2.0, 1.0], [1.0, 1e-7, 1e-13], [5.0, 5.0, 5.0], [2.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]]
        {
            let D = Matrix3::from_diagonal(&Vector3::from(values));
            let matrix = rotation(0.7) * D * rotation(-0.4);
            let found = svd(&matrix);
            let again = found.U * Matrix3::from_diagonal(&found.D) * found.V.transpose();
            assert!((again - matrix).amax() < 1e-14, "{values:?}");
            for U in [found.U, found.V] {
                assert!((U.transpose() * U - Matrix3::identity()).amax() < 1e-14, "{values:?}");
            }
            for (value, expected) in found.D.iter().zip(values) {
                assert!((value - expected).abs() < 1e-15 * values[0].max(1.0) * 10.0, "{values:?}: {}", found.D);
            }
        }
    }
}
