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
        let Some(around) = self.around(point, tolerance) else { return FreeSpaceTest::Unknown };
        if around.agrees {
            return FreeSpaceTest::Agreeing(());
        }
        let (seen, through) = (around.seen.count_ones() as usize, around.through.count_ones() as usize);
        if seen >= MIN_SEEN && through == seen {
            FreeSpaceTest::InFreeSpace
        } else if seen > 0 && through == 0 {
            FreeSpaceTest::Hidden
        } else {
            FreeSpaceTest::Unknown
        }
    }

    /// Whether a point is in free space, and what is behind it was seen on all four sides of its direction: of a wall at a grazing angle, sparse
    /// points may all lie behind it.
    pub fn is_surrounded_by_free_space(&self, point: &Vector3<f64>, tolerance: f64) -> bool {
        let Some(around) = self.around(point, tolerance) else { return false };
        let is_on_all_sides = SIDES.iter().all(|side| around.seen & side != 0);
        !around.agrees && is_on_all_sides && around.through == around.seen
    }

    /// What the nine cells around the direction of a point saw; `None` for the viewpoint itself.
    fn around(&self, point: &Vector3<f64>, tolerance: f64) -> Option<Around> {
        let line = point - self.viewpoint;
        let ((face, u, v), range) = (cell(&line)?, line.norm());
        let mut around = Around::default();
        for (row, v) in beside(v).filter(|(_, v)| *v < CELLS_PER_EDGE) {
            for (column, u) in beside(u).filter(|(_, u)| *u < CELLS_PER_EDGE) {
                let nearest = self.nearest[(face * CELLS_PER_EDGE + v) * CELLS_PER_EDGE + u];
                around.agrees |= (nearest - range).abs() <= tolerance;
                let bit = 1 << (3 * row + column);
                around.seen |= if nearest.is_finite() { bit } else { 0 };
                around.through |= if nearest.is_finite() && nearest > range + tolerance { bit } else { 0 };
            }
        }
        Some(around)
    }
}

/// A coordinate and its neighbours, numbered from 0; beyond the edge of a face where that is no cell.
fn beside(place: usize) -> impl Iterator<Item = (usize, usize)> {
    [place.wrapping_sub(1), place, place + 1].into_iter().enumerate()
}

/// The nine cells around a direction, a bit each, row by row.
#[derive(Default)]
struct Around {
    /// Whether one saw something at the range of the point.
    agrees: bool,
    /// Those that saw something, ...
    seen: u16,
    /// ... and of these those that saw it behind the point.
    through: u16,
}

/// The cells on each side of the middle one.
const SIDES: [u16; 4] = [0b000_000_111, 0b111_000_000, 0b001_001_001, 0b100_100_100];

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
        // Of points on one side nothing is known of the other.
        let is_seen_through =
            |view: &SphericalView, x| view.is_surrounded_by_free_space(&(center + Vector3::new(x, 0.01, 0.01)), 0.1);
        assert!(is_seen_through(&view, 2.0) && !is_seen_through(&view, 3.0) && !is_seen_through(&view, 4.0));
        let half: Vec<Vector3<f64>> = sphere(center).into_iter().filter(|point| point.y > center.y).collect();
        let half = SphericalView::new(&half, center);
        assert_eq!(half.classify(&(center + Vector3::new(2.0, 0.01, 0.01)), 0.1), FreeSpaceTest::InFreeSpace);
        assert!(!is_seen_through(&half, 2.0));
        let nothing = SphericalView::new(&[], center);
        assert_eq!(nothing.classify(&Vector3::zeros(), 0.1), FreeSpaceTest::Unknown);
    }
}
