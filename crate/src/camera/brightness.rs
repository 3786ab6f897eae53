//! The brightness pyramid of a colour image, from half its size downwards, for photometric registration.

use super::{ColorImage, Pinhole};

/// Brightness in an image pyramid, each level half as wide as the one before it.
///
/// Burt and Adelson, "The Laplacian pyramid as a compact image code", IEEE Transactions on Communications 31 (1983).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Brightness {
    levels: [Level; NUM_LEVELS],
}

/// One level: pixel (u, v) is the smoothed brightness around pixel (2 u, 2 v) of the next finer level.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Level {
    width: usize,
    height: usize,
    /// Row by row, grey levels (0 to 255) in [`GREY_UNIT`]s.
    values: Vec<u16>,
}

/// Brightness at a position and its gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    /// Brightness (grey levels, 0 to 255).
    pub value: f64,
    /// Gradient along the rows and along the columns (grey levels per pixel of the level).
    pub gradient: [f64; 2],
}

/// Levels of the pyramid.
pub(crate) const NUM_LEVELS: usize = 3;
/// Side of the squares of image pixels that are averaged to a pixel of the finest level.
const FINEST_BINNING: usize = 2;
/// Resolution of the stored brightness (grey levels).
pub(crate) const GREY_UNIT: f64 = 1.0 / 256.0;

impl Brightness {
    /// From a colour image: the mean of the three channels.
    #[inline(never)]
    pub fn new(colors: &ColorImage) -> Self {
        let (width, height) = (colors.width / FINEST_BINNING, colors.height / FINEST_BINNING);
        let grey = |[r, g, b]: [u8; 3]| u32::from(r) + u32::from(g) + u32::from(b);
        let mut values = Vec::with_capacity(width * height);
        for rows in colors.pixels.chunks_exact(FINEST_BINNING * colors.width.max(1)) {
            let (upper, lower) = rows.split_at(colors.width);
            let pairs = upper.chunks_exact(FINEST_BINNING).zip(lower.chunks_exact(FINEST_BINNING));
            values.extend(pairs.map(|(upper, lower)| {
                // The mean of twelve channels.
                ((grey(upper[0]) + grey(upper[1]) + grey(lower[0]) + grey(lower[1])) * 256 / 12) as u16
            }));
        }
        let finest = Level { width, height, values }.smoothed::<1>();
        let middle = finest.smoothed::<2>();
        let coarsest = middle.smoothed::<2>();
        Self { levels: [finest, middle, coarsest] }
    }

    /// From all levels, as [`levels`](Self::levels) returns them: columns, rows and values, the finest first. `None` where they
    /// are not a pyramid of one image.
    pub(crate) fn from_levels(levels: [(usize, usize, Vec<u16>); NUM_LEVELS]) -> Option<Self> {
        let levels = levels.map(|(width, height, values)| Level { width, height, values });
        let is_whole = |level: &Level| level.width.checked_mul(level.height) == Some(level.values.len());
        let follows = |(level, next): (&Level, &Level)| level.halved_size() == (next.width, next.height);
        let is_pyramid = levels.iter().all(is_whole) && levels.iter().zip(&levels[1..]).all(follows);
        is_pyramid.then_some(Self { levels })
    }

    /// Columns, rows and values of all levels, the finest first.
    pub(crate) fn levels(&self) -> [(usize, usize, &[u16]); NUM_LEVELS] {
        self.levels.each_ref().map(|Level { width, height, values }| (*width, *height, &values[..]))
    }

