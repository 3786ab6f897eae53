//! A picture of a planar map: the part of the plane that is shown, its points as pixels, and the colours of frames.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::geometry::quantile::{OUTLIER_SHARE, quantile};

/// Space on each side of a picture that the map leaves free (pixels).
#[derive(Clone, Copy, Debug)]
pub struct Margin {
    /// Above the map.
    pub top: f64,
    /// To the right of it.
    pub right: f64,
    /// Below it.
    pub bottom: f64,
    /// To the left of it.
    pub left: f64,
}

/// A part of the plane on a picture. Plane: metres, y up. Picture: pixels, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneView {
    /// Width and height of the picture (pixels).
    pub size: [usize; 2],
    /// Position in the plane at the centre of the picture (m).
    pub center: [f64; 2],
    /// Scale (pixels per metre).
    pub scale: f64,
    /// Whether x points down and y to the right, which suits a map that is taller than wide.
    pub is_turned: bool,
}

/// A point and the index of its colour.
#[derive(Clone, Copy, Debug)]
pub struct PicturedPoint {
    /// x and y (m).
    pub position: [f32; 2],
    /// Index among the colours.
    pub color: u32,
}

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// Quantile of the ranges up to which returns are near, and therefore in view.
const NEAR_QUANTILE: f64 = 0.9;
/// Multiple of the median range up to which returns are near as well.
const NEAR_MEDIANS: f64 = 2.0;
/// Smallest gain in scale for which a map is rotated by a right angle.
const TURN_GAIN: f64 = 1.5;
/// Smallest side of the shown part (m).
const MIN_EXTENT: f64 = 0.5;
/// Smallest and largest diameter of a point (pixels): the fewer the points, the larger.
const DIAMETERS: (f64, f64) = (1.0, 3.4);
/// Mean spacing, in diameters, that evenly spread points would have.
const SPACING_IN_DIAMETERS: f64 = 5.0;

/// Smallest and largest x, and smallest and largest y (m).
type Bounds = [[f64; 2]; 2];

impl PlaneView {
    /// The view of the path and of the near returns. `sensor_of` gives the index in `path` of the position that a point was
    /// measured from. `None` where there is nothing to show.
    pub fn fitted(
        size: [usize; 2],
        margin: Margin,
        points: &[PicturedPoint],
        path: &[[f64; 2]],
        sensor_of: impl Fn(usize) -> Option<usize>,
    ) -> Option<Self> {
        let bounds = bounds_of(points, path, sensor_of)?;
        let extent = bounds.map(|[low, high]| (high - low).max(MIN_EXTENT));
        let [width, height] = size.map(|side| side as f64);
        let free = [(width - margin.left - margin.right).max(40.0), (height - margin.top - margin.bottom).max(40.0)];
        let scale_in = |[width, height]: [f64; 2], [x, y]: [f64; 2]| (width / x).min(height / y);
        let turned = [extent[1], extent[0]];
        let is_turned = scale_in([width, height], turned) > TURN_GAIN * scale_in([width, height], extent);
        let scale = scale_in(free, if is_turned { turned } else { extent });
        let center = bounds.map(|[low, high]| f64::midpoint(low, high));
        let mut view = Self { size, center, scale, is_turned };
        // The centre of the free part is not the centre of the picture.
        let aside = [(margin.left - margin.right) / 2.0, (margin.top - margin.bottom) / 2.0];
        let [x, y] = view.pixel(center);
        view.center = view.position([x - aside[0], y - aside[1]]);
        Some(view)
    }

