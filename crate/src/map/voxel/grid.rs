//! Integer coordinates of voxels and of blocks of voxels.

use glam::{DVec3, Mat3A, Vec3, Vec3A};

use crate::geometry::Pose3;

/// Voxels along a side of a block.
pub(super) const BLOCK: i32 = 1 << BLOCK_BITS;
/// Bits of a voxel's place along a side of its block.
const BLOCK_BITS: i32 = 3;
/// Voxels of a block.
pub(super) const BLOCK_VOXELS: usize = (BLOCK * BLOCK * BLOCK) as usize;
/// Bits of each of three numbers that are packed into 64. Those of a key, for each axis: voxels of a millimetre cover a kilometre from the
/// origin.
pub(super) const THIRD_BITS: u32 = u64::BITS / 3;
/// Largest coordinate of a voxel along an axis.
pub(super) const MAX_COORDINATE: f32 = ((1 << (THIRD_BITS - 1)) - 1) as f32;

/// Maps the sensor frame to voxels of the world, in single precision: micrometres in a house, millimetres in a town.
pub(super) struct Grid {
    /// Rotation to the world frame, scaled to voxel sizes.
    pub R: Mat3A,
    pub t: Vec3A,
    /// Smallest y (voxel sizes), which points down, of a point that is not too high.
    pub least_y: f32,
}

impl Grid {
    pub(super) fn new(voxel_size: f64, T_world_sensor: &Pose3, max_height: f64) -> Self {
        let (inverse, t) = (1.0 / voxel_size, T_world_sensor.translation.vector);
        Self {
            R: rotation(T_world_sensor) * inverse as f32,
            t: (DVec3::new(t.x, t.y, t.z) * inverse).as_vec3a(),
            least_y: (-max_height * inverse) as f32,
        }
    }

    /// The voxel of a position (m, sensor frame); `None` where it is too high, not finite or too far away.
    #[inline]
    pub(super) fn corner(&self, position: Vec3) -> Option<[i32; 3]> {
        let scaled = self.R * Vec3A::from(position) + self.t;
        // NaN fails the comparison.
        let is_inside =
            (scaled.cmpge(Vec3A::splat(-MAX_COORDINATE)) & scaled.cmple(Vec3A::splat(MAX_COORDINATE))).all();
        (is_inside && scaled.y >= self.least_y).then(|| scaled.floor().to_array().map(|cell| cell as i32))
    }
}

/// The key of the block that a voxel lies in.
#[inline]
pub(super) fn block_key(corner: [i32; 3]) -> u64 {
    pack(corner.map(|cell| cell >> BLOCK_BITS))
}

/// Index of a voxel in its block, such that neighbours along all axes are near each other: 4 x 2 x 2 voxels share a cache line,
/// for every direction of a surface.
#[inline]
pub(super) fn slot(corner: [i32; 3]) -> u32 {
    let [x, y, z] = corner.map(|cell| (cell & (BLOCK - 1)).cast_unsigned());
    let line = ((z >> 1) << 3) | ((y >> 1) << 1) | (x >> 2);
    (line << 4) | ((z & 1) << 3) | ((y & 1) << 2) | (x & 3)
}

#[inline]
pub(super) fn pack(corner: [i32; 3]) -> u64 {
    let [x, y, z] = corner.map(|cell| u64::from((cell + (1 << (THIRD_BITS - 1))) as u32));
    x | y << THIRD_BITS | z << (2 * THIRD_BITS)
}

pub(super) fn unpack(key: u64) -> [i32; 3] {
    let mask = (1 << THIRD_BITS) - 1;
    [key, key >> THIRD_BITS, key >> (2 * THIRD_BITS)].map(|part| (part & mask) as i32 - (1 << (THIRD_BITS - 1)))
}

pub(super) fn rotation(T: &Pose3) -> Mat3A {
    let R = T.rotation.to_rotation_matrix();
    Mat3A::from_cols_array(&R.into_inner().as_slice().try_into().map_or([0.0; 9], |R: [f64; 9]| R.map(|x| x as f32)))
}
