//! What a sensor saw all around it: the nearest range in every direction.
//!
//! A point that lies nearer than what was seen in its direction stands in free space: the motion that put it there is
//! contradicted, whatever the distances to the nearest points say. Directions are cells on the faces of a cube.

use nalgebra::Vector3;

use super::FreeSpaceTest;

/// Cells along an edge of a face: 2 degrees each, in the mean.
const CELLS_PER_EDGE: usize = 45;
/// Cells that must have seen something, of the nine around a direction (four at a corner of the cube), before a point can
/// contradict free space.
const MIN_SEEN: usize = 4;

/// The nearest range (m) in every cell; infinity where nothing was seen.
pub struct SphericalView {
    viewpoint: Vector3<f64>,
    nearest: Vec<f64>,
}

impl SphericalView {
    /// The view of `points` (m) from `viewpoint` (m, same frame).
    pub fn new(points: &[Vector3<f64>], viewpoint: Vector3<f64>) -> Self {
        let mut nearest = vec![f64::INFINITY; 6 * CELLS_PER_EDGE * CELLS_PER_EDGE];
        for point in points {
            let line = point - viewpoint;
            if let Some((face, u, v)) = cell(&line) {
                let range = &mut nearest[(face * CELLS_PER_EDGE + v) * CELLS_PER_EDGE + u];
                *range = range.min(line.norm());
            }
        }
        Self { viewpoint, nearest }
    }

    /// What the view says of a point, give or take `tolerance` (m).
    pub fn classify(&self, point: &Vector3<f64>, tolerance: f64) -> FreeSpaceTest {
        let line = point - self.viewpoint;
        let Some((face, u, v)) = cell(&line) else { return FreeSpaceTest::Unknown };
        let range = line.norm();
        let (mut seen, mut through) = (0, 0);
        for v in v.saturating_sub(1)..(v + 2).min(CELLS_PER_EDGE) {
            for u in u.saturating_sub(1)..(u + 2).min(CELLS_PER_EDGE) {
                let nearest = self.nearest[(face * CELLS_PER_EDGE + v) * CELLS_PER_EDGE + u];
                if (nearest - range).abs() <= tolerance {
                    return FreeSpaceTest::Agreeing(());
                }
                seen += usize::from(nearest.is_finite());
                through += usize::from(nearest.is_finite() && nearest > range + tolerance);
            }
        }
        if seen >= MIN_SEEN && through == seen {
            FreeSpaceTest::InFreeSpace
        } else if seen > 0 && through == 0 {
            FreeSpaceTest::Hidden
        } else {
            FreeSpaceTest::Unknown
        }
    }
}

/// The face of the cube that a line goes through, and where; `None` for a line without direction.
fn cell(line: &Vector3<f64>) -> Option<(usize, usize, usize)> {
    let axis = line.iamax();
    let depth = line[axis].abs();
    if !(depth > 0.0 && depth.is_finite()) {
        return None;
    }
    let face = 2 * axis + usize::from(line[axis] < 0.0);
    let place = |along: f64| (((along / depth + 1.0) * (CELLS_PER_EDGE as f64 / 2.0)) as usize).min(CELLS_PER_EDGE - 1);
    Some((face, place(line[(axis + 1) % 3]), place(line[(axis + 2) % 3])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sphere of 3 m around a viewpoint.
    fn sphere(center: Vector3<f64>) -> Vec<Vector3<f64>> {
        let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let direction = |i: u32| {
            let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / 40_000.0;
            let angle = golden * f64::from(i);
            Vector3::new(angle.cos() * (1.0 - y * y).sqrt(), y, angle.sin() * (1.0 - y * y).sqrt())
        };
        (0..40_000).map(|i| center + direction(i) * 3.0).collect()
    }

    #[test]
    fn points_inside_are_in_free_space_points_outside_hidden() {
        let center = Vector3::new(1.0, -2.0, 0.5);
        let view = SphericalView::new(&sphere(center), center);
        for point in sphere(Vector3::zeros()).iter().step_by(7) {
            let at = |share: f64| view.classify(&(center + point * share), 0.1);
            assert_eq!(at(1.0), FreeSpaceTest::Agreeing(()));
            assert_eq!(at(0.97), FreeSpaceTest::Agreeing(()));
            assert_eq!(at(0.9), FreeSpaceTest::InFreeSpace);
            assert_eq!(at(1.1), FreeSpaceTest::Hidden);
        }
        assert_eq!(view.classify(&center, 0.1), FreeSpaceTest::Unknown);
        let nothing = SphericalView::new(&[], center);
        assert_eq!(nothing.classify(&Vector3::zeros(), 0.1), FreeSpaceTest::Unknown);
    }
}