    /// The pixel of a position in the plane (m).
    pub fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [dx, dy] = [x - self.center[0], y - self.center[1]];
        let [right, up] = if self.is_turned { [dy, -dx] } else { [dx, dy] };
        let [width, height] = self.size.map(|side| side as f64);
        [width / 2.0 + right * self.scale, height / 2.0 - up * self.scale]
    }

    /// The position in the plane (m) of a pixel.
    fn position(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [width, height] = self.size.map(|side| side as f64);
        let [right, up] = [(x - width / 2.0) / self.scale, (height / 2.0 - y) / self.scale];
        let [dx, dy] = if self.is_turned { [-up, right] } else { [right, up] };
        [self.center[0] + dx, self.center[1] + dy]
    }

    /// Points over a background, red, green, blue, opaque, row by row from the top; later points lie on top.
    pub fn paint(&self, points: &[PicturedPoint], colors: &[Rgb], background: Rgb) -> Vec<u8> {
        let [width, height] = self.size;
        let mut pixels: Vec<u8> = [background[0], background[1], background[2], u8::MAX].repeat(width * height);
        let mut coverages = vec![0.0_f64; width * height];
        let dot = dot_of(self.diameter(points.len()));
        for point in points {
            let [x, y] = self.pixel(point.position.map(f64::from)).map(f64::floor);
            let color = colors.get(point.color as usize).copied().unwrap_or_default();
            for &(dx, dy, coverage) in &dot {
                let (x, y) = (x + dx, y + dy);
                if x < 0.0 || y < 0.0 || x >= width as f64 || y >= height as f64 {
                    continue;
                }
                let at = y as usize * width + x as usize;
                // The maximum of the coverages, so that overlapping dots neither darken nor show fringes.
                if coverages[at] > coverage {
                    continue;
                }
                coverages[at] = coverage;
                for channel in 0..3 {
                    let [over, under] = [color[channel], background[channel]].map(f64::from);
                    pixels[4 * at + channel] = (under + (over - under) * coverage).round() as u8;
                }
            }
        }
        pixels
    }

    fn diameter(&self, num_points: usize) -> f64 {
        let area = self.size[0] as f64 * self.size[1] as f64 / num_points.max(1) as f64;
        (area.sqrt() / SPACING_IN_DIAMETERS).clamp(DIAMETERS.0, DIAMETERS.1)
    }
}

/// A round dot: offsets of the pixels that it covers from its centre, and their coverage (0..=1).
fn dot_of(diameter: f64) -> Vec<(f64, f64, f64)> {
    if diameter < 1.5 {
        return vec![(0.0, 0.0, 1.0)];
    }
    if diameter < 2.5 {
        return vec![(0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (0.0, 1.0, 1.0), (1.0, 1.0, 1.0)];
    }
    let radius = diameter / 2.0;
    let reach = radius.ceil() as i32;
    let places = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (f64::from(x), f64::from(y))));
    let covered = places.map(|(x, y)| (x, y, (radius + 0.5 - x.hypot(y)).clamp(0.0, 1.0)));
    covered.filter(|&(_, _, coverage)| coverage > 0.05).collect()
}

fn bounds_of(
    points: &[PicturedPoint],
    path: &[[f64; 2]],
    sensor_of: impl Fn(usize) -> Option<usize>,
) -> Option<Bounds> {
    let range = |index: usize| {
        let sensor = sensor_of(index).and_then(|frame| path.get(frame))?;
        let [x, y] = points[index].position.map(f64::from);
        Some((x - sensor[0]).hypot(y - sensor[1]))
    };
    let ranges: Vec<f64> = (0..points.len()).map(|index| range(index).unwrap_or(0.0)).collect();
    let mut reordered = ranges.clone();
    let mut range_at = |share| quantile(&mut reordered, share).unwrap_or(0.0);
    let limit = range_at(NEAR_QUANTILE).max(NEAR_MEDIANS * range_at(0.5));
    let span = |axis: usize| {
        let near = points.iter().zip(&ranges).filter(|&(_, &range)| range <= limit);
        let mut along: Vec<f64> = near.map(|(point, _)| f64::from(point.position[axis])).collect();
        let ends = [OUTLIER_SHARE, 1.0 - OUTLIER_SHARE].map(|share| quantile(&mut along, share));
        let all = ends.into_iter().flatten().chain(path.iter().map(|place| place[axis]));
        all.fold(None, |span: Option<[f64; 2]>, value| {
            Some(span.map_or([value; 2], |[low, high]| [low.min(value), high.max(value)]))
        })
    };
    Some([span(0)?, span(1)?])
}

/// Length of the mean of the unit vectors to the returns above which a scanner has a viewing direction: that of a field of view
/// of 300 degrees.
const MIN_LOOK: f64 = 0.19;

/// Direction in which a scanner looks in its own frame (rad), from the bearings of its returns, since files of points do not
/// say whether x or y points ahead. A multiple of pi / 2; zero for a scanner with a field of view of 360 degrees.
pub fn look_direction(bearings: impl Iterator<Item = f64>) -> f64 {
    let [x, y, count] = bearings.fold([0.0; 3], |[x, y, count], bearing| {
        let (sin, cos) = bearing.sin_cos();
        [x + cos, y + sin, count + 1.0]
    });
    if x.hypot(y) < MIN_LOOK * count { 0.0 } else { (y.atan2(x) / FRAC_PI_2).round() * FRAC_PI_2 }
}

/// Hues of the first and the last frame (degrees).
const HUES: (f64, f64) = (300.0, 88.0);

