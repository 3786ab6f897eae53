//! The hash table of voxels, which all modules but the stitched map share.
//!
//! It numbers the voxels in the order of their insertion; the caller keeps the data of each in a vector under that number. The
//! stitched map, [`map::voxel`](crate::map::voxel), instead hashes blocks of 8 x 8 x 8 voxels by one packed key, which it computes
//! in single precision for several points at a time.

use std::hash::{Hash, Hasher};

use nalgebra::Vector3;
use rustc_hash::FxHashMap;

/// Integer coordinates of a voxel along x, y and z.
pub(crate) type Voxel = [i32; 3];

/// The voxels inserted so far, each with its number.
#[derive(Debug, Clone)]
pub(crate) struct VoxelHash {
    /// Side of a voxel (m).
    voxel_size: f64,
    numbers: FxHashMap<Key, u32>,
}

/// A voxel, hashed as two whole words: as an array of three numbers it would be hashed byte by byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Key(Voxel);

impl Hash for Key {
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        let [x, y, z] = self.0.map(|coordinate| u64::from(coordinate as u32));
        state.write_u64(x << 32 | y);
        state.write_u64(z);
    }
}

/// Bound of a voxel's coordinates along each axis.
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
        // NaN fails the comparison.
        scaled.iter().all(|x| x.abs() < MAX_VOXELS).then(|| scaled.map(floor).into())
    }

    /// The number of a voxel; `None` where it has not been inserted.
    #[inline]
    pub(crate) fn number(&self, voxel: &Voxel) -> Option<u32> {
        self.numbers.get(&Key(*voxel)).copied()
    }

    /// Inserts a voxel and returns its number: that of a new one is the [`len`](Self::len) before.
    #[inline]
    pub(crate) fn insert(&mut self, voxel: Voxel) -> u32 {
        let next = self.numbers.len() as u32;
        *self.numbers.entry(Key(voxel)).or_insert(next)
    }

    /// Number of voxels.
    pub(crate) fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Removes all voxels.
    pub(crate) fn clear(&mut self) {
        self.numbers.clear();
    }
}

/// As `f64::floor`, which is a function call on targets without such an instruction.
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
