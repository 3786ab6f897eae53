//! Alignment of the estimate with the reference by a similarity: none, the first poses, or Umeyama's least-squares fit.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::path::Path;
use super::umeyama::{Fit, Similarity, best_fit};
use crate::{Error, Result};

/// How the estimate is aligned with the reference before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum Alignment {
    /// No alignment.
    #[default]
    None,
    /// By the motion that makes the first poses equal (evo's `--align_origin`).
    Origin,
    /// By the rotation and translation that fit the positions best (evo's `-a`).
    Se3,
    /// By the rotation, translation and scale that fit the positions best (evo's `-as`).
    Sim3,
    /// By the scale of that fit alone, about the origin (evo's `-s`).
    Scale,
}

/// The similarity that aligns `estimate` with `reference`, poses of equal index corresponding. The fits use the first
/// `align_first` poses, or all.
///
/// # Errors
/// When there are fewer than three positions; when the first poses are to be made equal and one has no orientation.
pub fn align(reference: &Path, estimate: &Path, alignment: Alignment, align_first: Option<usize>) -> Result<Fit> {
    let n = align_first.unwrap_or(usize::MAX).min(reference.len()).min(estimate.len());
    let fit = |with_scale| best_fit(&estimate.positions[..n], &reference.positions[..n], with_scale);
    match alignment {
        Alignment::None => Ok(exact(Similarity::identity())),
        Alignment::Origin => origin(reference, estimate).map(exact),
        Alignment::Se3 => fit(false),
        Alignment::Sim3 => fit(true),
        Alignment::Scale => {
            let of_scale = |similarity: Similarity| Similarity { scale: similarity.scale, ..Similarity::identity() };
            fit(true).map(|fit| Fit { similarity: of_scale(fit.similarity), is_about_a_line: false, ..fit })
        }
    }
}

fn exact(similarity: Similarity) -> Fit {
    Fit { similarity, is_about_a_line: false, is_in_place: false }
}

/// T_ref_0 * T_est_0^-1.
fn origin(reference: &Path, estimate: &Path) -> Result<Similarity> {
    let first = |path: &Path, whose: &str| -> Result<(Matrix3<f64>, Vector3<f64>)> {
        let rotation = path.rotations.as_ref().and_then(|rotations| rotations.first());
        rotation.copied().zip(path.positions.first().copied()).ok_or_else(|| {
            let problem = format!("The {whose} has positions alone, so first poses cannot be made equal");
            Error::whole(problem, "Align by SE(3), or give orientations")
        })
    };
    let (R_reference, t_reference) = first(reference, "reference")?;
    let (R_estimate, t_estimate) = first(estimate, "estimate")?;
    let rotation = R_reference * R_estimate.transpose();
    Ok(Similarity { rotation, translation: t_reference - rotation * t_estimate, scale: 1.0 })
}