/// A colour for each of `count` frames, of increasing lightness, for a light or a dark background.
pub fn frame_colors(count: usize, is_dark: bool) -> Vec<Rgb> {
    let (first, last, chroma) = if is_dark { (0.57, 0.9, 0.16) } else { (0.36, 0.66, 0.17) };
    let share = |frame: usize| if count > 1 { frame as f64 / (count - 1) as f64 } else { 0.3 };
    let color = |t: f64| oklch(first + (last - first) * t, chroma, HUES.0 + (HUES.1 - HUES.0) * t);
    (0..count).map(|frame| color(share(frame))).collect()
}

/// The colour of this hue and lightness with the largest chroma, up to `chroma`, that sRGB can show.
///
/// Source of the colour space: Ottosson, "A perceptual color space for image processing", 2020.
fn oklch(lightness: f64, mut chroma: f64, hue: f64) -> Rgb {
    loop {
        let linear = linear_rgb(lightness, chroma.max(0.0), hue / 360.0 * TAU);
        if chroma <= 0.0 || linear.iter().all(|value| (-1e-4..=1.0 + 1e-4).contains(value)) {
            return linear.map(|value| (255.0 * gamma(value.clamp(0.0, 1.0))).round() as u8);
        }
        chroma -= 0.005;
    }
}

fn linear_rgb(lightness: f64, chroma: f64, hue: f64) -> [f64; 3] {
    let (b, a) = hue.sin_cos();
    let (a, b) = (chroma * a, chroma * b);
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
}

/// sRGB's transfer function, IEC 61966-2-1.
fn gamma(value: f64) -> f64 {
    if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARGIN: Margin = Margin { top: 10.0, right: 30.0, bottom: 20.0, left: 10.0 };

    fn corners() -> Vec<PicturedPoint> {
        let places = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
        (0..4).map(|i| PicturedPoint { position: places[i], color: i as u32 }).collect()
    }

    #[test]
    fn the_map_fills_the_picture_within_the_margins() {
        let view = PlaneView::fitted([440, 330], MARGIN, &corners(), &[[1.0, 1.0]], |_| Some(0)).expect("a map");
        assert!((view.scale - 100.0).abs() < 1e-9);
        assert_eq!(view.pixel([0.0, 3.0]).map(f64::round), [10.0, 10.0]);
        assert_eq!(view.pixel([4.0, 0.0]).map(f64::round), [410.0, 310.0]);
        assert!(PlaneView::fitted([440, 330], MARGIN, &[], &[], |_| None).is_none());
    }

    #[test]
    fn a_tall_map_is_rotated_in_a_wide_picture() {
        let path = [[0.0, 0.0], [1.0, 10.0]];
        let view = PlaneView::fitted([440, 120], MARGIN, &[], &path, |_| None).expect("a path");
        assert!(view.is_turned);
        let [first, last] = path.map(|place| view.pixel(place));
        assert!(last[0] - first[0] > 300.0 && last[1] > first[1]);
        let back = view.position(view.pixel([0.3, 4.0]));
        assert!((back[0] - 0.3).hypot(back[1] - 4.0) < 1e-9);
    }

    #[test]
    fn points_are_painted_in_their_colours() {
        let view = PlaneView::fitted([440, 330], MARGIN, &corners(), &[[1.0, 1.0]], |_| Some(0)).expect("a map");
        let colors = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [9, 9, 9]];
        let pixels = view.paint(&corners(), &colors, [250, 251, 252]);
        assert_eq!(pixels.len(), 4 * 440 * 330);
        assert_eq!(pixels[..4], [250, 251, 252, 255]);
        let [x, y] = view.pixel([4.0, 3.0]).map(|value| value.floor() as usize);
        assert_eq!(pixels[4 * (y * 440 + x)..][..4], [0, 0, 255, 255]);
        let num_painted = pixels.chunks(4).filter(|pixel| pixel[..3] != [250, 251, 252]).count();
        assert!((4 * 9..=4 * 21).contains(&num_painted), "{num_painted}");
    }

    #[test]
    fn a_scanner_looks_along_the_mean_of_its_bearings() {
        let fan = |from: i32, to: i32| (from..to).map(|degree| f64::from(degree).to_radians());
        assert!((look_direction(fan(0, 180)) - FRAC_PI_2).abs() < 1e-12);
        assert!((look_direction(fan(-120, 150))).abs() < 1e-12);
        assert!((look_direction(fan(0, 360))).abs() < 1e-12);
        assert!((look_direction(std::iter::empty())).abs() < 1e-12);
    }

    #[test]
    fn colours_of_frames_become_lighter() {
        let colors = frame_colors(5, false);
        let luma = |[r, g, b]: Rgb| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
        assert!(colors.windows(2).all(|pair| luma(pair[0]) < luma(pair[1])), "{colors:?}");
    }
}
