//! Photometric registration: a frame's points have the brightness of the pixels of earlier pictures that they project to.
//!
//! Steinbruecker, Sturm and Cremers, "Real-time visual odometry from dense RGB-D images", ICCV workshops 2011; Kerl,
//! Sturm and Cremers, "Robust odometry estimation for RGB-D cameras", ICRA 2013, with weights from a t-distribution
//! (eq. 19). The geometric registration enters as a Gaussian of the pose, so that both parts are weighted by their uncertainty.

mod textured_points;

use nalgebra::{Matrix6, Vector3, Vector6};

pub use self::textured_points::{Picture, TexturedPoint, textured_points};
use super::factors::{NormalEquations, RELATIVE_DAMPING};
use super::sandwich_variance::unit_variance;
use super::solver::Solver;
use crate::camera::brightness::NUM_LEVELS;
use crate::geometry::algebra::SquareMatrix;
use crate::geometry::quantile::{MEDIAN_TO_SIGMA, quantile};
use crate::geometry::{Pose3, RigidMotion};

/// An earlier picture, and the points that are visible in it.
#[derive(Debug, Clone)]
pub struct ReferenceKeyframe<'a> {
    /// The picture.
    pub picture: &'a Picture,
    /// Pose of its camera.
    pub T_world_camera: Pose3,
    /// Indices of the visible points.
    pub visible: Vec<u32>,
}

/// A pose with the information matrix of a perturbation on its left (rotation first).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaussian {
    /// The mean.
    pub T_world_camera: Pose3,
    /// Information matrix (1/rad^2, 1/m^2).
    pub information: Matrix6<f64>,
}

/// A pose from surfaces and brightness, with the evidence of the brightness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotometricResult {
    /// The maximum a posteriori pose.
    pub T_world_camera: Pose3,
    /// Information matrix of the brightness alone (1/rad^2, 1/m^2).
    pub information: Matrix6<f64>,
    /// Correlation of the points' brightness with that of the pictures, -1..=1.
    pub correlation: f64,
    /// Number of points that were compared, over all pictures.
    pub num_compared: usize,
    /// Whether the last step on the finest level was below 3e-4 (rad, m).
    pub converged: bool,
}

/// Most steps on each level.
const MAX_STEPS: usize = 4;
/// Step (rad and m) below which the finest level has converged; the limit doubles with each coarser level.
const SMALL_STEP: f64 = 3e-4;
/// Degrees of freedom of the t-distribution of the residuals (Kerl 2013).
const T_FREEDOM: f64 = 5.0;
/// Lower bound of the standard deviation of a picture's brightness (grey levels): it is rounded, and sensors have noise.
const MIN_SIGMA: f64 = 1.0;
/// Largest ratio of the exposures of two pictures.
const MAX_GAIN: f64 = 4.0;
/// Fewest points from which gain and offset of the brightness are estimated.
pub const MIN_POINTS: usize = 40;

/// One point in one picture.
struct Comparison {
    index: u32,
    here: f64,
    there: f64,
    /// Derivative of the brightness with respect to the point in the world frame (grey levels per metre).
    slope: Vector3<f64>,
    place: Vector3<f64>,
}

/// An affine change of illumination: the brightness of one picture is `gain` times that of another plus `offset`.
struct Light {
    gain: f64,
    offset: f64,
    correlation: f64,
}

fn compare(points: &[TexturedPoint], reference: &ReferenceKeyframe<'_>, T: &Pose3, level: usize) -> Vec<Comparison> {
    let T_reference_world = reference.T_world_camera.inverse();
    let (R, t) = (T_reference_world.rotation.to_rotation_matrix().into_inner(), T_reference_world.translation.vector);
    let (R_world, t_world) = (T.rotation.to_rotation_matrix().into_inner(), T.translation.vector);
    let compare = |&index: &u32| {
        let point = &points[index as usize];
        let place = R_world * point.point + t_world;
        let (there, slope) = reference.picture.look(level, &(R * place + t))?;
        Some(Comparison { index, here: point.values[level], there, slope: R.tr_mul(&slope), place })
    };
    let mut comparisons = Vec::with_capacity(reference.visible.len());
    comparisons.extend(reference.visible.iter().filter_map(compare));
    comparisons
}

