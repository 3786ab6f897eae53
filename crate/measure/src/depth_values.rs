//! What the curvature of depth images tells of their values: `cargo measure depth_values FILE...`, a line an image, as it is, inverted, as
//! inverse depth and as the lengths of rays of a camera with the usual focal length; the last line is that of all together.

use scanstitch::camera::{Curvatures, DepthImage};
use scanstitch::io::depth_image;

use crate::arguments::arguments;

pub fn main() {
    let mut together = [(); 4].map(|()| Curvatures::default());
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
            Curvatures::of(&DepthImage { values, ..image.clone() }, focal)
        };
        let nearest = image.values.iter().copied().filter(|value| *value > 0).min().unwrap_or(1);
        let all = [
            made(&|value, _| value),
            made(&|value, _| largest - value),
            made(&|value, _| 0.9 * largest * f64::from(nearest) / value),
            made(&|value, ray| value * ray),
        ];
        print(&path, &all);
        for (sum, curvatures) in together.iter_mut().zip(&all) {
            sum.extend(curvatures);
        }
    }
    print("together", &together);
}

fn print(name: &str, all: &[Curvatures]) {
    let told = |curvatures: &Curvatures| {
        let told = curvatures.told();
        told.no_depth()
            .map_or(if told.is_depth() { "depth".into() } else { "-".to_owned() }, |kind| format!("{kind:?}"))
    };
    println!("{name}: {}", all.iter().map(told).collect::<Vec<_>>().join(" | "));
}
