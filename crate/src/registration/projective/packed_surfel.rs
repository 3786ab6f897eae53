//! Surfels in single precision, as they are stored in large numbers.

use super::view_transform::double;
use crate::camera::Surfel;
use crate::geometry::algebra::single;

/// A surfel in single precision, which resolves micrometres, side by side in memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PackedSurfel {
    pub(super) point: [f32; 3],
    pub(super) sigma: f32,
    pub(super) normal: [f32; 3],
    /// A number of the caller's.
    pub tag: u32,
}

impl PackedSurfel {
    /// From a surfel and a number of the caller's.
    pub fn new(surfel: &Surfel, tag: u32) -> Self {
        Self { point: single(&surfel.point), sigma: surfel.sigma as f32, normal: single(&surfel.normal), tag }
    }

    /// As integers, for serialization.
    pub(crate) fn to_bits(self) -> [u32; 8] {
        let [x, y, z] = self.point.map(f32::to_bits);
        let [nx, ny, nz] = self.normal.map(f32::to_bits);
        [x, y, z, self.sigma.to_bits(), nx, ny, nz, self.tag]
    }

    /// The inverse of [`to_bits`](Self::to_bits).
    pub(crate) fn from_bits([x, y, z, sigma, nx, ny, nz, tag]: [u32; 8]) -> Self {
        let floats = |bits: [u32; 3]| bits.map(f32::from_bits);
        Self { point: floats([x, y, z]), sigma: f32::from_bits(sigma), normal: floats([nx, ny, nz]), tag }
    }

    /// In double precision.
    #[inline]
    pub fn surfel(&self) -> Surfel {
        Surfel { point: double(self.point), normal: double(self.normal), sigma: self.sigma.into() }
    }
}
