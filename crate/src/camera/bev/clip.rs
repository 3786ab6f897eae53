//! Cutting a polygon to half-planes.

use nalgebra::{RowVector3, Vector3};

/// Holds the pixels p = (u, v, 1) whose product with it is not negative.
pub(crate) type HalfPlane = RowVector3<f64>;

/// A corner on the way through the half-planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Vertex {
    /// (u, v, 1).
    pub p: Vector3<f64>,
    /// The index of the corner that was given; `None` where an edge was cut.
    pub source: Option<usize>,
    /// Whether the edge that leaves it lies on a cut.
    pub is_cut: bool,
}

/// The part of a region that lies in all half-planes: Sutherland and Hodgman (1974). A region that is cut into several
/// parts stays one polygon, whose parts are joined by edges along the cuts; they are marked as such.
pub(super) fn clip(corners: &[[f64; 2]], half_planes: &[HalfPlane]) -> Vec<Vertex> {
    let given = corners.iter().enumerate();
    let mut polygon: Vec<Vertex> = given
        .map(|(index, &[u, v])| Vertex { p: Vector3::new(u, v, 1.0), source: Some(index), is_cut: false })
        .collect();
    for half_plane in half_planes {
        polygon = clip_by(&polygon, half_plane);
    }
    polygon
}

fn clip_by(polygon: &[Vertex], half_plane: &HalfPlane) -> Vec<Vertex> {
    let mut kept = Vec::with_capacity(polygon.len() + 2);
    for (index, &from) in polygon.iter().enumerate() {
        let to = polygon[(index + 1) % polygon.len()];
        let (d0, d1) = ((half_plane * from.p).x, (half_plane * to.p).x);
        if d0 >= 0.0 {
            kept.push(from);
        }
        if (d0 >= 0.0) == (d1 >= 0.0) {
            continue;
        }
        let p = from.p + (to.p - from.p) * (d0 / (d0 - d1));
        // Leaving, the border is followed until the region comes back in.
        kept.push(Vertex { p, source: None, is_cut: d0 >= 0.0 || from.is_cut });
    }
    kept
}
