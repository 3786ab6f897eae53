//! The errors of a depth camera, applied to exact depth: quantisation and noise.

use super::super::random::Random;
use scanstitch::camera::DepthImage;

/// How depth becomes whole numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthSensor {
    /// 8 bits over 10 m, `v = z / 10 * 255`, as the renderings of rooms used in teaching have it.
    EightBits {
        /// To the nearest step; cut off otherwise.
        rounded: bool,
        /// Whether depth beyond the last step starts anew at 0, as a cast to a byte makes it; otherwise it stays 255.
        wraps: bool,
    },
    /// 16 bits of millimetres, 0 beyond 65.535 m.
    Millimetres {
        /// Standard deviation of the depth over its square (1/m): 0 for none, Kinect's is 1.4e-3 to 2e-3 (Khoshelham and
        /// Elberink, "Accuracy and resolution of Kinect depth data", Sensors 12 (2012)).
        square_noise: f64,
    },
}

impl DepthSensor {
    /// The homework's: cut off and wrapped.
    pub const HOMEWORK: Self = Self::EightBits { rounded: false, wraps: true };

    /// The image of exact depths (m), row by row; where nothing was met the depth is infinite and the value 0.
    pub fn measure(&self, depth: &[f64], width: usize, random: &mut Random) -> DepthImage {
        let height = depth.len() / width.max(1);
        let values = depth.iter().map(|&z| if z.is_finite() { self.value(z, random) } else { 0 }).collect();
        let bits = if matches!(self, Self::EightBits { .. }) { 8 } else { 16 };
        DepthImage { width, height, values, bits }
    }

    fn value(&self, z: f64, random: &mut Random) -> u16 {
        match *self {
            Self::EightBits { rounded, wraps } => {
                let steps = z / 10.0 * 255.0 + if rounded { 0.5 } else { 0.0 };
                if wraps { (steps as u64 % 256) as u16 } else { steps.min(255.0) as u16 }
            }
            Self::Millimetres { square_noise } => {
                let measured = z + if square_noise > 0.0 { square_noise * z * z * random.normal() } else { 0.0 };
                let millimetres = (measured * 1000.0 + 0.5).floor();
                if (0.0..=f64::from(u16::MAX)).contains(&millimetres) { millimetres as u16 } else { 0 }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(sensor: DepthSensor, depth: &[f64]) -> Vec<u16> {
        sensor.measure(depth, depth.len(), &mut Random::new(1)).values
    }

    #[test]
    fn eight_bits_are_cut_off_rounded_wrapped_or_kept() {
        let depth = [0.0, 0.03, 5.0, 9.999, 10.05, 20.1, f64::INFINITY];
        assert_eq!(values(DepthSensor::HOMEWORK, &depth), [0, 0, 127, 254, 0, 0, 0]);
        let kept = DepthSensor::EightBits { rounded: true, wraps: false };
        assert_eq!(values(kept, &depth), [0, 1, 128, 255, 255, 255, 0]);
        assert_eq!(values(DepthSensor::HOMEWORK, &[10.5]), [11]);
    }

    #[test]
    fn noise_grows_with_the_square_of_the_depth() {
        let exact = DepthSensor::Millimetres { square_noise: 0.0 };
        assert_eq!(values(exact, &[1.2344, 1.2346, 65.6]), [1234, 1235, 0]);
        let noisy = DepthSensor::Millimetres { square_noise: 2e-3 };
        for z in [1.0, 4.0] {
            let measured = values(noisy, &vec![z; 20_000]);
            let errors = measured.iter().map(|&value| f64::from(value) / 1000.0 - z);
            let sigma = (errors.map(|error| error * error).sum::<f64>() / 20_000.0).sqrt();
            assert!((sigma / (2e-3 * z * z) - 1.0).abs() < 0.05, "{sigma} at {z} m");
        }
    }
}
