//! Regions and lines of one image, clipped to the part that the other camera sees before they are projected.

use nalgebra::Vector3;
use serde::Serialize;

use super::clip::clip;
use super::transfer::PlaneTransfer;

/// A region after clipping. Edge i leads from vertex i to the one after it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct BevPolygon {
    /// Corners of the visible part in the image it was marked in (pixels).
    pub marked: Vec<[f64; 2]>,
    /// The same corners in the other image (pixels), all of them within its frame.
    pub projected: Vec<[f64; 2]>,
    /// For each corner the index of the corner that was given; null where an edge was cut.
    pub sources: Vec<Option<usize>>,
    /// For each edge whether it lies on a cut and is no edge of the region.
    pub cuts: Vec<bool>,
    /// Whether something was cut off.
    pub is_clipped: bool,
}

/// The visible part of a line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevSegment {
    /// Its ends in the image it was marked in (pixels).
    pub marked: [[f64; 2]; 2],
    /// Its ends in the other image (pixels).
    pub projected: [[f64; 2]; 2],
}

impl PlaneTransfer {
    /// The visible part of a region given by its corners (pixels of the first camera).
    pub fn polygon(&self, corners: &[[f64; 2]]) -> BevPolygon {
        let half_planes = self.half_planes();
        let inside = |&[u, v]: &[f64; 2]| half_planes.iter().all(|row| (row * Vector3::new(u, v, 1.0)).x >= 0.0);
        let is_clipped = !corners.iter().all(inside);
        let mut polygon = BevPolygon { is_clipped, ..BevPolygon::default() };
        let vertices = clip(corners, &half_planes);
        for (index, vertex) in vertices.iter().enumerate() {
            let next = &vertices[(index + 1) % vertices.len()];
            // Half-planes that meet in one corner leave it several times.
            if vertex.source.is_none() && vertices.len() > 1 && next.p == vertex.p {
                continue;
            }
            polygon.marked.push([vertex.p.x, vertex.p.y]);
            polygon.projected.push(self.pixel_within(&vertex.p));
            polygon.sources.push(vertex.source);
            polygon.cuts.push(vertex.is_cut);
        }
        if polygon.marked.len() < 3 {
            return BevPolygon { is_clipped, ..BevPolygon::default() };
        }
        polygon
    }

    /// The visible part of a straight line between two pixels of the first camera; `None` where nothing of it is.
    pub fn segment(&self, [from, to]: [[f64; 2]; 2]) -> Option<BevSegment> {
        let [p0, p1] = [from, to].map(|[u, v]| Vector3::new(u, v, 1.0));
        let (mut begin, mut end) = (0.0_f64, 1.0_f64);
        for half_plane in self.half_planes() {
            let (d0, d1) = ((half_plane * p0).x, (half_plane * p1).x);
            match (d0 >= 0.0, d1 >= 0.0) {
                (false, false) => return None,
                (true, false) => end = end.min(d0 / (d0 - d1)),
                (false, true) => begin = begin.max(d0 / (d0 - d1)),
                (true, true) => {}
            }
        }
        let ends = [begin, end].map(|share| p0 + (p1 - p0) * share);
        (begin <= end)
            .then(|| BevSegment { marked: ends.map(|p| [p.x, p.y]), projected: ends.map(|p| self.pixel_within(&p)) })
    }

    /// The projection of a pixel that was clipped to be visible; rounding must not carry it over the edge.
    fn pixel_within(&self, p: &Vector3<f64>) -> [f64; 2] {
        let [left, top, right, bottom] = self.projected.frame();
        let scaled = self.scaled_pixel(p);
        [(scaled.x / scaled.z).clamp(left, right), (scaled.y / scaled.z).clamp(top, bottom)]
    }
}
