//! The errors of a stereo depth camera: correlated errors of neighbouring pixels, ragged outlines, surfaces visible to only one
//! lens, flying pixels, and quantised disparity.

use nalgebra::Vector3;

use super::super::random::Random;
use super::Space;
use super::noise::{hashed, smooth};
use scanstitch::camera::{DepthImage, Pinhole};
use scanstitch::geometry::{Pose3, RigidMotion};

/// A stereo camera. Disparities are in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StereoCamera {
    /// From one eye to the other (m).
    pub baseline: f64,
    /// Disparities are multiples of this.
    pub step: f64,
    /// Standard deviation of the disparity, the same over patches of matching, ...
    pub patch_noise: f64,
    /// ... and of each pixel.
    pub pixel_noise: f64,
    /// The part of the error that is the same in every image, which calibration leaves.
    pub bias: f64,
    /// Outlines reach so far over what lies behind them (pixels).
    pub fattening: f64,
    /// Share of the image that is missing for want of texture.
    pub holes: f64,
    /// Share of the image that is matched wrongly.
    pub mismatches: f64,
    /// Motion of the image during an exposure, as a share of that from frame to frame.
    pub exposure: f64,
    /// Depth beyond is none (m).
    pub max_range: f64,
}

impl Default for StereoCamera {
    /// A RealSense D435: 5 cm, 1/32 pixel.
    fn default() -> Self {
        Self {
            baseline: 0.05,
            step: 1.0 / 32.0,
            patch_noise: 0.08,
            pixel_noise: 0.008,
            bias: 0.05,
            fattening: 3.0,
            holes: 0.08,
            mismatches: 0.003,
            exposure: 0.25,
            max_range: 10.0,
        }
    }
}

/// Sides of the patches over which errors, holes, mismatches and bias are alike (pixels).
const PATCHES: [f64; 4] = [22.0, 40.0, 14.0, 90.0];
/// The image's motion (pixels) during an exposure that makes noise and holes half as large again.
const BLUR: f64 = 9.0;
/// Of pixels on an outline so many fly.
const FLYING: f64 = 0.25;
/// A difference in disparity (pixels) within this distance (pixels) leaves no depth where the window holds both surfaces.
const OUTLINE: (f64, usize) = (1.0, 6);

impl StereoCamera {
    /// The depth image (mm) from a pose, the camera having come from `T_world_last`.
    pub fn measure(
        &self,
        space: &Space,
        T_world_camera: &Pose3,
        T_world_last: &Pose3,
        camera: &Pinhole,
        seed: u64,
    ) -> DepthImage {
        let exact = space.depth(T_world_camera, camera);
        let (width, height) = (camera.width, camera.height);
        let turned = (T_world_last.inverse() * T_world_camera).rotation_angle();
        let blur = (1.0 + (self.exposure * turned * camera.fx / BLUR).powi(2)).sqrt();
        let mut random = Random::new(seed);
        let field = |u: usize, v: usize, size: f64, seed: u64| {
            let place = Vector3::new(u as f64 / size, v as f64 / size, 0.5);
            // Of [0, 1] with a standard deviation of about 0.2.
            (smooth(&place, seed) - 0.5) / 0.2
        };
        let focal = camera.fx * self.baseline;
        let mut values = vec![0; width * height];
        for v in 0..height {
            let disparity = |u: usize| focal / exact[v * width + u];
            // The nearest surface within the matching window wins.
            let fattened: Vec<f64> = (0..width)
                .map(|u| {
                    let reach = self.fattening * (0.5 + 0.5 * field(u, v, PATCHES[0], seed + 11)).clamp(0.0, 1.0);
                    let reach = reach.round() as usize;
                    (u.saturating_sub(reach)..(u + reach + 1).min(width)).map(disparity).fold(0.0, f64::max)
                })
                .collect();
            let mut seen_by_other = f64::INFINITY;
            for u in (0..width).rev() {
                let mut disparity = fattened[u];
                let place = u as f64 - disparity;
                let is_occluded = place >= seen_by_other || place < 0.0;
                seen_by_other = seen_by_other.min(place);
                let z = focal / disparity;
                let missing = self.holes * blur * (z / 2.0).clamp(0.5, 3.0);
                let patch =
                    |size: f64, salt: u64| hashed((u as f64 / size) as i64, (v as f64 / size) as i64, 0, seed + salt);
                // Of a normal distribution the share `missing` lies below this.
                let is_missing = field(u, v, PATCHES[1], seed + 3) < -1.3 - 2.2 * (0.1 / missing.max(1e-6)).log10();
                let (left, right) = (u.saturating_sub(OUTLINE.1), (u + OUTLINE.1).min(width - 1));
                let is_mixed =
                    (fattened[left] - fattened[right]).abs() > OUTLINE.0 && field(u, v, PATCHES[2], seed + 13) > -0.5;
                if is_occluded || is_missing || is_mixed || !z.is_finite() {
                    continue;
                }
                if patch(PATCHES[2], 5) < self.mismatches * blur {
                    disparity *= 0.5 + 1.5 * patch(PATCHES[2], 7);
                }
                let behind = fattened[(u + 2).min(width - 1)].min(fattened[u.saturating_sub(2)]);
                if behind < 0.9 * disparity && random.happens(FLYING) {
                    disparity = random.uniform(behind, disparity);
                }
                disparity += blur
                    * (self.patch_noise * field(u, v, PATCHES[0], seed) + self.pixel_noise * random.normal())
                    + self.bias * field(u, v, PATCHES[3], 1);
                let depth = focal / ((disparity / self.step).round() * self.step);
                if depth > 0.0 && depth < self.max_range {
                    values[v * width + u] = (1000.0 * depth).round() as u16;
                }
            }
        }
        DepthImage { width, height, values, bits: 16 }
    }
}
