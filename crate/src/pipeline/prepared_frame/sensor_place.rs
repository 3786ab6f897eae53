//! Whether the sensor that took a cloud can be at the origin of its coordinates.
//!
//! Clouds that were moved into the frame of a room or of a map show it: surfaces lie behind one another along the rays from the
//! origin, or the origin lies in the plane of a floor or a wall, which no sensor can see from there.

use glam::{DVec3, Vec3};
use nalgebra::{Matrix3, Vector3};

use crate::geometry::quantile::{OUTLIER_SHARE, quantile};
use crate::odometry::cloud::prepared::evenly_chosen;
use crate::preprocess::estimate_normals::{NORMAL_NEIGHBORS, estimate_clear_normals};
use crate::search::KdTree;

/// Points that are looked at.
const MAX_POINTS: usize = 4000;
/// A surface is seen edge-on where the sine of the angle between it and the ray is below this ...
const EDGE_ON: f64 = 0.03;
/// ... and a sensor sees at most this share of its points so: 3 % of the points of surfaces in all directions.
const MAX_EDGE_ON: f64 = 0.1;
/// A sensor is no further from what it sees than this many diagonals of it: the view would span less than 2 degrees.
const MAX_DISTANCE: f64 = 30.0;
/// Cells along each side of the view.
const CELLS: usize = 16;
/// Fewer points of a cell do not show a second surface.
const MIN_CELL_POINTS: usize = 6;
/// Where more than this share of the points lie in cells with several surfaces, the sensor would have seen through the first: of
/// real views it is a third at most, at the outlines of things.
const MAX_BEHIND: f64 = 0.6;

/// The box of a cloud without outliers (in the unit of the points).
pub(super) struct Extent {
    pub low: DVec3,
    pub high: DVec3,
}

impl Extent {
    #[inline(never)]
    pub(super) fn of(points: &[DVec3]) -> Self {
        let of_axis = |axis: usize| {
            let mut values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
            [OUTLIER_SHARE, 1.0 - OUTLIER_SHARE].map(|share| quantile(&mut values, share).unwrap_or(0.0))
        };
        let [x, y, z] = [0, 1, 2].map(of_axis);
        Self { low: DVec3::new(x[0], y[0], z[0]), high: DVec3::new(x[1], y[1], z[1]) }
    }

