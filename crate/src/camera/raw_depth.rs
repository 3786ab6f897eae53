//! What the values of a depth image are: distances along the optical axis, or something that was made of them.
//!
//! A plane has 1 / z = a + b u + c v in the pixels (u, v). So z is curved along its gradient g, by 2 |g|^2 / z, and not across it. Values
//! m - z, where near is bright, are curved the other way round; inverse depth is not curved at all; the length r of the ray (x, y, 1) f is
//! curved across the gradient, too, by r (1 / n^2 - x_t^2 / n^4) / f^2, with n^2 = 1 + x^2 + y^2 and x_t the part of (x, y) across it. The
//! curvatures of all smooth pieces of the image over those that each kind of values would have are one ratio: 1 if the values are of
//! that kind. Curved surfaces are outliers of it.

use serde::{Deserialize, Serialize};

use super::depth_image::DepthImage;
use crate::geometry::quantile::{THREE_SIGMA, quantile};
use crate::geometry::robust_ratio::RobustRatio;

/// What else values may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoDepth {
    /// Near is bright.
    Inverted,
    /// Inverse depth: disparity.
    Inverse,
    /// The length of the ray from the camera.
    RayLength,
}

impl NoDepth {
    /// What the values are, and what to do.
    pub(crate) fn in_words(self) -> (&'static str, &'static str) {
        match self {
            Self::Inverted => ("inverted, near being bright", "Set depth_values=inverted"),
            Self::Inverse => {
                ("inverse depth, as disparities", "Save depth, focal length times baseline over disparity")
            }
            Self::RayLength => (
                "the lengths of rays, not depth along the optical axis",
                "Save depth, the length over sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2) at the pixel (u, v)",
            ),
        }
    }
}

/// Of each smooth piece of images: what it is curved by, what it would be if the values were of that kind, and the standard deviation of
/// what it is curved by (values a square pixel).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Curvatures {
    /// Along the gradient, of depth.
    depth: Vec<[f32; 3]>,
    /// Along the gradient, of inverted depth.
    inverted: Vec<[f32; 3]>,
    /// Across the gradient, of the lengths of rays.
    ray_length: Vec<[f32; 3]>,
    /// Standard deviations of the values from the smooth pieces (values).
    scatter: Vec<f32>,
}

/// Pieces in a row of the image: large ones tell more, small ones find room on small surfaces.
const PIECES: [usize; 2] = [8, 16];
/// A piece is smooth where its values deviate from a quadratic surface by less than this share of them, or than rounding does.
const SMOOTH: (f64, f64) = (0.005, 0.4);

impl Curvatures {
    /// Of an image whose camera has about this focal length (pixels).
    pub fn of(image: &DepthImage, focal_length: f64) -> Self {
        let mut all = Self::default();
        for side in PIECES.map(|pieces| (image.width / pieces).max(6)) {
            for top in (0..image.height.saturating_sub(side - 1)).step_by(side) {
                for left in (0..image.width.saturating_sub(side - 1)).step_by(side) {
                    let Some(piece) = Piece::of(image, left, top, side) else { continue };
                    let place = [(left, image.width), (top, image.height)]
                        .map(|(begin, whole)| (begin as f64 + (side as f64 - whole as f64) / 2.0) / focal_length);
                    let of_depth = 2.0 * piece.slope * piece.slope;
                    let from_largest = (f64::from(image.largest_value()) - piece.value).max(1.0);
                    let of_ray_length = piece.across_of_ray_length(place, focal_length);
                    all.depth.push([piece.along, of_depth / piece.value, piece.error].map(|number| number as f32));
                    all.inverted.push([piece.along, -of_depth / from_largest, piece.error].map(|number| number as f32));
                    all.ray_length.push([piece.across, of_ray_length, piece.error].map(|number| number as f32));
                    all.scatter.push(piece.deviation as f32);
                }
            }
        }
        all
    }

    /// Adds those of another image.
    pub fn extend(&mut self, other: &Self) {
        self.depth.extend(&other.depth);
        self.inverted.extend(&other.inverted);
        self.ray_length.extend(&other.ray_length);
        self.scatter.extend(&other.scatter);
    }

    /// What they tell.
    pub fn told(&self) -> ToldValues {
        let ratio = |curvatures: &Vec<[f32; 3]>| {
            RobustRatio::of(&curvatures.iter().map(|numbers| numbers.map(f64::from)).collect::<Vec<_>>())
        };
        let mut scatter: Vec<f64> = self.scatter.iter().copied().map(f64::from).collect();
        let [depth, inverted, ray_length] = [&self.depth, &self.inverted, &self.ray_length].map(ratio);
        ToldValues { depth, inverted, ray_length, scatter: quantile(&mut scatter, 0.5) }
    }
}