impl Light {
    /// The gain and offset that make the weighted means and spreads of both sides equal, which is symmetric in the two.
    fn between(comparisons: &[Comparison], weights: &[f64]) -> Option<Self> {
        let sum: f64 = weights.iter().sum();
        let mean = |of: &dyn Fn(&Comparison) -> f64| {
            comparisons.iter().zip(weights).map(|(c, weight)| weight * of(c)).sum::<f64>() / sum
        };
        let (here, there) = (mean(&|c| c.here), mean(&|c| c.there));
        let spread_here = mean(&|c| (c.here - here).powi(2));
        let spread_there = mean(&|c| (c.there - there).powi(2));
        let common = mean(&|c| (c.here - here) * (c.there - there));
        let gain = (spread_there / spread_here).sqrt();
        let is_light = gain.is_finite() && (MAX_GAIN.recip()..=MAX_GAIN).contains(&gain);
        let correlation = common / (spread_here * spread_there).sqrt();
        is_light.then_some(Self { gain, offset: there - gain * here, correlation })
    }
}

/// Normal equations of the brightness, with each picture's residuals divided by their variance, and their sums over patches.
struct Sums {
    equations: NormalEquations<Pose3>,
    patches: Vec<Vector6<f64>>,
    correlation: f64,
    num_compared: usize,
}

fn sums(points: &[TexturedPoint], references: &[ReferenceKeyframe<'_>], T: &Pose3, level: usize) -> Sums {
    let num_patches = points.iter().map(|point| point.patch as usize + 1).max().unwrap_or(0);
    let mut sums = Sums {
        equations: NormalEquations::zeros(),
        patches: vec![Vector6::zeros(); num_patches],
        correlation: 0.0,
        num_compared: 0,
    };
    for reference in references {
        let comparisons = compare(points, reference, T, level);
        if comparisons.len() < MIN_POINTS {
            continue;
        }
        let Some((residuals, weights, correlation)) = weighted_residuals(&comparisons) else { continue };
        for ((comparison, residual), weight) in comparisons.iter().zip(residuals).zip(weights) {
            let gradient = gradient(comparison);
            sums.equations.H.add_square(&gradient, weight);
            let pull = gradient * (weight * residual);
            sums.equations.b += pull;
            sums.patches[points[comparison.index as usize].patch as usize] += pull;
        }
        sums.correlation += correlation * comparisons.len() as f64;
        sums.num_compared += comparisons.len();
    }
    sums.equations.H = sums.equations.H.symmetric();
    sums.correlation /= sums.num_compared.max(1) as f64;
    sums
}

/// Gradient of the brightness for a perturbation on the left of the pose (rotation first).
fn gradient(comparison: &Comparison) -> Vector6<f64> {
    let turn = comparison.place.cross(&comparison.slope); // slope . (omega x place) = omega . (place x slope)
    Vector6::new(turn.x, turn.y, turn.z, comparison.slope.x, comparison.slope.y, comparison.slope.z)
}

/// Residuals (grey levels) after correction of the illumination, their weights divided by their variance, and the correlation.
fn weighted_residuals(comparisons: &[Comparison]) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    let mut weights = vec![1.0; comparisons.len()];
    let mut residuals = Vec::new();
    let mut correlation = 0.0;
    // Illumination from all pairs, then from those that fit it.
    for round in 0..2 {
        let light = Light::between(comparisons, &weights)?;
        residuals = comparisons.iter().map(|c| c.there - light.gain * c.here - light.offset).collect();
        let sigma = sigma(&residuals);
        let weight = |residual: &f64| (T_FREEDOM + 1.0) / (T_FREEDOM + (residual / sigma).powi(2));
        weights = residuals.iter().map(weight).collect();
        if round == 0 {
            correlation = light.correlation;
        } else {
            for weight in &mut weights {
                *weight /= sigma * sigma;
            }
        }
    }
    Some((residuals, weights, correlation))
}

fn sigma(residuals: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(|residual| residual.abs()).collect();
    quantile(&mut sizes, 0.5).map_or(MIN_SIGMA, |median| (MEDIAN_TO_SIGMA * median).max(MIN_SIGMA))
}

