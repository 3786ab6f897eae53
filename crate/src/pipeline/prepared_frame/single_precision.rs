//! Coordinates of a map that were saved in single precision: rounded so much that their surfaces are gone.

use crate::error::{Error, Result};
use crate::geometry::PointCloud;

/// Rounding up to this share of the size of a cloud leaves its surfaces: voxels are about as large.
const MOST_ROUNDING: f64 = 0.01;

/// Refuses a cloud whose coordinates are those of single precision and rounded by too much of half its size (in its unit).
pub(super) fn refuse_rounded(cloud: &PointCloud, size: f64) -> Result<()> {
    let coordinates =
        || (0..cloud.len()).flat_map(|index| cloud.absolute_point(index).to_array()).filter(|c| c.is_finite());
    let largest = coordinates().fold(0.0, |most: f64, c| most.max(c.abs()));
    let rounding = largest * f64::from(f32::EPSILON);
    let are_single = || coordinates().all(|c| f64::from(c as f32) == c);
    if rounding <= MOST_ROUNDING * size || !are_single() {
        return Ok(());
    }
    let problem = format!(
        "The coordinates reach {largest:.0} in single precision, which rounds them to {rounding:.2}: the surfaces are lost"
    );
    Err(Error::whole(problem, "Export them again as doubles, or less an offset that all clouds share"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_coordinates_in_single_precision_are_refused_unless_the_scene_is_large() {
        let cloud = |origin: f64, is_single: bool| {
            let point = |i: u16| {
                let exact = origin + f64::from(i) * 0.011;
                let x = if is_single { f64::from(exact as f32) } else { exact };
                glam::Vec3::new((x - origin) as f32, 1.0, 2.0)
            };
            let origin = glam::DVec3::new(origin, 0.0, 0.0);
            PointCloud { positions: (0..500).map(point).collect(), origin, ..PointCloud::default() }
        };
        assert!(refuse_rounded(&cloud(4e6, true), 2.5).unwrap_err().problem.contains("rounds them to 0.4"));
        assert!(refuse_rounded(&cloud(4e6, true), 100.0).is_ok());
        assert!(refuse_rounded(&cloud(4e6, false), 2.5).is_ok() && refuse_rounded(&cloud(60.0, true), 2.5).is_ok());
    }
}
