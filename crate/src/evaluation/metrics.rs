//! Absolute and relative pose errors, as evo defines them.
//!
//! - APE, E_i = T_est_i^-1 T_ref_i: Kuemmerle et al., "On measuring the accuracy of SLAM algorithms", Autonomous Robots
//!   27 (2009); Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, where its translation is
//!   the absolute trajectory error.
//! - RPE, E_ij = (T_ref_i^-1 T_ref_j)^-1 (T_est_i^-1 T_est_j): Sturm et al. 2012, eq. 2.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::pairs::{PairOptions, index_pairs};
use super::path::{Path, angle, relative};
use crate::{Error, Result};

/// The part of an error pose E = (R, t) that is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum PoseRelation {
    /// |t| (m); for APE the distance of the positions.
    #[default]
    TranslationPart,
    /// |R - I|, Frobenius norm.
    RotationPart,
    /// |E - I|, Frobenius norm of the 4 x 4 matrix.
    FullTransformation,
    /// Angle of R (rad).
    RotationAngleRad,
    /// Angle of R (deg).
    RotationAngleDeg,
    /// APE: distance of the positions. RPE: difference of the distances between the two positions of a pair (m).
    PointDistance,
    /// RPE only: that difference as a share of the reference's distance (percent).
    PointDistanceErrorRatio,
}

impl PoseRelation {
    /// The unit of the errors, empty where they have none.
    pub fn unit(self) -> &'static str {
        match self {
            Self::TranslationPart | Self::PointDistance => "m",
            Self::RotationAngleRad => "rad",
            Self::RotationAngleDeg => "deg",
            Self::PointDistanceErrorRatio => "%",
            Self::RotationPart | Self::FullTransformation => "",
        }
    }
}

/// Absolute errors of the poses of equal index.
///
/// # Errors
/// When the relation needs orientations and there are none, or a matrix is no rotation.
pub fn ape(reference: &Path, estimate: &Path, relation: PoseRelation) -> Result<Vec<f64>> {
    use PoseRelation as Relation;
    match relation {
        Relation::TranslationPart | Relation::PointDistance => {
            Ok(estimate.positions.iter().zip(&reference.positions).map(|(e, r)| (e - r).norm()).collect())
        }
        Relation::PointDistanceErrorRatio => Err(Error::whole(
            "The ratio of point distances is a relative error, and this metric is an absolute one",
            "Use rpe",
        )),
        _ => {
            let (of_reference, of_estimate) = (rotations(reference, "reference")?, rotations(estimate, "estimate")?);
            let poses = (0..reference.len().min(estimate.len())).map(|i| {
                let reference = (&of_reference[i], &reference.positions[i]);
                relative((&of_estimate[i], &estimate.positions[i]), reference)
            });
            poses.map(|(R, t)| measure(&R, &t, relation)).collect()
        }
    }
}

/// Relative pose errors and the pairs of poses they refer to.
#[derive(Debug, Clone, PartialEq)]
pub struct RelativeErrors {
    /// Indices of the first and second pose of each pair.
    pub pairs: Vec<(usize, usize)>,
    /// The error of each pair.
    pub errors: Vec<f64>,
    /// Number of pairs left out because the reference does not move in them, so that no ratio is defined.
    pub num_without_motion: usize,
}

/// Relative errors of pairs of poses, poses of equal index corresponding.
///
/// # Errors
/// When no pair is `delta` apart, when the relation or the pairs need orientations or times and there are none.
pub fn rpe(reference: &Path, estimate: &Path, relation: PoseRelation, options: &PairOptions) -> Result<RelativeErrors> {
    let mut pairs = index_pairs(if options.pairs_from_reference { reference } else { estimate }, options)?;
    let num_pairs = pairs.len();
    let errors = match relation {
        PoseRelation::PointDistance | PoseRelation::PointDistanceErrorRatio => {
            let distance = |path: &Path, &(i, j): &(usize, usize)| (path.positions[i] - path.positions[j]).norm();
            let is_ratio = relation == PoseRelation::PointDistanceErrorRatio;
            pairs.retain(|pair| !is_ratio || distance(reference, pair) != 0.0);
            let error = |pair| {
                let (of_reference, of_estimate) = (distance(reference, pair), distance(estimate, pair));
                let difference = (of_reference - of_estimate).abs();
                if is_ratio { difference / of_reference * 100.0 } else { difference }
            };
            pairs.iter().map(error).collect()
        }
        _ => {
            let (of_reference, of_estimate) = (rotations(reference, "reference")?, rotations(estimate, "estimate")?);
            let motion = |rotations: &[Matrix3<f64>], path: &Path, i: usize, j: usize| {
                relative((&rotations[i], &path.positions[i]), (&rotations[j], &path.positions[j]))
            };
            let errors = pairs.iter().map(|&(i, j)| {
                let (R_reference, t_reference) = motion(of_reference, reference, i, j);
                let (R_estimate, t_estimate) = motion(of_estimate, estimate, i, j);
                let (R, t) = relative((&R_reference, &t_reference), (&R_estimate, &t_estimate));
                measure(&R, &t, relation)
            });
            errors.collect::<Result<Vec<f64>>>()?
        }
    };
    if pairs.is_empty() {
        return Err(Error::whole("The reference moves in none of the pairs", "Use another relation or a larger delta"));
    }
    Ok(RelativeErrors { num_without_motion: num_pairs - pairs.len(), pairs, errors })
}

fn rotations<'a>(path: &'a Path, whose: &str) -> Result<&'a [Matrix3<f64>]> {
    path.rotations.as_deref().ok_or_else(|| {
        let problem = format!("The {whose} has positions alone, and this relation compares orientations");
        Error::whole(problem, "Use the relation point_distance, or the absolute error of the translation part")
    })
}

fn measure(R: &Matrix3<f64>, t: &Vector3<f64>, relation: PoseRelation) -> Result<f64> {
    let off_identity = || (R - Matrix3::identity()).norm_squared();
    Ok(match relation {
        PoseRelation::RotationPart => off_identity().sqrt(),
        PoseRelation::FullTransformation => (off_identity() + t.norm_squared()).sqrt(),
        PoseRelation::RotationAngleRad => angle(R)?,
        PoseRelation::RotationAngleDeg => angle(R)?.to_degrees(),
        _ => t.norm(),
    })
}
