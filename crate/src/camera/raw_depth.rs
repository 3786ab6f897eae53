//! What the values of a depth image are: distances along the optical axis, or something that was made of them.
//!
//! A plane has 1 / z = a + b u + c v in the pixels (u, v). So z is curved along its gradient g, by 2 |g|^2 / z, and not across it. Values
//! m - z, where near is bright, are curved the other way round; inverse depth is not curved at all; the length of the ray is curved across
//! the gradient, too, by r / f^2. Each smooth piece of the image votes; a curved surface votes for anything.

use super::depth_image::DepthImage;
use crate::geometry::quantile::THREE_SIGMA;

/// What else values may be, which is not made into depth here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoDepth {
    /// Inverse depth: disparity.
    Inverse,
    /// The length of the ray from the camera.
    RayLength,
}

/// Pieces that voted for each kind of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Votes {
    /// Curved along the gradient as depth is.
    pub depth: usize,
    /// Curved the other way round.
    pub inverted: usize,
    /// Not curved.
    pub inverse: usize,
    /// Curved across the gradient.
    pub ray_length: usize,
    /// Not curved across the gradient.
    pub axis: usize,
}

/// Pieces in a row of the image: of 8 bits, whose steps hide what is curved little, and of more.
const PIECES: [usize; 2] = [8, 16];
/// A piece is smooth where its values deviate from a quadratic surface by less than this share of them, or than rounding does.
const SMOOTH: (f64, f64) = (0.005, 0.4);
/// So many pieces have to vote alike, ... (On 60 images of eight recordings at most three vote against depth, where six and more
/// vote for it; images of 8 bits made inverted have 8 and more.)
const MIN_VOTES: usize = 8;
/// ... and all but one in so many alike.
const MOST_OTHERS: usize = 4;

impl Votes {
    /// Of an image whose camera has about this focal length (pixels).
    pub fn of(image: &DepthImage, focal_length: f64) -> Self {
        let side = (image.width / PIECES[usize::from(image.bits > 8)]).max(6);
        let mut votes = Self::default();
        for top in (0..image.height.saturating_sub(side - 1)).step_by(side) {
            for left in (0..image.width.saturating_sub(side - 1)).step_by(side) {
                let [x, y] = [(left, image.width), (top, image.height)]
                    .map(|(begin, whole)| (begin as f64 + (side as f64 - whole as f64) / 2.0) / focal_length);
                // Towards the edge of the image the length of a ray is curved less.
                let apparent = focal_length * (1.0 + x * x + y * y);
                if let Some(piece) = Piece::of(image, left, top, side) {
                    votes.take(&piece, f64::from(image.largest_value()), apparent);
                }
            }
        }
        votes
    }

    fn take(&mut self, piece: &Piece, largest: f64, focal_length: f64) {
        let Piece { value, slope, along, across, error } = *piece;
        let [depth, inverted] = [2.0 * slope * slope / value, -2.0 * slope * slope / (largest - value).max(1.0)];
        if tells(depth.min(-inverted), error) {
            match along {
                along if along > depth / 2.0 => self.depth += 1,
                along if along < inverted / 2.0 => self.inverted += 1,
                _ => self.inverse += 1,
            }
        }
        let of_ray = value / (focal_length * focal_length);
        if tells(of_ray, error) {
            *(if across > of_ray / 2.0 { &mut self.ray_length } else { &mut self.axis }) += 1;
        }
    }

    /// Whether the values are proportional to depth, or to the length of rays.
    pub fn is_depth(&self) -> bool {
        is_decided(self.depth, self.inverted + self.inverse)
    }

    /// Whether near is bright.
    pub fn is_inverted(&self) -> bool {
        is_decided(self.inverted, self.depth + self.inverse)
    }

    /// Whether more tells that near is bright than that it is dark, and too little to take it for sure.
    pub fn may_be_inverted(&self) -> bool {
        !self.is_inverted() && self.inverted >= MIN_VOTES / 2 && self.inverted >= MOST_OTHERS * self.depth
    }

    /// What the values are, where they are no depth.
    pub fn no_depth(&self) -> Option<NoDepth> {
        let is_inverse = is_decided(self.inverse, self.depth + self.inverted);
        let is_ray = is_decided(self.ray_length, self.axis);
        is_inverse.then_some(NoDepth::Inverse).or(is_ray.then_some(NoDepth::RayLength))
    }
}

/// What a Kinect's driver writes where it measured nothing: the largest of 11 bits.
const KINECT_RAW_NONE: u16 = 2047;
/// Pixels without depth in the band that the projector does not reach, as a share of the image: 8 of 640 columns.
const MIN_KINECT_NONE: f64 = 8.0 / 640.0;

/// Whether these are a Kinect's raw values: no zero, none above 2047, and so many of that.
pub fn holds_kinect_raw(image: &DepthImage) -> bool {
    let num_none = image.values.iter().filter(|&&value| value == KINECT_RAW_NONE).count();
    let is_of_11_bits = image.bits > 8 && image.values.iter().all(|value| (1..=KINECT_RAW_NONE).contains(value));
    is_of_11_bits && num_none as f64 >= MIN_KINECT_NONE * image.values.len() as f64
}

/// Whether a curvature with this error is told from another kind's that differs by so much: it counts for the nearer of the two.
fn tells(difference: f64, error: f64) -> bool {
    difference / 2.0 > THREE_SIGMA * error
}

fn is_decided(votes: usize, others: usize) -> bool {
    votes >= MIN_VOTES && votes >= MOST_OTHERS * others
}

/// A smooth piece of an image.
#[derive(Debug, Clone, Copy)]
struct Piece {
    /// In its middle.
    value: f64,
    /// Length of the gradient (values a pixel).
    slope: f64,
    /// Second derivative along the gradient and across it (values a square pixel).
    along: f64,
    across: f64,
    /// Standard deviation of these.
    error: f64,
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
        // Rounding to whole numbers has a deviation of its own.
        let error = 2.0 * deviation.max(1.0 / 12f64.sqrt()) / norms[3].sqrt();
        Some(Self { value, slope, along: curvature(x, y), across: curvature(-y, x), error })
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
        let told = |image: &DepthImage| {
            let votes = Votes::of(image, 160.0);
            (votes.is_inverted(), votes.no_depth())
        };
        assert_eq!(told(&corner(|z, _| 1000.0 * z, 16)), (false, None));
        assert_eq!(told(&corner(|z, _| 25.5 * z, 8)), (false, None));
        assert_eq!(told(&corner(|z, _| 255.0 - 25.5 * z, 8)), (true, None));
        assert_eq!(told(&corner(|z, _| 65_535.0 - 6553.5 * z, 16)), (true, None));
        assert_eq!(told(&corner(|z, _| 20_000.0 / z, 16)), (false, Some(NoDepth::Inverse)));
        assert_eq!(told(&corner(|z, ray| 1000.0 * z * ray, 16)), (false, Some(NoDepth::RayLength)));
    }
}
