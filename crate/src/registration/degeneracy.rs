//! Degeneracy: the directions of motion that the correspondences do not determine.
//!
//! The eigenvectors of the Gauss-Newton matrix with small eigenvalues are the motions that change no residual: a translation along
//! a bare corridor, or a rotation in a round room (Censi, "On achievable accuracy for range-finder localization", ICRA
//! 2007; Zhang, Kaess and Singh, "On degeneracy of optimization-based state estimation problems", ICRA 2016).

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::factors::Correspondence;
use super::target::SurfaceTarget;
use crate::geometry::jacobi::eigenpairs;
use crate::geometry::quantile::{MEDIAN_TO_SIGMA, THREE_SIGMA, quantile};
use crate::geometry::{RigidMotion, SquareMatrix, Vector};

/// How well the correspondences determine the weakest direction of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observability<M: RigidMotion> {
    /// The least determined direction, a unit tangent vector (rotation first) about the centre of the correspondences, in
    /// which a rotation is measured by the metres it moves a point at the correspondences' rms distance from their centre.
    pub weakest_direction: M::Tangent,
    /// Share of the correspondences that measure this direction, 0..=1: the smallest eigenvalue of the normalised
    /// matrix, the mean square cosine between the direction's motion and the residual's gradient.
    pub weakest_share: f64,
}

/// Below this share a direction counts as undetermined: noise in the normals of a bare wall alone (5 degrees) gives
/// sin(5 deg)^2 = 0.0076.
pub const UNDETERMINED_SHARE: f64 = 0.01;

impl<M: RigidMotion> Observability<M> {
    /// Whether the weakest direction is practically undetermined.
    pub fn is_undetermined(&self) -> bool {
        self.weakest_share < UNDETERMINED_SHARE
    }
}

/// Smallest cosine between a normal and a direction for which the surface constrains a motion along the direction.
const CONSTRAINING_COSINE: f64 = 0.3;
/// The direction of translation in space that the fewest visible surfaces constrain. Unlike [`Observability`] it counts the surfaces
/// that face along the direction: however many walls there are and however noisy their normals, they do not add up to a
/// constraint along themselves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DegenerateDirection {
    /// Unit vector in the target's frame.
    pub direction: Vector3<f64>,
    /// Share of all surfaces that constrain it, 0..=1.
    pub share: f64,
    /// Share of the information along it, 0..=1, that does not come from the noise of the normals: from pairs of which both
    /// surfaces face along it by more than three standard deviations of that noise.
    pub informative_share: f64,
}

impl DegenerateDirection {
    /// `None` where enough surfaces constrain every direction. Pairs further apart than `tolerance` (m) do not count.
    pub fn of(correspondences: &[Correspondence<Vector3<f64>>], tolerance: f64) -> Option<Self> {
        let weakest = Self::by_moved_surfaces(correspondences, tolerance);
        (!weakest.is_constrained()).then_some(weakest)
    }

    /// The direction that is constrained least by the surfaces that were moved, whatever their partners are.
    pub fn by_moved_surfaces(correspondences: &[Correspondence<Vector3<f64>>], tolerance: f64) -> Self {
        let fitting = correspondences.iter().filter(|pair| pair.residual.abs() < tolerance);
        let normals = fitting.filter_map(|pair| pair.normal.map(|normal| (normal, normal)));
        Self::least_constrained(&normals.collect::<Vec<_>>())
    }

    /// The direction that is constrained least. Surfaces that face along it constrain it if most of their partners in the target do
    /// as well, otherwise only those whose partners do: on a bare wall the noise of the normals makes pieces face anywhere, and
    /// they are picked evenly over the directions, but their partners have other errors. Pairs further apart than `tolerance` (m) do not count.
    pub fn weakest<T: SurfaceTarget<Point = Vector3<f64>>>(
        correspondences: &[Correspondence<Vector3<f64>>],
        target: &T,
        tolerance: f64,
    ) -> Self {
        let fitting = correspondences.iter().filter(|pair| pair.residual.abs() < tolerance);
        let normals = fitting.filter_map(|pair| Some((pair.normal?, target.normal(pair.target)?)));
        Self::least_constrained(&normals.collect::<Vec<_>>())
    }