    /// Memory on the heap (bytes).
    pub(crate) fn num_bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of::<u16>() * level.values.capacity()).sum()
    }

    /// The camera that sees the pixels of a level, `camera` being that of the colour image.
    pub fn camera(&self, camera: &Pinhole, level: usize) -> Pinhole {
        let finest = FINEST_BINNING as f64;
        let shift = (finest - 1.0) / 2.0;
        let scale = finest * f64::from(1 << level);
        Pinhole {
            width: self.levels[level].width,
            height: self.levels[level].height,
            fx: camera.fx / scale,
            fy: camera.fy / scale,
            cx: (camera.cx - shift) / scale,
            cy: (camera.cy - shift) / scale,
        }
    }

    /// The gradient of the brightness at a pixel of a level (grey levels a pixel), along the rows and along the columns; `None` at
    /// the border.
    #[inline]
    pub(crate) fn gradient(&self, level: usize, column: usize, row: usize) -> Option<[f64; 2]> {
        let Level { width, height, values } = &self.levels[level];
        if column == 0 || row == 0 || column + 1 >= *width || row + 1 >= *height {
            return None;
        }
        let index = row * width + column;
        let half = |a: u16, b: u16| 0.5 * GREY_UNIT * (f64::from(a) - f64::from(b));
        Some([half(values[index + 1], values[index - 1]), half(values[index + width], values[index - width])])
    }

    /// Brightness and gradient at (u, v) of a level, by interpolation; `None` within a pixel of the border.
    #[inline]
    pub(crate) fn sample(&self, level: usize, u: f64, v: f64) -> Option<Sample> {
        let Level { width, height, values } = &self.levels[level];
        // Comparisons that are false for NaN.
        if !(u >= 1.0 && v >= 1.0 && u < (*width as f64) - 2.0 && v < (*height as f64) - 2.0) {
            return None;
        }
        let (column, row) = (u as usize, v as usize);
        let (right, down) = (u - column as f64, v - row as f64);
        // The four rows around the position, each at the columns left, here, right and one further.
        let line = |row: usize| {
            let line = &values[row * width + column - 1..][..4];
            [f64::from(line[0]), f64::from(line[1]), f64::from(line[2]), f64::from(line[3])]
        };
        let (above, upper, lower, below) = (line(row - 1), line(row), line(row + 1), line(row + 2));
        let between = |line: [f64; 4]| line[1] + right * (line[2] - line[1]);
        let across = |line: [f64; 4]| line[2] - line[0] + right * (line[3] - line[1] - line[2] + line[0]);
        let blend = |upper: f64, lower: f64| upper + down * (lower - upper);
        Some(Sample {
            value: GREY_UNIT * blend(between(upper), between(lower)),
            gradient: [
                0.5 * GREY_UNIT * blend(across(upper), across(lower)),
                0.5 * GREY_UNIT * blend(between(lower) - between(above), between(below) - between(upper)),
            ],
        })
    }
}

impl Level {
    /// Smoothed with the kernel 1 4 6 4 1 along rows and columns, of which one in `STRIDE` is kept; the border is repeated outwards.
    fn smoothed<const STRIDE: usize>(&self) -> Self {
        let Self { width, height, values } = self;
        let (width, height) = (*width, *height);
        let kernel = |a: u16, b: u16, c: u16, d: u16, e: u16| {
            let (ends, inner) = (u32::from(a) + u32::from(e), u32::from(b) + u32::from(d));
            ((ends + 4 * inner + 6 * u32::from(c) + 8) / 16) as u16
        };
        let kept_width = width.div_ceil(STRIDE);
        let mut along_rows = Vec::with_capacity(kept_width * height);
        let mut padded = Vec::with_capacity(width + 4);
        for row in values.chunks_exact(width.max(1)) {
            padded.clear();
            padded.extend([row[0]; 2]);
            padded.extend_from_slice(row);
            padded.extend([row[width - 1]; 2]);
            let around = padded.windows(5).step_by(STRIDE);
            along_rows.extend(around.map(|five| kernel(five[0], five[1], five[2], five[3], five[4])));
        }
        let mut smoothed = Vec::with_capacity(kept_width * height.div_ceil(STRIDE));
        for row in (0..height).step_by(STRIDE) {
            let line = |row: usize| &along_rows[row.min(height - 1) * kept_width..][..kept_width];
            let (a, b, c, d, e) =
                (line(row.saturating_sub(2)), line(row.saturating_sub(1)), line(row), line(row + 1), line(row + 2));
            smoothed
                .extend((0..kept_width).map(|column| kernel(a[column], b[column], c[column], d[column], e[column])));
        }
        Self { width: kept_width, height: height.div_ceil(STRIDE), values: smoothed }
    }

