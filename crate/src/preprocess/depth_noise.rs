//! The noise of a depth camera, estimated from one image.
//!
//! A camera that triangulates measures 1/z with about the same error at every depth, so the standard deviation of z grows with
//! its square. A plane is linear in 1/z: in windows of the image the residuals of 1/z from a fitted plane are noise or
//! structure. Windows are grouped by depth, since stereo matching is worse than this model for distant surfaces with little
//! texture.

use crate::camera::{DepthImage, Pinhole};
use crate::preprocess::depth_surfels::DepthModel;

/// Side of a window (pixels), larger than the patches over which errors of stereo matching are correlated.
const WINDOW: usize = 20;
/// Upper bounds of the depth classes of windows (m); the last class has all others.
const DEPTH_CLASSES: [f64; 3] = [1.5, 3.0, 6.0];
/// Fewest windows of a class that is used.
const MIN_WINDOWS: usize = 40;
/// Quantile of a class's residuals that estimates its noise; it is low, since most windows may contain structure. Measured: 1.3e-3
/// /m for three Kinects (1.8e-3 for a fourth), 3.4e-3 to 4.5e-3 for a RealSense D435, and below 1e-4 for rendered rooms,
/// whose quantile of 0.3 is up to 1.2e-3.
const NOISE_QUANTILE: f64 = 0.1;

/// Standard deviation of the depth divided by its square (1/m), without the quantisation of the raw values: the largest of all
/// depth classes. 0 where no window is complete.
#[inline(never)]
pub fn estimate_depth_noise(image: &DepthImage, usable: &[bool], camera: &Pinhole, model: &DepthModel) -> f64 {
    let mut classes: [Vec<f64>; DEPTH_CLASSES.len() + 1] = Default::default();
    for top in (0..(image.height + 1).saturating_sub(WINDOW)).step_by(WINDOW / 2) {
        for left in (0..(image.width + 1).saturating_sub(WINDOW)).step_by(WINDOW / 2) {
            if let Some((depth, variance)) = window_noise(image, usable, camera, model, (left, top)) {
                classes[DEPTH_CLASSES.partition_point(|limit| *limit < depth)].push(variance);
            }
        }
    }
    let of_class = |variances: &mut Vec<f64>| {
        let place = (variances.len() as f64 * NOISE_QUANTILE) as usize;
        (variances.len() >= MIN_WINDOWS)
            .then(|| variances.select_nth_unstable_by(place, f64::total_cmp).1.max(0.0).sqrt())
    };
    classes.iter_mut().filter_map(of_class).fold(0.0, f64::max)
}

/// The mean depth (m) of a window, and the variance of 1/z (1/m^2) that neither a plane nor the raw values' steps explain;
/// `None` unless every pixel has depth.
fn window_noise(
    image: &DepthImage,
    usable: &[bool],
    camera: &Pinhole,
    model: &DepthModel,
    (left, top): (usize, usize),
) -> Option<(f64, f64)> {
    let (mut depth_sum, mut squares) = (0.0, 0.0);
    let (mut normal_matrix, mut right_side) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for v in top..top + WINDOW {
        for u in left..left + WINDOW {
            let index = v * image.width + u;
            let depth = model.depth(image.values[index]).filter(|_| usable[index])?;
            let (ray, inverse) = (camera.ray(u as f64, v as f64), 1.0 / depth);
            depth_sum += depth;
            normal_matrix += ray * ray.transpose();
            right_side += ray * inverse;
            squares += inverse * inverse;
        }
    }
    let plane = normal_matrix.cholesky()?.solve(&right_side);
    let count = (WINDOW * WINDOW) as f64;
    let mean_square = (squares - plane.dot(&right_side)) / (count - 3.0);
    let depth = depth_sum / count;
    let steps = model.step * model.step / 12.0 / depth.powi(4);
    Some((depth, mean_square - steps))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slanted wall, 1.5 to 4 m away, with `noise` (1/m) in 1/z.
    fn wall(noise: f64) -> f64 {
        let camera = Pinhole::new(640, 480, [500.0, 500.0, 319.5, 239.5]).unwrap();
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24) - 0.5
        };
        let value = |index: usize| {
            let ray = camera.ray((index % 640) as f64, (index / 640) as f64);
            let inverse = 0.4 + 0.25 * ray.x + noise * 12f64.sqrt() * uniform();
            (1000.0 / inverse).round() as u16
        };
        let values = (0..640 * 480).map(value).collect();
        let image = DepthImage { width: 640, height: 480, bits: 16, values };
        let model = DepthModel { step: 1e-3, offset: 0.0, square_noise: 0.0, min_range: 0.1, max_range: 10.0 };
        let usable: Vec<bool> = image.values.iter().map(|value| *value > 0).collect();
        estimate_depth_noise(&image, &usable, &camera, &model)
    }

    #[test]
    fn noise_of_the_inverse_depth_is_estimated_without_the_quantisation() {
        for noise in [1.5e-3, 5e-3] {
            assert!((wall(noise) / noise - 1.0).abs() < 0.2, "{} for {noise}", wall(noise));
        }
        assert!(wall(0.0) < 2e-4, "{}", wall(0.0));
    }
}