    /// By the normals of both surfaces of each pair.
    fn least_constrained(normals: &[(Vector3<f64>, Vector3<f64>)]) -> Self {
        let spread: Matrix3<f64> = normals.iter().map(|(moved, _)| moved * moved.transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let cosines: Vec<(f64, f64)> =
            normals.iter().map(|(moved, partner)| (moved.dot(&direction), partner.dot(&direction))).collect();
        let share_of = |constrains: &dyn Fn(&&(f64, f64)) -> bool| {
            cosines.iter().filter(constrains).count() as f64 / cosines.len().max(1) as f64
        };
        let apparent_share = share_of(&|(moved, _)| moved.abs() > CONSTRAINING_COSINE);
        let confirmed_share = share_of(&|pair| both_face_along(pair, CONSTRAINING_COSINE));
        // Surfaces that face along it at a cosine just above the limit have partners just below it.
        let is_mostly_confirmed = 2.0 * confirmed_share > apparent_share;
        let share = if is_mostly_confirmed { apparent_share } else { confirmed_share };
        Self { direction, share, informative_share: informative_share(&cosines) }
    }

    /// Whether surfaces constrain it at all.
    pub fn is_constrained(&self) -> bool {
        self.share >= UNDETERMINED_SHARE
    }

    /// Standard deviation (m) along it by the information matrix of the registration, as if the residuals were independent and the
    /// normals exact. They are not, so it ranks frames by how well they are constrained and is not an estimate of their error.
    pub fn sigma(&self, information: &Matrix6<f64>) -> f64 {
        let information = information.fixed_view::<3, 3>(3, 3);
        // A single wall has no information along itself; rounding may make the eigenvalue negative.
        self.direction.dot(&(information * self.direction)).max(0.0).sqrt().recip()
    }
}

/// Whether both surfaces of a pair, by the cosines of their normals with a direction, face along it to the same side.
fn both_face_along((moved, partner): &(f64, f64), min_cosine: f64) -> bool {
    moved.abs().min(partner.abs()) > min_cosine && moved * partner > 0.0
}

/// See [`DegenerateDirection::informative_share`]; `cosines` of the normals of both surfaces of each pair with the direction.
fn informative_share(cosines: &[(f64, f64)]) -> f64 {
    let mut sizes: Vec<f64> = cosines.iter().map(|(moved, _)| moved.abs()).collect();
    let noise = MEDIAN_TO_SIGMA * quantile(&mut sizes, 0.5).unwrap_or(0.0);
    // The noise is the scatter of all cosines, since most surfaces do not face along that direction.
    let min_cosine = (THREE_SIGMA * noise).min(CONSTRAINING_COSINE);
    // Not by `sum`: that of no numbers is -0, and a division by it gives a negative infinity.
    let information = |counts: &dyn Fn(&&(f64, f64)) -> bool| {
        cosines.iter().filter(counts).fold(0.0, |sum, (moved, _)| sum + moved * moved)
    };
    let all = information(&|_| true);
    if all > 0.0 { information(&|pair| both_face_along(pair, min_cosine)) / all } else { 0.0 }
}

/// The share of the surfaces that constrain a rotation about `axis` (unit vector, target frame) through the points' centre: those
/// that face along the motion of their points, by the same cosine. Surfaces near the axis, which move less, have less
/// weight. Pairs further apart than `tolerance` (m) are left out.
pub fn rotation_constraining_share(
    axis: &Vector3<f64>,
    correspondences: &[Correspondence<Vector3<f64>>],
    tolerance: f64,
) -> f64 {
    let fitting = correspondences.iter().filter(|pair| pair.residual.abs() < tolerance);
    let surfaces: Vec<_> = fitting.filter_map(|pair| Some((pair.moved, pair.normal?))).collect();
    let count = surfaces.len().max(1) as f64;
    let center = surfaces.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / count;
    let motions: Vec<(Vector3<f64>, f64)> = surfaces
        .iter()
        .map(|(point, normal)| {
            let motion = axis.cross(&(point - center));
            (motion, normal.dot(&motion).abs())
        })
        .collect();
    let rms = (motions.iter().map(|(motion, _)| motion.norm_squared()).sum::<f64>() / count).sqrt();
    let is_constraining =
        |(motion, along): &&(Vector3<f64>, f64)| *along > CONSTRAINING_COSINE * motion.norm().max(rms);
    motions.iter().filter(is_constraining).count() as f64 / count
}

/// Whether enough surfaces constrain a rotation about `axis`; see [`rotation_constraining_share`].
pub fn is_rotation_constrained(
    axis: &Vector3<f64>,
    correspondences: &[Correspondence<Vector3<f64>>],
    tolerance: f64,
) -> bool {
    rotation_constraining_share(axis, correspondences, tolerance) >= UNDETERMINED_SHARE
}

/// Every direction of motion, by how well the correspondences measure it.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions<M: RigidMotion> {
    /// Weighted mean of the correspondences' points (m).
    pub center: M::Point,
    /// Their weighted rms distance from it (m): what a rotation is multiplied by to be measured in metres.
    pub radius: f64,
    /// Share of the correspondences that measure each direction, 0..=1, and the direction as in
    /// [`Observability::weakest_direction`]; the least determined first.
    pub pairs: Vec<(f64, M::Tangent)>,
    /// From tangent vectors about the centre with rotations in metres to perturbations on the left of the estimate.
    basis: M::Matrix,
    weights: f64,
}