    pub(super) fn center(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    fn diagonal(&self) -> f64 {
        self.low.distance(self.high)
    }

    /// Distance of the origin; 0 inside.
    fn distance(&self) -> f64 {
        self.low.max(DVec3::ZERO).max(-self.high).length()
    }
}

/// Whether a sensor at the origin can have taken these points.
#[inline(never)]
pub(super) fn is_sensor_at_origin(points: &[DVec3], extent: &Extent) -> bool {
    let points: Vec<DVec3> = evenly_chosen(points.len(), MAX_POINTS).iter().map(|&point| points[point]).collect();
    let distance = extent.distance();
    distance <= MAX_DISTANCE * extent.diagonal()
        && edge_on_share(&points, extent.center()) <= MAX_EDGE_ON
        && (distance == 0.0 || share_behind(&points) <= MAX_BEHIND)
}

/// Share of the points on surfaces that are seen edge-on from the origin.
fn edge_on_share(points: &[DVec3], center: DVec3) -> f64 {
    let local: Vec<Vec3> = points.iter().map(|point| (*point - center).as_vec3()).collect();
    let tree = KdTree::build(bytemuck::cast_slice(&local));
    let normals =
        estimate_clear_normals(&local, &tree, &(0..local.len()).collect::<Vec<_>>(), NORMAL_NEIGHBORS, DVec3::ZERO);
    let sine = |(point, normal): (&DVec3, &Option<Vector3<f64>>)| {
        let ray = point.normalize_or_zero();
        normal.map(|normal| (normal.x * ray.x + normal.y * ray.y + normal.z * ray.z).abs())
    };
    let sines: Vec<f64> = points.iter().zip(&normals).filter_map(sine).collect();
    sines.iter().filter(|&&sine| sine < EDGE_ON).count() as f64 / sines.len().max(1) as f64
}

/// Share of the points in cells of the view in which more than one surface lies: where the ranges differ from those of a plane by
/// more than the cell is wide. Over the angles of a cell the inverse range of a plane is linear.
fn share_behind(points: &[DVec3]) -> f64 {
    let center = points.iter().copied().sum::<DVec3>().normalize_or_zero();
    let (side, up) = center.any_orthonormal_pair();
    let seen: Vec<[f64; 3]> = points
        .iter()
        .map(|p| {
            let ahead = p.dot(center);
            [p.dot(side).atan2(ahead), p.dot(up).atan2(ahead), p.length()]
        })
        .collect();
    let bounds = |axis: usize| {
        let fold = |(low, high): (f64, f64), view: &[f64; 3]| (low.min(view[axis]), high.max(view[axis]));
        seen.iter().fold((f64::INFINITY, f64::NEG_INFINITY), fold)
    };
    let (across, along) = (bounds(0), bounds(1));
    let width = ((across.1 - across.0).max(along.1 - along.0) / CELLS as f64).max(f64::MIN_POSITIVE);
    let mut cells = vec![Vec::new(); CELLS * CELLS];
    for [u, v, range] in seen {
        let place = |angle: f64, low: f64| (((angle - low) / width) as usize).min(CELLS - 1);
        cells[place(u, across.0) * CELLS + place(v, along.0)].push(Vector3::new(u, v, range));
    }
    let told = || cells.iter().filter(|cell| cell.len() >= MIN_CELL_POINTS);
    let behind = told().filter(|cell| is_behind(cell, width)).map(Vec::len).sum::<usize>();
    behind as f64 / told().map(Vec::len).sum::<usize>().max(1) as f64
}

/// Whether the points of a cell (two angles and a range each) are of more than one surface.
fn is_behind(cell: &[Vector3<f64>], width: f64) -> bool {
    let mean = cell.iter().sum::<Vector3<f64>>() / cell.len() as f64;
    let row = |p: &Vector3<f64>| Vector3::new(1.0, (p.x - mean.x) / width, (p.y - mean.y) / width);
    let inverse = |p: &Vector3<f64>| mean.z / p.z;
    let mut normal_matrix = Matrix3::identity() * 1e-9;
    let mut right = Vector3::zeros();
    for point in cell {
        let row = row(point);
        normal_matrix += row * row.transpose();
        right += row * inverse(point);
    }
    let Some(plane) = normal_matrix.try_inverse().map(|inverse| inverse * right) else { return false };
    let residual = |p: &Vector3<f64>| (inverse(p) - plane.dot(&row(p))).powi(2);
    let deviation = (cell.iter().map(residual).sum::<f64>() / cell.len() as f64).sqrt();
    deviation > 0.5 * width
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on the six sides of a room of 5 x 4 x 2.5 m whose lowest corner lies here.
    fn room(corner: DVec3) -> Vec<DVec3> {
        let size = DVec3::new(5.0, 4.0, 2.5);
        let point = |i: usize| {
            let [a, b] = [0.618_034, 0.754_878].map(|step: f64| (i as f64 * step).fract());
            let (axis, is_far) = (i % 3, (i / 3) % 2 == 1);
            let mut p = DVec3::new(a, b, a);
            p[(axis + 1) % 3] = b;
            p[(axis + 2) % 3] = a;
            p[axis] = f64::from(u8::from(is_far));
            corner + p * size
        };
        (0..MAX_POINTS).map(point).collect()
    }

    fn is_seen(points: &[DVec3]) -> bool {
        is_sensor_at_origin(points, &Extent::of(points))
    }

    #[test]
    fn a_sensor_stands_within_a_room_and_sees_no_surface_behind_another() {
        assert!(is_seen(&room(DVec3::new(-2.3, -1.7, -1.1))));
        let wall: Vec<DVec3> = room(DVec3::new(20.0, -2.0, -1.0)).into_iter().filter(|p| p.x < 20.01).collect();
        assert!(is_seen(&wall), "a facade, seen from 20 m away");
        for corner in [DVec3::ZERO, DVec3::new(20.0, 0.0, 0.0), DVec3::new(-60.0, 33.0, 7.0), DVec3::new(3.0, 3.0, 3.0)]
        {
            assert!(!is_seen(&room(corner)), "{corner}");
        }
        assert!(!is_seen(&room(DVec3::new(-2.5, -2.0, 0.0))), "the origin in the plane of the floor");
        assert!(!is_seen(&room(DVec3::new(5e5, 4e6, 0.0))));
    }
}
