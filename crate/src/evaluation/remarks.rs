//! What is to be known of an evaluation beside its figures, in whole sentences.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::alignment::Alignment;
use super::associate::Pair;
use super::interpolate::interval;
use super::path::Path;
use super::umeyama::Fit;
use crate::io::length_unit::{CENTIMETRE, FOOT, INCH, MILLIMETRE};
use crate::io::trajectory::Trajectory;

/// An option that would change what a note reports; each surface has its own words for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum Advice {
    /// `interpolate`: the times of corresponding poses differ.
    Interpolate,
    /// `conventions: as_read`: other conventions were found than those read.
    ConventionsAsRead,
    /// `alignment: sim3`: the positions seem to be in another unit.
    FitScale,
}

const ABOUT_A_LINE: &str = "The positions lie on a straight line, so the alignment may be turned about it at will: \
    distances between positions are right, but orientations cannot be compared.";

/// Share of an interval by which times of corresponding poses may differ without a remark: a position between two poses is then
/// off by at most this share of the motion between them.
const MAX_TIME_SHARE: f64 = 0.01;

/// Units of length differ by a factor of 2.5 at least, and drift changes no path by so much of it as this logarithm.
const UNIT_DEVIATION: f64 = 0.1;

/// That the estimate seems to be in another unit than the reference, by the ratio of its motions to those of the reference.
pub(super) fn other_unit(ratio: f64) -> Option<String> {
    let units = [MILLIMETRE, CENTIMETRE, INCH, FOOT];
    let is = |expected: f64| (ratio / expected).ln().abs() < UNIT_DEVIATION;
    let of_estimate = units.iter().find(|unit| is(1.0 / unit.metres)).map(|unit| ("estimate", unit));
    let (whose, unit) =
        of_estimate.or_else(|| units.iter().find(|unit| is(unit.metres)).map(|unit| ("reference", unit)))?;
    Some(format!(
        "The estimate moves {ratio:.4} times as far as the reference between poses, as where the {whose} is in {}: its errors are not in \
         metres then.",
        unit.name
    ))
}

/// That several poses on the way of this trajectory are the identity to the last digit, as programs write where they are lost. A
/// way that begins there comes back to it so exactly only where whoever recorded it stood still: that is one stretch, at its begin.
pub(super) fn identities(whose: &str, trajectory: &Trajectory) -> Option<String> {
    let rotations = trajectory.orientations.as_ref()?;
    let is_identity =
        |index: &usize| trajectory.positions[*index] == Vector3::zeros() && rotations[*index].angle() == 0.0;
    let begin = (0..trajectory.len()).find(|index| !is_identity(index))?;
    let lost: Vec<usize> = (begin..trajectory.len()).filter(is_identity).collect();
    (lost.len() > 1).then(|| {
        format!(
            "{} poses of the {whose}, pose {} first (counted from 0), are the identity, as programs write where they are lost. They \
             count in these figures; remove their lines to leave them out.",
            lost.len(),
            lost[0]
        )
    })
}

/// What the positions do not determine of a fit with these distances (m, root mean square) after it.
pub(super) fn freedom(fit: &Fit, reference: &Path, alignment: Alignment, rmse: f64) -> Option<String> {
    let (with_rotation, with_scale) = match alignment {
        Alignment::Se3 => (true, false),
        Alignment::Sim3 => (true, true),
        Alignment::Scale => (false, true),
        Alignment::None | Alignment::Origin => return None,
    };
    let open = match (with_rotation, with_scale) {
        (true, true) => "rotation and scale are",
        (true, false) => "rotation is",
        (false, _) => "scale is",
    };
    if fit.is_in_place {
        let done = if with_rotation { "the estimate was only shifted" } else { "the scale was left at 1" };
        return Some(format!("One of the two stays in one place, so the alignment's {open} not determined: {done}."));
    }
    if fit.is_about_a_line {
        return Some(ABOUT_A_LINE.to_owned());
    }
    let [along, across] = spreads(&reference.positions);
    if along < rmse {
        return Some(format!(
            "The positions of the reference spread by {along:.3} m, less than the error after the alignment, {rmse:.3} m: the \
             alignment's {open} not determined."
        ));
    }
    (with_rotation && across < rmse).then(|| {
        format!(
            "The reference leaves a straight line by {across:.3} m, less than the error after the alignment, {rmse:.3} m: the \
             rotation about the line is not determined, so orientations cannot be compared."
        )
    })
}

/// The two largest standard deviations of positions (m), along perpendicular directions.
fn spreads(positions: &[Vector3<f64>]) -> [f64; 2] {
    let n = positions.len().max(1) as f64;
    let mean = positions.iter().sum::<Vector3<f64>>() / n;
    let covariance: Matrix3<f64> =
        positions.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>() / n;
    let mut variances: [f64; 3] = covariance.symmetric_eigenvalues().into();
    variances.sort_by(|a, b| b.total_cmp(a));
    [variances[0].max(0.0).sqrt(), variances[1].max(0.0).sqrt()]
}

