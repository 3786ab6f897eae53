//! How the smooth pieces of depth images vote on what their values are: `cargo measure depth_values FILE...`, a line an image, as it is,
//! inverted, as inverse depth and as the lengths of rays of a camera with the usual focal length.

use scanstitch::camera::{DepthImage, Votes};
use scanstitch::io::depth_image;

use crate::arguments::arguments;

pub fn main() {
    for path in arguments() {
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let Ok(image) = depth_image::read(&bytes) else { continue };
        let focal = 0.7 * image.width as f64;
        let largest = if image.bits <= 8 { 255.0 } else { 65_535.0 };
        let made = |of: &dyn Fn(f64, f64) -> f64| {
            let value = |(pixel, &value): (usize, &u16)| {
                let at = |index: usize, side: usize| (index as f64 - side as f64 / 2.0) / focal;
                let ray = (1.0
                    + at(pixel % image.width, image.width).powi(2)
                    + at(pixel / image.width, image.height).powi(2))
                .sqrt();
                if value == 0 { 0 } else { of(f64::from(value), ray).clamp(0.0, largest).round() as u16 }
            };
            let values = image.values.iter().enumerate().map(value).collect();
            let votes = Votes::of(&DepthImage { values, ..image.clone() }, focal);
            let Votes { depth, inverted, inverse, ray_length, axis } = votes;
            format!(
                "{depth}/{inverted}/{inverse} {ray_length}/{axis} {}{:?}",
                if votes.is_inverted() { "inverted " } else { "" },
                votes.no_depth()
            )
        };
        let nearest = image.values.iter().copied().filter(|value| *value > 0).min().unwrap_or(1);
        println!(
            "{path}: {} | {} | {} | {}",
            made(&|value, _| value),
            made(&|value, _| largest - value),
            made(&|value, _| 0.9 * largest * f64::from(nearest) / value),
            made(&|value, ray| value * ray),
        );
    }
}
