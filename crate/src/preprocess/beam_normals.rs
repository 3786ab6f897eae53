//! Normals of a planar scan from neighbouring beams.
//!
//! In three dimensions a planar scan has no usable normals: all its points lie in one plane, whose normal is not that of any
//! wall. In the plane the order of the beams gives the neighbours of each point without a search.

use nalgebra::Vector2;

use crate::search::order::ascending;

/// Neighbours used on either side.
const HALF_WINDOW: usize = 3;
/// Beams that a normal is estimated from.
pub(crate) const NUM_BEAMS: usize = 2 * HALF_WINDOW + 1;
/// Distance of two consecutive returns below which they lie on one surface (m), if larger than [`MAX_GAP_RATIO`] of the range.
const MIN_GAP: f64 = 0.1;
/// Distance of two consecutive returns below which they lie on one surface, as a share of the range: with 1 degree between
/// beams, 0.15 is a wall at a grazing angle of 6.6 degrees.
const MAX_GAP_RATIO: f64 = 0.15;
/// Smallest ratio of length to thickness of points that form a line and therefore have a normal.
const MIN_ASPECT: f64 = 4.0;

/// Unit normals facing the sensor at the origin; `None` where too few neighbours lie on one line.
///
/// `points` (m) are in the sensor frame, in any order; neighbours are found by bearing. The line is the first principal
/// axis of up to seven consecutive points without a gap.
pub(crate) fn beam_normals(points: &[Vector2<f64>]) -> Vec<Option<Vector2<f64>>> {
    let by_bearing = ascending(points.iter().map(bearing));
    let beams: Vec<Vector2<f64>> = by_bearing.iter().map(|&index| points[index]).collect();

    let mut normals = vec![None; points.len()];
    for (beam, &index) in by_bearing.iter().enumerate() {
        normals[index] = line_normal(&beams[run_around(&beams, beam)]).map(|n| facing_sensor(n, &points[index]));
    }
    normals
}

/// Direction from the sensor to a return (rad).
pub(super) fn bearing(point: &Vector2<f64>) -> f64 {
    point.y.atan2(point.x)
}

/// Whether two returns of consecutive beams (m, sensor frame) lie on one surface.
pub(crate) fn is_one_surface(a: &Vector2<f64>, b: &Vector2<f64>) -> bool {
    (a - b).norm() <= MIN_GAP.max(MAX_GAP_RATIO * a.norm().min(b.norm()))
}

/// The range of beams around `beam` that are connected to it without a gap.
fn run_around(beams: &[Vector2<f64>], beam: usize) -> std::ops::Range<usize> {
    let joined = |a: usize, b: usize| is_one_surface(&beams[a], &beams[b]);
    let mut start = beam;
    while start > 0 && beam - start < HALF_WINDOW && joined(start - 1, start) {
        start -= 1;
    }
    let mut end = beam + 1;
    while end < beams.len() && end - beam <= HALF_WINDOW && joined(end - 1, end) {
        end += 1;
    }
    start..end
}

/// Direction of least variance, when the points form a line.
fn line_normal(points: &[Vector2<f64>]) -> Option<Vector2<f64>> {
    if points.len() < 3 {
        return None;
    }
    let mean = points.iter().sum::<Vector2<f64>>() / points.len() as f64;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for point in points {
        let d = point - mean;
        xx += d.x * d.x;
        xy += d.x * d.y;
        yy += d.y * d.y;
    }
    // Eigenvalues of the symmetric 2 x 2 scatter matrix: half its trace plus and minus a radius (Mohr's circle).
    let radius = ((xx - yy) / 2.0).hypot(xy);
    let middle = f64::midpoint(xx, yy);
    let (large, small) = (middle + radius, middle - radius);
    if large <= 0.0 || small.max(0.0) * MIN_ASPECT * MIN_ASPECT > large {
        return None;
    }
    let angle = (2.0 * xy).atan2(xx - yy) / 2.0; // of the first principal axis
    Some(Vector2::new(-angle.sin(), angle.cos()))
}

fn facing_sensor(normal: Vector2<f64>, point: &Vector2<f64>) -> Vector2<f64> {
    if normal.dot(point) > 0.0 { -normal } else { normal }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A corner of two walls, 1 m to the right (x = 1) and 2 m ahead (y = 2), a beam a degree.
    fn corner() -> Vec<Vector2<f64>> {
        let beam = |degree: u32| {
            let (sin, cos) = f64::from(degree).to_radians().sin_cos();
            Vector2::new(cos, sin) * (1.0 / cos).min(2.0 / sin)
        };
        (1..90).map(beam).collect()
    }

    #[test]
    fn normals_are_those_of_the_walls_and_face_the_sensor() {
        let points = corner();
        for (point, normal) in points.iter().zip(beam_normals(&points)) {
            let wall = if point.x > 1.0 - 1e-9 { -Vector2::x() } else { -Vector2::y() };
            match normal {
                Some(normal) => {
                    assert!((normal.norm() - 1.0).abs() < 1e-12 && normal.dot(point) < 0.0);
                    let from_corner = (point - Vector2::new(1.0, 2.0)).norm();
                    assert!(from_corner < 0.3 || normal.dot(&wall) > 0.999_999, "{point} {normal}");
                }
                None => assert!((point - Vector2::new(1.0, 2.0)).norm() < 0.3, "{point}"),
            }
        }
    }

    #[test]
    fn the_order_of_the_points_does_not_matter() {
        let points = corner();
        let normals = beam_normals(&points);
        let shuffled: Vec<usize> = (0..points.len()).map(|i| i * 31 % points.len()).collect();
        let again = beam_normals(&shuffled.iter().map(|&i| points[i]).collect::<Vec<_>>());
        for (&original, normal) in shuffled.iter().zip(again) {
            assert_eq!(normals[original], normal);
        }
    }

    #[test]
    fn a_post_in_front_of_a_wall_takes_no_neighbours_from_it() {
        let mut points = corner();
        points[20] *= 0.5;
        let normals = beam_normals(&points);
        assert_eq!(normals[20], None);
        assert!(normals[18].unwrap().dot(&-Vector2::x()) > 0.999_999);
        assert_eq!(beam_normals(&[]), []);
        assert_eq!(beam_normals(&[Vector2::x(); 2]), [None; 2]);
        assert_eq!(beam_normals(&[Vector2::x(); 9]), [None; 9]);
    }
}
