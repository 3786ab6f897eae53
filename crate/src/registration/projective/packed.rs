//! Pieces of surface as they are kept in large numbers.

use super::eye::{double, single};
use crate::camera::Surfel;

/// A piece of surface in single precision, which tells micrometres apart, side by side in memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PackedSurfel {
    pub(super) point: [f32; 3],
    pub(super) deviation: f32,
    pub(super) normal: [f32; 3],
    /// A number of the caller's.
    pub tag: u32,
}

impl PackedSurfel {
    /// A piece with a number of the caller's.
    pub fn new(surfel: &Surfel, tag: u32) -> Self {
        Self { point: single(&surfel.point), deviation: surfel.deviation as f32, normal: single(&surfel.normal), tag }
    }

    /// As it is worked with.
    #[inline]
    pub fn surfel(&self) -> Surfel {
        Surfel { point: double(self.point), normal: double(self.normal), deviation: self.deviation.into() }
    }
}