/// How far apart the times of corresponding poses are; `None` where they are the same. `stamps`: of all poses of the reference and
/// of the estimate.
pub(super) fn time_differences(pairs: &[Pair], stamps: [&[f64]; 2], offset: f64) -> Option<String> {
    let [of_reference, of_estimate] = stamps;
    let mean = pairs
        .iter()
        .map(|pair| (of_reference[pair.reference] - of_estimate[pair.estimate] - offset).abs())
        .sum::<f64>()
        / pairs.len() as f64;
    let intervals = [interval(of_reference)?, interval(of_estimate)?];
    (mean > MAX_TIME_SHARE * f64::min(intervals[0], intervals[1])).then(|| {
        format!(
            "The reference has a pose every {:.3} s and the estimate every {:.3} s; the times of corresponding poses differ by \
             {:.4} s in the mean.",
            intervals[0], intervals[1], mean
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::umeyama::best_fit;

    fn told(estimate: &[Vector3<f64>], reference: &[Vector3<f64>], alignment: Alignment) -> Option<String> {
        let fit = best_fit(estimate, reference, alignment == Alignment::Sim3).unwrap();
        let moved =
            |p: &Vector3<f64>| fit.similarity.scale * (fit.similarity.rotation * p) + fit.similarity.translation;
        let squares = estimate.iter().zip(reference).map(|(p, q)| (moved(p) - q).norm_squared()).sum::<f64>();
        let path = Path { positions: reference.to_vec(), rotations: None, stamps: None };
        freedom(&fit, &path, alignment, (squares / reference.len() as f64).sqrt())
    }

    #[test]
    fn what_the_positions_leave_open_is_told_with_its_figures() {
        let noise = |i: u32, k: f64| 0.02 * (((12.9898 * f64::from(i) + 78.233 * k).sin() * 43758.5453).fract() - 0.5);
        let noisy = |along: f64, across: f64, seed: f64| -> Vec<Vector3<f64>> {
            let at = |i: u32| Vector3::new(along * f64::from(i), across * (0.3 * f64::from(i)).sin(), 0.0);
            (0..100).map(|i| at(i) + Vector3::new(noise(i, seed), noise(i, seed + 1.0), noise(i, seed + 2.0))).collect()
        };
        let contains = |told: Option<String>, words: &str| told.is_some_and(|told| told.contains(words));
        assert_eq!(told(&noisy(0.1, 1.0, 0.0), &noisy(0.1, 1.0, 5.0), Alignment::Sim3), None);
        assert!(contains(
            told(&noisy(0.1, 0.0, 0.0), &noisy(0.1, 0.0, 4.0), Alignment::Se3),
            "rotation about the line"
        ));
        assert!(contains(
            told(&noisy(0.0, 0.0, 0.0), &noisy(0.0, 0.0, 4.0), Alignment::Se3),
            "rotation is not determined"
        ));
        let still = vec![Vector3::new(1.0, 2.0, 3.0); 100];
        assert!(contains(
            told(&noisy(0.0, 0.0, 0.0), &still, Alignment::Sim3),
            "rotation and scale are not determined"
        ));
        assert_eq!(told(&still, &still, Alignment::Origin), None);
    }

    #[test]
    fn another_unit_is_told_and_drift_is_not() {
        let contains = |ratio: f64, words: &str| other_unit(ratio).is_some_and(|told| told.contains(words));
        assert!(
            contains(997.0, "the estimate is in millimetres") && contains(0.00103, "the reference is in millimetres")
        );
        assert!(contains(3.3, "the estimate is in feet") && contains(0.0101, "the reference is in centimetres"));
        for ratio in [0.9, 1.0, 1.2, 20.9] {
            assert_eq!(other_unit(ratio), None);
        }
    }

    #[test]
    fn times_that_differ_are_told_with_both_intervals() {
        let stamps =
            |interval: f64, shift: f64| -> Vec<f64> { (0..20).map(|i| shift + interval * f64::from(i)).collect() };
        let pairs: Vec<Pair> = (0..20).map(|index| Pair { reference: index, estimate: index }).collect();
        assert_eq!(time_differences(&pairs, [&stamps(0.1, 0.0), &stamps(0.1, 0.0)], 0.0), None);
        let told = time_differences(&pairs, [&stamps(0.1, 0.0), &stamps(0.1, 0.004)], 0.0).unwrap();
        assert!(told.contains("every 0.100 s and the estimate every 0.100 s") && told.contains("0.0040 s"), "{told}");
        assert_eq!(time_differences(&pairs, [&stamps(0.1, 0.0), &stamps(0.1, 0.004)], -0.004), None);
    }
}
