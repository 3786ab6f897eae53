//! The hash table of voxels, which all modules but the stitched map share.
//!
//! It numbers the voxels in the order of their insertion; the caller keeps the data of each in a vector under that number. The
//! stitched map, [`map::voxel`](crate::map::voxel), instead hashes blocks of 8 x 8 x 8 voxels by one packed key, which it computes
//! in single precision for several points at a time.

use nalgebra::Vector3;

/// Integer coordinates of a voxel along x, y and z.
pub(crate) type Voxel = [i32; 3];

/// The voxels inserted so far, each with its number.
///
/// A table with linear probing (Knuth, "The art of computer programming", volume 3, section 6.4, algorithm L), at most half full: the standard
/// library's compares groups of entries by instructions that WebAssembly lacks.
#[derive(Debug, Clone)]
pub(crate) struct VoxelHash {
    /// Side of a voxel (m).
    voxel_size: f64,
    /// As many as a power of two, or none.
    entries: Vec<Entry>,
    len: u32,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    voxel: Voxel,
    number: u32,
}

/// An entry without a voxel.
const EMPTY: Entry = Entry { voxel: [0; 3], number: u32::MAX };
/// Entries of the smallest table.
const MIN_ENTRIES: usize = 16;
/// 2^64 over the golden ratio, which spreads products evenly over their upper bits (Knuth, section 6.4, "Fibonacci hashing").
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// Bound of a voxel's coordinates along each axis.
const MAX_VOXELS: f64 = 1e9;

impl VoxelHash {
    /// Without voxels; `voxel_size` (m) is positive.
    pub(crate) fn new(voxel_size: f64) -> Self {
        Self { voxel_size, entries: Vec::new(), len: 0 }
    }

    /// The same, with room for so many voxels.
    pub(crate) fn with_capacity(voxel_size: f64, capacity: usize) -> Self {
        let size = (2 * capacity).next_power_of_two().max(MIN_ENTRIES);
        Self { voxel_size, entries: vec![EMPTY; size], len: 0 }
    }

    /// Side of a voxel (m).
    pub(crate) fn voxel_size(&self) -> f64 {
        self.voxel_size
    }

    /// The voxel that a point (m) lies in; `None` where it is not finite or too far away.
    #[inline]
    pub(crate) fn voxel(&self, point: &Vector3<f64>) -> Option<Voxel> {
        let coordinate = |x: f64| {
            let scaled = x / self.voxel_size;
            // NaN fails the comparison.
            (scaled.abs() < MAX_VOXELS).then(|| floor(scaled))
        };
        Some([coordinate(point.x)?, coordinate(point.y)?, coordinate(point.z)?])
    }

    /// The number of a voxel; `None` where it has not been inserted.
    #[inline]
    pub(crate) fn number(&self, voxel: &Voxel) -> Option<u32> {
        let entry = self.entries.get(self.place(voxel)?)?;
        (entry.number != EMPTY.number).then_some(entry.number)
    }

    /// Inserts a voxel and returns its number: that of a new one is the [`len`](Self::len) before.
    #[inline]
    pub(crate) fn insert(&mut self, voxel: Voxel) -> u32 {
        if 2 * (self.len() + 1) > self.entries.len() {
            self.grow();
        }
        let Some(place) = self.place(&voxel) else { return EMPTY.number };
        let entry = &mut self.entries[place];
        if entry.number == EMPTY.number {
            *entry = Entry { voxel, number: self.len };
            self.len += 1;
        }
        entry.number
    }

    /// Number of voxels.
    pub(crate) fn len(&self) -> usize {
        self.len as usize
    }

    /// Removes all voxels.
    pub(crate) fn clear(&mut self) {
        (self.entries, self.len) = (Vec::new(), 0);
    }

    /// Where the entry of a voxel is, or the empty one that it would take; `None` without entries.
    #[inline]
    fn place(&self, voxel: &Voxel) -> Option<usize> {
        let mask = self.entries.len().checked_sub(1)?;
        let (x, y, z) = (u64::from(voxel[0] as u32), u64::from(voxel[1] as u32), u64::from(voxel[2] as u32));
        let mixed = ((x << 32 | y).wrapping_mul(GOLDEN).rotate_left(32) ^ z).wrapping_mul(GOLDEN);
        let mut place = (mixed >> 32) as usize & mask;
        loop {
            let entry = &self.entries[place];
            if entry.voxel == *voxel || entry.number == EMPTY.number {
                // An empty entry looks like that of the voxel at the origin.
                return Some(place);
            }
            place = (place + 1) & mask;
        }
    }

    /// Doubles the table.
    #[cold]
    fn grow(&mut self) {
        let size = (2 * self.entries.len()).max(MIN_ENTRIES);
        let old = std::mem::replace(&mut self.entries, vec![EMPTY; size]);
        for entry in old.into_iter().filter(|entry| entry.number != EMPTY.number) {
            if let Some(place) = self.place(&entry.voxel) {
                self.entries[place] = entry;
            }
        }
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
        assert_eq!((hash.len(), hash.number(&[0, 0, 0])), (0, None));
    }

    #[test]
    fn rounding_down_is_that_of_the_standard_library() {
        for x in [0.0, -0.0, 0.3, -0.3, 1.0, -1.0, 2.999_999_999, -2.000_000_001, 9.9e8, -9.9e8] {
            assert_eq!(floor(x), f64::floor(x) as i32, "{x}");
        }
    }
}
