//! Voxels by their place in space: the one hash table of all that sorts points into cubes.
//!
//! It numbers the cubes that hold something in the order in which they are first met; what is kept for each lies in a vector of
//! the caller's, under that number. (The map that is shown, [`map::voxel`](crate::map::voxel), hashes blocks of 8 x 8 x 8 voxels by
//! one packed number instead, and finds them from single precision, eight points at a time.)

use nalgebra::Vector3;
use rustc_hash::FxHashMap;

/// A cube of space, counted along x, y and z from the origin.
pub(crate) type Voxel = [i32; 3];

/// Numbers of the voxels that hold something.
#[derive(Debug, Clone)]
pub(crate) struct VoxelHash {
    /// Side of a voxel (m).
    voxel_size: f64,
    numbers: FxHashMap<Voxel, u32>,
}

/// Voxels further from the origin than this, counted along an axis, are not told apart.
const MAX_VOXELS: f64 = 1e9;

impl VoxelHash {
    /// Without voxels; `voxel_size` (m) is positive.
    pub(crate) fn new(voxel_size: f64) -> Self {
        Self { voxel_size, numbers: FxHashMap::default() }
    }

    /// Side of a voxel (m).
    pub(crate) fn voxel_size(&self) -> f64 {
        self.voxel_size
    }

    /// The voxel that a point (m) lies in; `None` where it is not finite or too far away.
    #[inline]
    pub(crate) fn voxel(&self, point: &Vector3<f64>) -> Option<Voxel> {
        let scaled = point / self.voxel_size;
        // Not a number fails the comparison.
        scaled.iter().all(|x| x.abs() < MAX_VOXELS).then(|| scaled.map(floor).into())
    }

    /// The number of a voxel that holds something.
    #[inline]
    pub(crate) fn number(&self, voxel: &Voxel) -> Option<u32> {
        self.numbers.get(voxel).copied()
    }

    /// The number of a voxel, which is [`len`](Self::len) as it was before where the voxel is new.
    #[inline]
    pub(crate) fn insert(&mut self, voxel: Voxel) -> u32 {
        let next = self.numbers.len() as u32;
        *self.numbers.entry(voxel).or_insert(next)
    }

    /// Number of voxels.
    pub(crate) fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Forgets all voxels.
    pub(crate) fn clear(&mut self) {
        self.numbers.clear();
    }
}

/// As `f64::floor`, which is a call where the processor cannot be asked for it.
#[inline]
fn floor(x: f64) -> i32 {
    let whole = x as i32;
    whole - i32::from(f64::from(whole) > x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_are_numbered_in_the_order_they_are_met() {
        let mut hash = VoxelHash::new(0.5);
        let voxel = |x, y, z| hash.voxel(&Vector3::new(x, y, z));
        assert_eq!(voxel(0.1, -0.1, 1.0), Some([0, -1, 2]));
        assert_eq!(voxel(-0.5, -1e-12, 0.0), Some([-1, -1, 0]));
        assert_eq!((voxel(f64::NAN, 0.0, 0.0), voxel(0.0, 1e30, 0.0), voxel(0.0, 0.0, -6e8)), (None, None, None));
        assert_eq!([[0, 0, 0], [5, 0, 0], [0, 0, 0], [0, 5, 0]].map(|voxel| hash.insert(voxel)), [0, 1, 0, 2]);
        assert_eq!((hash.len(), hash.number(&[5, 0, 0]), hash.number(&[9, 0, 0])), (3, Some(1), None));
        hash.clear();
        assert!(hash.numbers.is_empty());
    }

    #[test]
    fn rounding_down_is_that_of_the_standard_library() {
        for x in [0.0, -0.0, 0.3, -0.3, 1.0, -1.0, 2.999_999_999, -2.000_000_001, 9.9e8, -9.9e8] {
            assert_eq!(floor(x), f64::floor(x) as i32, "{x}");
        }
    }
}
