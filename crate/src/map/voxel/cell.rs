//! The sums of a voxel, packed into half a cache line, since cache misses take most of the time of stitching.

use glam::{DVec3, Vec3};

use super::grid::THIRD_BITS;

/// Most points of a voxel whose normals are averaged, which keeps the sums from overflowing; further ones would make no
/// visible difference.
const MAX_SUMMED_NORMALS: u32 = 1 << (THIRD_BITS - BITS);
/// Bits of each coordinate that is added.
const BITS: u32 = 10;
/// Bits of each of the three sums of colours; the number of coloured points is in the bits above them.
const COLOR_BITS: u32 = 18;
/// Most points of a voxel whose colours are averaged, for the same reason: neither their number nor a sum overflows.
const MAX_SUMMED_COLORS: u64 = 1000;
/// Integer that stands for a normal's coordinate of 1, with room for rounded normals that are slightly longer.
pub(super) const NORMAL_SCALE: f32 = 500.0;
/// Offset of a normal's coordinate, which makes all integers positive.
pub(super) const NORMAL_ZERO: u32 = 1 << (BITS - 1);

/// Sums over the points in a voxel.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(32))]
pub(super) struct Voxel {
    /// Sum of the positions relative to the voxel's corner, in voxel sizes.
    offset: Vec3,
    pub count: u32,
    /// Sum of the first [`MAX_SUMMED_NORMALS`] normals, [`packed`].
    normal: u64,
    /// Sum of the first [`MAX_SUMMED_COLORS`] colours and their number, [`packed_color`].
    color: u64,
}

impl Voxel {
    #[inline]
    pub(super) fn add(&mut self, offset: Vec3, normal: u64, color: u64) {
        if self.count < MAX_SUMMED_NORMALS {
            self.normal += normal;
        }
        if num_colors(self.color) < MAX_SUMMED_COLORS {
            self.color += color;
        }
        self.offset += offset;
        self.count += 1;
    }

    /// The mean position (m) in the voxel at `corner`.
    pub(super) fn position(&self, corner: [i32; 3], voxel_size: f64) -> Vec3 {
        let offset = self.offset * (1.0 / self.count as f32);
        ((DVec3::from(corner.map(f64::from)) + offset.as_dvec3()) * voxel_size).as_vec3()
    }

    /// The direction of the mean normal; zero where there is none.
    pub(super) fn normal(&self) -> Vec3 {
        let zero = NORMAL_ZERO * self.count.min(MAX_SUMMED_NORMALS);
        Vec3::from(unpacked(self.normal).map(|sum| (sum.cast_signed() - zero.cast_signed()) as f32)).normalize_or_zero()
    }

    /// The mean colour of the points that have one; black where none has.
    pub(super) fn color(&self) -> [u8; 3] {
        let count = num_colors(self.color);
        if count == 0 {
            return [0; 3];
        }
        let share = 1.0 / count as f32;
        let mask = (1 << COLOR_BITS) - 1;
        // Converted as signed integers: unsigned conversions take more instructions.
        [0, 1, 2].map(|axis| {
            let sum = ((self.color >> (axis * COLOR_BITS)) & mask) as i32;
            (sum as f32 * share + 0.5) as i32 as u8
        })
    }
}

/// One colour (red, green, blue) and the number 1, packed into one number; up to [`MAX_SUMMED_COLORS`] of them may be added. A
/// point without colour adds 0.
#[inline]
pub(super) fn packed_color(color: [u8; 3]) -> u64 {
    let [red, green, blue] = color.map(u64::from);
    1 << (3 * COLOR_BITS) | red | green << COLOR_BITS | blue << (2 * COLOR_BITS)
}

/// The number of colours in a sum of [`packed_color`].
#[inline]
fn num_colors(sum: u64) -> u64 {
    sum >> (3 * COLOR_BITS)
}

/// Three numbers of [`BITS`] bits packed into one; up to [`MAX_SUMMED_NORMALS`] of them may be added.
#[inline]
pub(super) fn packed(numbers: [u32; 3]) -> u64 {
    let [x, y, z] = numbers.map(|number| number & ((1 << BITS) - 1));
    u64::from(x) | u64::from(y) << THIRD_BITS | u64::from(z) << (2 * THIRD_BITS)
}

#[inline]
fn unpacked(sums: u64) -> [u32; 3] {
    let mask = (1 << THIRD_BITS) - 1;
    [sums, sums >> THIRD_BITS, sums >> (2 * THIRD_BITS)].map(|sum| (sum & mask) as u32)
}