impl<M: RigidMotion> Directions<M> {
    /// Analyses the Gauss-Newton matrix `H` (perturbation on the left, rotation first) of these correspondences; `None` where
    /// they have no weight or all lie in one point.
    pub fn of(H: &M::Matrix, correspondences: &[Correspondence<M::Point>]) -> Option<Self> {
        let weights: f64 = correspondences.iter().map(|c| c.weight).sum();
        if weights <= 0.0 {
            return None;
        }
        let center = correspondences.iter().map(|c| c.moved * c.weight).sum::<M::Point>() / weights;
        let sq_radius =
            correspondences.iter().map(|c| (c.moved - center).norm_squared() * c.weight).sum::<f64>() / weights;
        if sq_radius <= 0.0 {
            return None;
        }
        // To a perturbation about the centre, where rotation and translation do not mix, with the rotation in metres.
        let to_center = M::from_parts(&M::PointMatrix::identity(), &center).adjoint();
        let rotations = M::Tangent::LEN - M::Point::LEN;
        let mut scale = M::Matrix::identity();
        for axis in 0..rotations {
            scale[(axis, axis)] = 1.0 / sq_radius.sqrt();
        }
        let basis = to_center * scale;
        let normalised = basis.transpose() * *H * basis / weights;
        let pairs = eigenpairs(normalised);
        Some(Self { center, radius: sq_radius.sqrt(), pairs, basis, weights })
    }

    /// What correspondences with the Gauss-Newton matrix `H` contribute to the share of a direction.
    pub fn contribution(&self, H: &M::Matrix, direction: &M::Tangent) -> f64 {
        let perturbation = self.basis.apply(direction);
        perturbation.dot(&H.apply(&perturbation)) / self.weights
    }
}

