//! A small seeded generator of random numbers.

/// Uniform numbers of the engine's generator, and others made of them.
#[derive(Debug, Clone)]
pub struct Random(scanstitch::geometry::random::Random);

impl Random {
    /// A generator; each seed gives another sequence.
    pub fn new(seed: u64) -> Self {
        Self(scanstitch::geometry::random::Random::new(seed))
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.uniform(low, high)
    }

    /// Whether something of this probability happens.
    pub fn happens(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.uniform(0.0, 1.0))).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.uniform(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_right_and_seeds_differ() {
        let mut random = Random::new(7);
        let samples: Vec<f64> = (0..100_000).map(|_| random.normal()).collect();
        let mean = samples.iter().sum::<f64>() / 1e5;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 1e5;
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
        let share = (0..100_000).filter(|_| random.happens(0.3)).count() as f64 / 1e5;
        assert!((share - 0.3).abs() < 0.01, "{share}");
        assert_ne!(Random::new(1).uniform(0.0, 1.0), Random::new(2).uniform(0.0, 1.0));
    }
}