/// What curvatures tell of the values: how often those of each kind fit into what they are; `None` where too few pieces tell.
///
/// Of 724 depth images of eight recordings and nine rendered series none is taken for inverse or inverted. Made inverse or inverted,
/// 57 and 67 % of them are told, and three of those of 8 bits as the wrong one; the others are not told from depth. Eight images
/// together tell all of them, and lengths of rays: over their curvature it is 0.6 to 1.2 then, and -0.5 to 0.3 for depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToldValues {
    /// 0 for inverse depth.
    depth: Option<RobustRatio>,
    inverted: Option<RobustRatio>,
    /// 0 for depth. By the square of what the focal length is wrong by if it is assumed.
    ray_length: Option<RobustRatio>,
    /// Standard deviation of the values of smooth surfaces, in the median (values).
    scatter: Option<f64>,
}

impl ToldValues {
    /// Whether the values are proportional to depth, or to the length of rays.
    pub fn is_depth(&self) -> bool {
        self.depth.is_some_and(|ratio| ratio.is(1.0, THREE_SIGMA))
    }

    /// Whether the values of a flat wall differ, as a sensor measures it, and not by rounding alone.
    pub fn are_noisy(&self) -> bool {
        self.scatter.is_some_and(|scatter| scatter > 1.0)
    }

    /// Whether more tells that near is bright than that it is dark, and too little to take it for sure.
    pub fn may_be_inverted(&self) -> bool {
        self.is_inverted(1.0)
    }

    /// What the values are, where they are no depth.
    pub fn no_depth(&self) -> Option<NoDepth> {
        let is_inverse = self.depth.is_some_and(|ratio| ratio.is(0.0, THREE_SIGMA));
        let is_ray = self.ray_length.is_some_and(|ratio| ratio.is_over(0.5) && ratio.is_over(ratio.value / 2.0));
        match () {
            () if self.is_inverted(THREE_SIGMA) => Some(NoDepth::Inverted),
            () if is_inverse => Some(NoDepth::Inverse),
            () if is_ray => Some(NoDepth::RayLength),
            () => None,
        }
    }

    /// Whether the values are inverted rather than inverse depth, which is not curved where inverted depth is curved little.
    fn is_inverted(&self, deviations: f64) -> bool {
        let (Some(depth), Some(inverted)) = (self.depth, self.inverted) else { return false };
        inverted.is(1.0, deviations)
            && (!depth.is(0.0, deviations) || depth.deviations_from(0.0) > inverted.deviations_from(1.0))
    }
}

/// What a Kinect's driver writes where it measured nothing: the largest of 11 bits.
const KINECT_RAW_NONE: u16 = 2047;
/// Pixels without depth in the band that the projector does not reach, as a share of the image: 8 of 640 columns.
const MIN_KINECT_NONE: f64 = 8.0 / 640.0;

/// Whether these are a Kinect's raw values: no zero, none above 2047, and so many of that.
#[inline(never)]
pub fn holds_kinect_raw(image: &DepthImage) -> bool {
    let num_none = image.values.iter().filter(|&&value| value == KINECT_RAW_NONE).count();
    let is_of_11_bits = image.bits > 8 && image.values.iter().all(|value| (1..=KINECT_RAW_NONE).contains(value));
    is_of_11_bits && num_none as f64 >= MIN_KINECT_NONE * image.values.len() as f64
}

/// A smooth piece of an image.
#[derive(Debug, Clone, Copy)]
struct Piece {
    /// In its middle.
    value: f64,
    /// Length of the gradient (values a pixel), and the direction of that.
    slope: f64,
    direction: [f64; 2],
    /// Second derivative along the gradient and across it (values a square pixel).
    along: f64,
    across: f64,
    /// Standard deviation of these.
    error: f64,
    /// Standard deviation of the values from the quadratic surface.
    deviation: f64,
}

