//! When two clouds are the same.

use scanstitch::geometry::PointCloud;

/// The bits of the positions as precise as the file, with the origin in them, of normals and of colours: NaN equals itself. What
/// of a position is single precision may change where it lay halfway between two such numbers.
pub fn bits(cloud: &PointCloud) -> Vec<u64> {
    let bits = |value: f64| if value.is_nan() { u64::MAX } else { value.to_bits() };
    let positions = (0..cloud.len()).flat_map(|index| (cloud.point(index) + cloud.origin).to_array());
    let normals = cloud.normals.iter().flatten().flat_map(|n| n.as_dvec3().to_array());
    let colors = cloud.colors.iter().flatten().flatten().map(|&channel| u64::from(channel));
    positions.chain(normals).map(bits).chain(colors).collect()
}
