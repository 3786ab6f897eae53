//! Free space: what a sensor saw through must be empty. A pose that puts points there is contradicted, however small the
//! residuals of the points that have partners.
//!
//! One test, [`FreeSpaceTest`], with three models of a sensor: `beams` for planar scans, `sphere` for clouds seen from
//! their sensor, and [`projective`](super::projective) for depth images and maps of surface. Each has a method `classify`
//! that says what it saw of a point; [`FreeSpaceTally`] counts the answers.

pub(crate) mod beams;
pub(crate) mod sphere;

use std::f64::consts::SQRT_2;

use nalgebra::Vector3;

use crate::camera::Surfel;

/// What a sensor saw of a point, with the surface that it saw there where the sensor's model knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FreeSpaceTest<S = ()> {
    /// A surface where the point lies, within the tolerance.
    Agreeing(S),
    /// A surface behind the point: the sensor saw through where it lies.
    InFreeSpace,
    /// A surface in front of the point: nothing can be said.
    Hidden,
    /// Nothing is known in the point's direction, or not enough.
    Unknown,
}

impl FreeSpaceTest<Surfel> {
    /// A surface agrees with a point on a surface only where both face about the same way (cosine of the angle between their
    /// unit normals); otherwise nothing can be said.
    #[must_use]
    #[inline]
    pub fn facing(self, normal: &Vector3<f64>, min_cosine: f64) -> Self {
        match self {
            Self::Agreeing(seen) if seen.normal.dot(normal) > min_cosine => Self::Agreeing(seen),
            Self::Agreeing(_) => Self::Unknown,
            other => other,
        }
    }
}

/// The noise of a depth camera, which grows with the square of the depth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DepthNoise {
    /// Standard deviation of the depth over its square (1/m), beyond that of the raw values' steps.
    pub square_noise: f64,
}

/// Surfaces that differ by fewer standard deviations of the sensor's noise are not told apart. With 2.5, a frame of a
/// Kinect that is off by 7 degrees in a hall is accepted; with less than 2, frames of a RealSense are doubted.
const NOISE_SIGMAS: f64 = 2.0;

impl DepthNoise {
    /// That of the difference between two frames, each with this noise.
    #[must_use]
    pub fn of_difference(self) -> Self {
        Self { square_noise: self.square_noise * SQRT_2 }
    }

    /// The tolerance (m) for a surface at a depth (m): `least`, or what the noise explains.
    pub fn tolerance(self, least: f64, depth: f64) -> f64 {
        least.max(NOISE_SIGMAS * self.square_noise * depth * depth)
    }
}

/// How many points passed the test, and how many did not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FreeSpaceTally {
    /// Points on a surface that the sensor saw.
    pub agreeing: usize,
    /// Points that the sensor saw through.
    pub in_free_space: usize,
}

impl FreeSpaceTally {
    /// Counts a point. Hidden and unknown ones say nothing.
    pub fn add<S>(&mut self, test: &FreeSpaceTest<S>) {
        match test {
            FreeSpaceTest::Agreeing(_) => self.agreeing += 1,
            FreeSpaceTest::InFreeSpace => self.in_free_space += 1,
            FreeSpaceTest::Hidden | FreeSpaceTest::Unknown => {}
        }
    }

    /// Share of the visible points that agree, 0..=1; 0 when none is visible.
    pub fn agreement(&self) -> f64 {
        self.agreeing as f64 / (self.agreeing + self.in_free_space).max(1) as f64
    }
}

impl<S> FromIterator<FreeSpaceTest<S>> for FreeSpaceTally {
    fn from_iter<I: IntoIterator<Item = FreeSpaceTest<S>>>(tests: I) -> Self {
        let mut tally = Self::default();
        tests.into_iter().for_each(|test| tally.add(&test));
        tally
    }
}

impl std::ops::AddAssign for FreeSpaceTally {
    fn add_assign(&mut self, other: Self) {
        self.agreeing += other.agreeing;
        self.in_free_space += other.in_free_space;
    }
}
