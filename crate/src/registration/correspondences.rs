//! Correspondences under an estimate: the nearest target point to each source point, unless the pair is rejected.

use super::factors::{Correspondence, Factor};
use super::robust_kernel::RobustKernel;
use super::target::{LastSearch, Target};
use crate::geometry::{RigidMotion, SquareMatrix, Vector};

/// The source of a registration: points and, where known, unit normals, in the source frame.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a, P> {
    /// Points (m).
    pub points: &'a [P],
    /// One entry per point, for the rejection by normals; `None` where no point has a normal.
    pub normals: Option<&'a [Option<P>]>,
    /// Standard deviation of each point along its normal (m), where known: uncertain pairs count less.
    pub sigmas: Option<&'a [f64]>,
}

/// Which pairs of points are rejected as correspondences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rejection {
    /// Largest distance of a pair (m).
    pub max_correspondence_distance: f64,
    /// Largest angle between the normals of a pair, where both are known (rad); pi disables this test.
    pub max_normal_angle: f64,
    /// Share of the correspondences, those with the largest residuals, that is dropped, in [0, 1).
    pub trim_fraction: f64,
}

/// How correspondences are weighted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighting {
    /// Shape of the loss.
    pub robust_kernel: RobustKernel,
    /// Width of the kernel (m).
    pub robust_kernel_width: f64,
}

impl Default for Rejection {
    /// 0.5 m, 45 degrees, nothing is dropped.
    fn default() -> Self {
        Self { max_correspondence_distance: 0.5, max_normal_angle: 45f64.to_radians(), trim_fraction: 0.0 }
    }
}

impl Default for Weighting {
    /// Cauchy's kernel, 5 cm wide.
    fn default() -> Self {
        Self { robust_kernel: RobustKernel::Cauchy, robust_kernel_width: 0.05 }
    }
}

impl Weighting {
    /// The weight of a residual (m), 0..=1.
    pub fn weight(&self, residual: f64) -> f64 {
        self.robust_kernel.weight(residual, self.robust_kernel_width)
    }
}

/// Standard deviation of a pair at which its weight is one half (m): the size of the errors that are not the noise of the two
/// points.
const HALF_WEIGHT_SIGMA: f64 = 3e-3;

/// Why a source point is not used in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum RejectionReason {
    /// No target point lies within the distance limit.
    TooFar = 0,
    /// The normals differ by more than the limit.
    Normals = 1,
    /// The residual is among the trimmed share of the largest.
    Trimmed = 2,
    /// The residual is undefined: the target point has no normal.
    NoResidual = 3,
}

/// A source point that is not used in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rejected {
    /// Index of the source point.
    pub source: u32,
    /// Index of the target point nearest to it, where one was within the limit.
    pub target: Option<u32>,
    /// The reason.
    pub reason: RejectionReason,
}

/// A search for correspondences: its source, target, factor and options.
pub(crate) struct CorrespondenceSearch<'a, P, T, F> {
    pub source: Source<'a, P>,
    pub target: &'a T,
    pub factor: &'a F,
    pub rejection: Rejection,
    pub weighting: Weighting,
}

impl<P: Vector, T: Target<Point = P>, F> CorrespondenceSearch<'_, P, T, F> {
    /// Finds, rejects, trims and weights the correspondences under an estimate. Returns how many pairs lie within the distance limit.
    ///
    /// The last search of each source point makes this one faster and does not change the result. `reject` is called with every
    /// source point that is left out.
    pub(crate) fn find<M>(
        &self,
        T_target_source: &M,
        last_searches: &mut [LastSearch<P>],
        correspondences: &mut Vec<Correspondence<P>>,
        mut reject: impl FnMut(Rejected),
    ) -> usize
    where
        M: RigidMotion<Point = P>,
        F: Factor<M, T>,
    {
        let limits = self.rejection;
        let min_normal_cosine = limits.max_normal_angle.cos();
        let mut num_correspondences = 0;
        correspondences.clear();
        let (R, t) = (T_target_source.rotation_matrix(), T_target_source.translation());
        let moved: Vec<P> = self.source.points.iter().map(|point| R.apply(point) + t).collect();
        self.target.nearest_of_all(&moved, limits.max_correspondence_distance, last_searches, |index, nearest| {
            let source = index as u32;
            let Some(nearest) = nearest else {
                reject(Rejected { source, target: None, reason: RejectionReason::TooFar });
                return;
            };
            num_correspondences += 1;
            match self.correspondence::<M>(&R, source, moved[index], nearest.index, min_normal_cosine) {
                Ok(correspondence) => correspondences.push(correspondence),
                Err(reason) => reject(Rejected { source, target: Some(nearest.index), reason }),
            }
        });
        trim(correspondences, limits.trim_fraction, |c| {
            reject(Rejected { source: c.source, target: Some(c.target), reason: RejectionReason::Trimmed });
        });
        num_correspondences
    }

    /// The weighted correspondence of a source point with its nearest target point, or why the pair is rejected.
    fn correspondence<M>(
        &self,
        R: &M::PointMatrix,
        source: u32,
        moved: P,
        target: u32,
        min_normal_cosine: f64,
    ) -> Result<Correspondence<P>, RejectionReason>
    where
        M: RigidMotion<Point = P>,
        F: Factor<M, T>,
    {
        let normal = self.source.normals.and_then(|normals| normals[source as usize].as_ref());
        let normal = normal.map(|normal| R.apply(normal));
        if face_apart(normal.as_ref(), self.target.normal(target), min_normal_cosine) {
            return Err(RejectionReason::Normals);
        }
        let residual = self.factor.residual(self.target, target, &moved, normal.as_ref());
        let residual = residual.ok_or(RejectionReason::NoResidual)?;
        let sigmas = self.source.sigmas;
        let precision = sigmas.map_or(1.0, |sigmas| precision(sigmas[source as usize], self.target.sigma(target)));
        let weight = self.weighting.weight(residual) * precision;
        Ok(Correspondence { source, target, moved, normal, residual, weight })
    }
}

/// Whether the normals of a pair, where both are known, have a smaller cosine than this.
#[inline]
pub(super) fn face_apart<P: Vector>(normal: Option<&P>, target_normal: Option<P>, min_cosine: f64) -> bool {
    matches!((normal, target_normal), (Some(normal), Some(other)) if normal.dot(&other) < min_cosine)
}

/// The weight of a pair by the standard deviations of its two points (m), 1 where both are zero.
fn precision(source_sigma: f64, target_sigma: f64) -> f64 {
    let variance = source_sigma * source_sigma + target_sigma * target_sigma;
    1.0 / (1.0 + variance / (HALF_WEIGHT_SIGMA * HALF_WEIGHT_SIGMA))
}

/// Drops the share with the largest residuals (Chetverikov et al., "The trimmed iterative closest point algorithm",
/// ICPR 2002). The order of the others stays.
fn trim<P>(
    correspondences: &mut Vec<Correspondence<P>>,
    trim_fraction: f64,
    mut drop_out: impl FnMut(&Correspondence<P>),
) {
    let keep = ((1.0 - trim_fraction) * correspondences.len() as f64).ceil() as usize;
    if keep == 0 || keep >= correspondences.len() {
        return;
    }
    let mut sizes: Vec<f64> = correspondences.iter().map(|c| c.residual.abs()).collect();
    let (_, &mut limit, _) = sizes.select_nth_unstable_by(keep - 1, f64::total_cmp);
    correspondences.retain(|c| {
        let stays = c.residual.abs() <= limit;
        if !stays {
            drop_out(c);
        }
        stays
    });
}