/// Correlation of the points' brightness with that of the pictures at a pose, -1..=1, and the number of compared points.
pub fn correlation(
    points: &[TexturedPoint],
    references: &[ReferenceKeyframe<'_>],
    T: &Pose3,
    level: usize,
) -> (f64, usize) {
    let (mut sum, mut num_compared) = (0.0, 0);
    for reference in references {
        let comparisons = compare(points, reference, T, level);
        let weights = vec![1.0; comparisons.len()];
        if comparisons.len() < MIN_POINTS {
            continue;
        }
        if let Some(light) = Light::between(&comparisons, &weights) {
            sum += light.correlation * comparisons.len() as f64;
        }
        num_compared += comparisons.len();
    }
    (sum / num_compared.max(1) as f64, num_compared)
}

/// The maximum a posteriori pose from the geometric registration `surfaces` and the brightness, from the level `coarsest` to the
/// finest; `None` where too few of the points are visible in the pictures.
pub fn register_by_brightness(
    points: &[TexturedPoint],
    references: &[ReferenceKeyframe<'_>],
    surfaces: &Gaussian,
    coarsest: usize,
    solver: &Solver<Pose3>,
) -> Option<PhotometricResult> {
    let mut T = surfaces.T_world_camera;
    let mut result = None;
    for level in (0..=coarsest.min(NUM_LEVELS - 1)).rev() {
        for _ in 0..MAX_STEPS {
            let sums = sums(points, references, &T, level);
            if sums.num_compared < MIN_POINTS {
                return None;
            }
            // Variance of the residuals of whole patches beyond that of independent ones.
            let variance = unit_variance(&solver.restricted(sums.equations).H, &sums.patches).max(1.0);
            let information = sums.equations.H / variance;
            // Gradient of the Gaussian's exponent, to first order: T = exp(x) T_surfaces.
            let off = (T * surfaces.T_world_camera.inverse()).log();
            let equations = solver.restricted(NormalEquations {
                H: surfaces.information + information,
                b: surfaces.information * off + sums.equations.b / variance,
            });
            let damping = Matrix6::identity() * (RELATIVE_DAMPING * equations.H.trace());
            let step = -(equations.H + damping).cholesky()?.solve(&equations.b);
            T = (Pose3::exp(&step) * T).renormalized();
            let converged = step.norm() < SMALL_STEP * f64::from(1 << level);
            let Sums { correlation, num_compared, .. } = sums;
            result = Some(PhotometricResult { T_world_camera: T, information, correlation, num_compared, converged });
            if converged {
                break;
            }
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::camera::{Brightness, ColorImage, Pinhole, Surfel, SurfelImage};
    use crate::registration::solver::Motion;

    fn camera() -> Pinhole {
        Pinhole::new(320, 240, [225.0, 225.0, 159.5, 119.5]).unwrap()
    }

    /// A painted wall 2 m ahead of the origin as a camera sees it, its light times `gain`.
    fn wall(T_world_camera: &Pose3, gain: f64) -> SurfelImage {
        let camera = camera();
        let paint = |x: f64, y: f64| 120.0 + 50.0 * (9.0 * x + 2.0 * y).sin() + 40.0 * (7.0 * y - 3.0 * x * y).cos();
        let on_wall = |u: f64, v: f64| {
            let (eye, ray) = (T_world_camera.translation.vector, T_world_camera.rotate(&camera.ray(u, v)));
            let depth = (2.0 - eye.z) / ray.z;
            (eye + ray * depth, depth)
        };
        let pixel = |index: usize| {
            let (point, _) = on_wall((index % 320) as f64, (index / 320) as f64);
            [(gain * paint(point.x, point.y)).round() as u8; 3]
        };
        let colors = ColorImage { width: 320, height: 240, pixels: (0..320 * 240).map(pixel).collect() };
        let normal = T_world_camera.inverse().rotate(&-Vector3::z());
        let cell = |index: usize| {
            let (u, v) = ((index % 80) as f64 * 4.0 + 1.5, (index / 80) as f64 * 4.0 + 1.5);
            Some(Surfel { point: camera.unproject(u, v, on_wall(u, v).1), normal, sigma: 1e-3 })
        };
        let brightness = Some(Arc::new(Brightness::new(&colors)));
        SurfelImage {
            camera,
            cell_size: 4,
            columns: 80,
            rows: 60,
            cells: Arc::new((0..80 * 60).map(cell).collect()),
            brightness,
        }
    }

    fn picture(frame: &SurfelImage) -> Picture {
        Picture::new(frame.brightness.clone().unwrap(), &frame.camera)
    }

    fn reference<'a>(picture: &'a Picture, points: &[TexturedPoint]) -> ReferenceKeyframe<'a> {
        ReferenceKeyframe { picture, T_world_camera: Pose3::identity(), visible: (0..points.len() as u32).collect() }
    }

    #[test]
    fn the_gradient_is_the_numeric_one() {
        let T = Pose3::exp(&Vector6::new(0.02, -0.03, 0.01, 0.05, 0.02, -0.1));
        let (before, now) = (picture(&wall(&Pose3::identity(), 1.0)), wall(&T, 1.0));
        let points = textured_points(&now);
        assert!(points.len() > 100, "{}", points.len());
        let reference = reference(&before, &points);
        let h = 2e-3; // half a pixel of the finest level: slopes are taken over that
        let there = |T: &Pose3| compare(&points, &reference, T, 0);
        let here = there(&T);
        for axis in 0..6 {
            let step = Vector6::from_fn(|row, _| if row == axis { h } else { 0.0 });
            let (ahead, back) = (there(&(Pose3::exp(&step) * T)), there(&(Pose3::exp(&-step) * T)));
            let at = |list: &[Comparison], index: u32| list.iter().find(|c| c.index == index).map(|c| c.there);
            let (mut off, mut size) = (0.0, 0.0);
            for comparison in &here {
                let (Some(ahead), Some(back)) = (at(&ahead, comparison.index), at(&back, comparison.index)) else {
                    continue;
                };
                let numeric = (ahead - back) / (2.0 * h);
                off += (gradient(comparison)[axis] - numeric).powi(2);
                size += numeric * numeric;
            }
            assert!(size > 0.0 && off < 0.05f64.powi(2) * size, "axis {axis}: {} of {}", off.sqrt(), size.sqrt());
        }
    }

    #[test]
    fn texture_determines_the_position_along_a_wall_under_any_illumination() {
        let truth = Pose3::exp(&Vector6::new(0.01, -0.02, 0.005, 0.07, 0.04, -0.1));
        let before = picture(&wall(&Pose3::identity(), 1.0));
        for gain in [1.0, 0.6, 1.15] {
            let points = textured_points(&wall(&truth, gain));
            // The wall tells how far away it is and how it is turned, and nothing along it.
            let mut information = Matrix6::zeros();
            for known in [0, 1, 5] {
                information[(known, known)] = 1e6;
            }
            let slid = Pose3::translation(0.03, -0.02, 0.0) * truth;
            let surfaces = Gaussian { T_world_camera: slid, information };
            let references = [reference(&before, &points)];
            let found = register_by_brightness(&points, &references, &surfaces, 2, &Motion::Free.solver()).unwrap();
            let off = (found.T_world_camera * truth.inverse()).log();
            assert!(off.norm() < 2e-3, "gain {gain}: {off}");
            assert!(found.correlation > 0.98 && found.converged, "gain {gain}: {found:?}");
            let (there, compared) = correlation(&points, &references, &truth, 2);
            let (elsewhere, _) = correlation(&points, &references, &(Pose3::translation(0.2, 0.1, 0.0) * truth), 2);
            assert!(there > 0.98 && elsewhere < 0.8 && compared > 100, "{there} {elsewhere} {compared}");
        }
    }

    #[test]
    fn there_is_no_result_without_texture_or_overlap() {
        let mut bare = wall(&Pose3::identity(), 1.0);
        let colors = ColorImage { width: 320, height: 240, pixels: vec![[90; 3]; 320 * 240] };
        bare.brightness = Some(Arc::new(Brightness::new(&colors)));
        assert_eq!(textured_points(&bare), []);
        bare.brightness = None;
        assert_eq!(textured_points(&bare), []);

        let painted = wall(&Pose3::identity(), 1.0);
        let (points, picture) = (textured_points(&painted), picture(&painted));
        let surfaces = Gaussian { T_world_camera: Pose3::identity(), information: Matrix6::identity() };
        let unseen = ReferenceKeyframe { visible: Vec::new(), ..reference(&picture, &points) };
        let solver = Motion::Free.solver();
        assert_eq!(register_by_brightness(&points, &[unseen], &surfaces, 1, &solver), None);
        assert_eq!(register_by_brightness(&points, &[], &surfaces, 1, &solver), None);
    }
}