/// Analyses the Gauss-Newton matrix `H` (perturbation on the left, rotation first) of these correspondences.
pub fn observability<M: RigidMotion>(H: &M::Matrix, correspondences: &[Correspondence<M::Point>]) -> Observability<M> {
    let unmeasured = Observability { weakest_direction: M::Tangent::zeros(), weakest_share: 0.0 };
    Directions::<M>::of(H, correspondences).map_or(unmeasured, |directions| {
        let (share, weakest_direction) = directions.pairs[0];
        Observability { weakest_direction, weakest_share: share.clamp(0.0, 1.0) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs on a wall round the z axis, 3 m away and up to 0.8 m high, whose normals have 5 degrees of noise; of `num_floor` more
    /// on the floor within a quarter turn.
    fn round_room(num_floor: usize) -> Vec<Correspondence<Vector3<f64>>> {
        let mut state = 3_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.5
        };
        let mut pair = |point: Vector3<f64>, normal: Vector3<f64>| {
            // Uniform noise of this width has a standard deviation of 5 degrees.
            let noise = Vector3::from_fn(|_, _| 12f64.sqrt() * 5f64.to_radians() * random());
            let normal = Some((normal + noise).normalize());
            Correspondence { source: 0, target: 0, moved: point, normal, residual: 0.0, weight: 1.0 }
        };
        let mut pairs = Vec::new();
        for index in 0..2000 {
            let (sin, cos) = (0.1 * f64::from(index)).sin_cos();
            let height = 0.8 * (f64::from(index % 100) / 50.0 - 1.0);
            pairs.push(pair(Vector3::new(3.0 * cos, 3.0 * sin, height), Vector3::new(-cos, -sin, 0.0)));
        }
        for index in 0..num_floor {
            let (sin, cos) = (1.57 * index as f64 / num_floor as f64).sin_cos();
            pairs.push(pair(Vector3::new(2.8 * cos, 2.8 * sin, -0.8), Vector3::z()));
        }
        pairs
    }

    #[test]
    fn surfaces_that_face_along_a_turn_constrain_it_and_noise_does_not() {
        let tolerance = 0.1;
        let walls = round_room(0);
        assert!(!is_rotation_constrained(&Vector3::z(), &walls, tolerance), "a round room seen from its middle");
        // The centre is that of all points: a floor on one side moves it, and the wall hardly faces along the turn about it.
        let with_floor = round_room(60);
        assert!(!is_rotation_constrained(&Vector3::z(), &with_floor, tolerance));
        assert!(is_rotation_constrained(&Vector3::x(), &with_floor, tolerance));
        assert!(is_rotation_constrained(&Vector3::y(), &with_floor, tolerance));
        let far: Vec<_> = with_floor.into_iter().map(|pair| Correspondence { residual: 1.0, ..pair }).collect();
        assert!(!is_rotation_constrained(&Vector3::x(), &far, tolerance), "pairs far apart count for nothing");
    }

    #[test]
    fn where_no_pair_is_informative_the_share_is_no_negative_zero() {
        let (wall, piece) = ((Vector3::z(), Vector3::z()), (Vector3::x(), -Vector3::x()));
        let normals = [wall, wall, wall, (Vector3::y(), Vector3::y()), (Vector3::y(), Vector3::y()), piece];
        let weakest = DegenerateDirection::least_constrained(&normals);
        assert_eq!(weakest.direction.x.abs(), 1.0);
        assert_eq!(weakest.informative_share.recip(), f64::INFINITY, "{weakest:?}");
    }

    #[test]
    fn noise_of_the_normals_constrains_no_direction_along_a_wall() {
        let mut state = 5_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.5
        };
        // Noise of 9 degrees; pieces that face along x are picked ten times as often, as even sampling over directions does.
        let mut facing = |normal: Vector3<f64>| {
            let noise =
                Vector3::from_fn(|_, _| 12f64.sqrt() * 9f64.to_radians() * (random() + random() - random()) / 1.7);
            (normal + noise).normalize()
        };
        let mut weakest = |num_across: usize| {
            let mut normals: Vec<_> = (0..40_000).map(|_| (facing(-Vector3::z()), facing(-Vector3::z()))).collect();
            let num_usual = normals.iter().filter(|(moved, _)| moved.x.abs() <= CONSTRAINING_COSINE).count() / 10;
            let mut num_left = num_usual;
            normals.retain(|(moved, _)| {
                let is_usual = moved.x.abs() <= CONSTRAINING_COSINE;
                num_left = num_left.saturating_sub(usize::from(is_usual));
                !is_usual || num_left > 0
            });
            normals.extend((0..600).map(|_| (facing(Vector3::y()), facing(Vector3::y()))));
            normals.extend((0..num_across).map(|_| (facing(Vector3::x()), facing(Vector3::x()))));
            let alone: Vec<_> = normals.iter().map(|(moved, _)| (*moved, *moved)).collect();
            [&normals, &alone].map(|normals| DegenerateDirection::least_constrained(normals))
        };
        let [bare, bare_alone] = weakest(0);
        assert!(bare.direction.x.abs() > 0.95, "{bare:?}");
        assert!(bare_alone.share > 0.1 && bare.share < UNDETERMINED_SHARE && !bare.is_constrained(), "{bare:?}");
        assert!(bare.informative_share < 0.05, "{bare:?}");
        let [with_another, _] = weakest(400);
        assert!(with_another.share > 0.05 && with_another.is_constrained(), "{with_another:?}");
        assert!(with_another.informative_share > 0.5, "{with_another:?}");
    }
}