impl Piece {
    /// By the least squares of a quadratic surface, whose terms are orthogonal on a square; `None` where pixels are missing or the
    /// values are not smooth.
    fn of(image: &DepthImage, left: usize, top: usize, side: usize) -> Option<Self> {
        let half = (side - 1) as f64 / 2.0;
        let count = (side * side) as f64;
        let mean_square = (0..side).map(|i| (i as f64 - half).powi(2)).sum::<f64>() / side as f64;
        let (mut sums, mut squares, mut norms) = ([0.0; 6], 0.0, [0.0; 6]);
        for row in 0..side {
            for column in 0..side {
                let value = image.values[(top + row) * image.width + left + column];
                if value == 0 || value == image.largest_value() {
                    return None;
                }
                let (x, y, value) = (column as f64 - half, row as f64 - half, f64::from(value));
                let terms = [1.0, x, y, x * x - mean_square, x * y, y * y - mean_square];
                for ((sum, norm), term) in sums.iter_mut().zip(&mut norms).zip(terms) {
                    *sum += value * term;
                    *norm += term * term;
                }
                squares += value * value;
            }
        }
        let [value, gx, gy, xx, xy, yy] = std::array::from_fn(|term| sums[term] / norms[term]);
        let explained: f64 = sums.iter().zip(norms).map(|(sum, norm)| sum * sum / norm).sum();
        let deviation = ((squares - explained).max(0.0) / (count - 6.0)).sqrt();
        let slope = f64::hypot(gx, gy);
        let is_smooth = deviation < (SMOOTH.0 * value).max(SMOOTH.1);
        if !is_smooth || slope == 0.0 {
            return None;
        }
        let curvature = |x: f64, y: f64| 2.0 * (xx * x * x + xy * x * y + yy * y * y);
        let (x, y) = (gx / slope, gy / slope);
        // Rounding to whole numbers has a deviation of its own, which pixels of one step share.
        let step = (1.0 / slope).max(1.0);
        let error = 2.0 * deviation.max(1.0 / 12f64.sqrt()) * (step / norms[3]).sqrt();
        let [along, across] = [curvature(x, y), curvature(-y, x)];
        Some(Self { value, slope, direction: [x, y], along, across, error, deviation })
    }

    /// The curvature across the gradient of lengths of rays, at this place in the image (x / z, y / z).
    fn across_of_ray_length(&self, [x, y]: [f64; 2], focal_length: f64) -> f64 {
        let square = 1.0 + x * x + y * y;
        let across = self.direction[0] * y - self.direction[1] * x;
        self.value * (1.0 / square - (across / square).powi(2)) / (focal_length * focal_length)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A corner of a room, looked into: depth (m) by pixel.
    pub(crate) fn corner(as_value: impl Fn(f64, f64) -> f64, bits: u8) -> DepthImage {
        let (width, height, focal) = (320, 240, 160.0);
        let value = |pixel: usize| {
            let (x, y) = (((pixel % width) as f64 - 160.0) / focal, ((pixel / width) as f64 - 120.0) / focal);
            let planes = [(0.6, 0.1, 0.8, 2.5), (-0.7, 0.0, 0.7, 2.2), (0.0, 0.95, 0.3, 1.2)];
            let along = |(a, b, c, d): (f64, f64, f64, f64)| d / (a * x + b * y + c);
            let z = planes.into_iter().map(along).filter(|z| *z > 0.0).fold(9.5, f64::min);
            as_value(z, (1.0 + x * x + y * y).sqrt()).round() as u16
        };
        DepthImage { width, height, values: (0..width * height).map(value).collect(), bits }
    }

    #[test]
    fn planes_tell_what_the_values_are() {
        let told = |image: &DepthImage| Curvatures::of(image, 160.0).told().no_depth();
        assert_eq!(told(&corner(|z, _| 1000.0 * z, 16)), None);
        assert_eq!(told(&corner(|z, _| 25.5 * z, 8)), None);
        assert_eq!(told(&corner(|z, _| 255.0 - 25.5 * z, 8)), Some(NoDepth::Inverted));
        assert_eq!(told(&corner(|z, _| 65_535.0 - 6553.5 * z, 16)), Some(NoDepth::Inverted));
        assert_eq!(told(&corner(|z, _| 20_000.0 / z, 16)), Some(NoDepth::Inverse));
        assert_eq!(told(&corner(|z, ray| 1000.0 * z * ray, 16)), Some(NoDepth::RayLength));
        // Far below the largest value, where inverted depth would be straight, too; noise as of a Kinect's disparities.
        let noise = |z: f64| 0.5 * ((1e4 * z).sin() * 43_758.5).sin();
        assert_eq!(told(&corner(|z, _| 3000.0 / z + noise(z), 16)), Some(NoDepth::Inverse));
        assert_eq!(told(&corner(|z, _| 1000.0 * z + 2.0 * z * z * noise(z), 16)), None);
    }
}