    fn halved_size(&self) -> (usize, usize) {
        (self.width.div_ceil(2), self.height.div_ceil(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize, grey: impl Fn(f64, f64) -> f64) -> ColorImage {
        let pixel = |index: usize| [grey((index % width) as f64, (index / width) as f64).round() as u8; 3];
        ColorImage { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    #[test]
    fn every_level_sees_the_same_ramp_with_its_own_camera() {
        let (width, height) = (90, 71);
        let camera = Pinhole::new(width, height, [80.0, 80.0, 44.5, 35.0]).unwrap();
        let ramp = |u: f64, v: f64| 20.0 + 1.5 * u + 0.7 * v;
        let brightness = Brightness::new(&image(width, height, ramp));
        for level in 0..NUM_LEVELS {
            let pixel = camera.ray(47.3, 33.8);
            let place = brightness.camera(&camera, level).project(&pixel).unwrap();
            let Sample { value, gradient } = brightness.sample(level, place.x, place.y).unwrap();
            assert!((value - ramp(47.3, 33.8)).abs() < 0.3, "level {level}: {value}");
            let scale = f64::from(2 << level);
            assert!(
                (gradient[0] / scale - 1.5).abs() < 0.05 && (gradient[1] / scale - 0.7).abs() < 0.05,
                "{gradient:?}"
            );
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_values_of_a_smooth_image() {
        let wave = |u: f64, v: f64| 128.0 + 90.0 * (u / 9.0).sin() * (v / 11.0).cos();
        let brightness = Brightness::new(&image(128, 96, wave));
        for (u, v) in [(20.2, 17.9), (40.5, 30.5), (33.1, 12.0)] {
            let value = |u, v| brightness.sample(0, u, v).unwrap().value;
            let numeric = [(value(u + 0.5, v) - value(u - 0.5, v)), (value(u, v + 0.5) - value(u, v - 0.5))];
            let gradient = brightness.sample(0, u, v).unwrap().gradient;
            assert!(
                (gradient[0] - numeric[0]).abs() < 0.4 && (gradient[1] - numeric[1]).abs() < 0.4,
                "{gradient:?} {numeric:?}"
            );
        }
    }

    #[test]
    fn beyond_the_border_nothing_is_seen_and_tiny_images_have_nothing() {
        let brightness = Brightness::new(&image(32, 32, |u, _| u));
        for (u, v) in [(0.5, 5.0), (5.0, 0.9), (14.0, 5.0), (5.0, 14.5), (f64::NAN, 5.0), (-3.0, 5.0)] {
            assert_eq!(brightness.sample(0, u, v), None, "{u} {v}");
        }
        for (width, height) in [(0, 0), (1, 1), (3, 2), (5, 4)] {
            let brightness = Brightness::new(&image(width, height, |_, _| 7.0));
            assert_eq!(brightness.sample(NUM_LEVELS - 1, 1.0, 1.0), None);
        }
    }

    #[test]
    fn it_is_made_of_its_levels_and_of_no_others() {
        let brightness = Brightness::new(&image(41, 30, |u, v| 3.0 * u + 2.0 * v));
        let levels = || brightness.levels().map(|(width, height, values)| (width, height, values.to_vec()));
        assert_eq!(Brightness::from_levels(levels()), Some(brightness.clone()));
        for level in 0..NUM_LEVELS {
            let mut short = levels();
            short[level].2.pop();
            assert_eq!(Brightness::from_levels(short), None);
            let mut wider = levels();
            wider[level].0 += 1;
            wider[level].2.extend(vec![0; wider[level].1]);
            assert_eq!(Brightness::from_levels(wider), None);
        }
    }
}
