//! The kinds of search in a tree: each visits leaf after leaf and narrows its limit.

use super::{LEAF, Neighbor, smaller};

/// Numbers compared at once: those of a 128-bit vector, the width that WebAssembly has.
pub(crate) const LANES: usize = 4;

/// A kind of search. Subtrees beyond its limit are skipped.
pub(super) trait Search {
    /// Only points that come before this one are wanted.
    fn limit(&self) -> Neighbor;
    /// Considers the points of a leaf.
    fn visit(&mut self, sq_distances: &[f32; LEAF], indices: &[u32; LEAF]);
}

/// A search that considers one point after the other.
pub(super) trait PointByPoint {
    /// As of [`Search`].
    fn limit(&self) -> Neighbor;
    /// Considers a point that is no further than the limit was at the start of its leaf.
    fn take(&mut self, candidate: Neighbor);
}

impl<S: PointByPoint> Search for S {
    #[inline]
    fn limit(&self) -> Neighbor {
        PointByPoint::limit(self)
    }

    /// Few points of a leaf are near enough: the numbers of a vector are examined one by one only where one of them is.
    #[inline]
    fn visit(&mut self, sq_distances: &[f32; LEAF], indices: &[u32; LEAF]) {
        let max_sq_distance = PointByPoint::limit(self).sq_distance;
        for (distances, indices) in sq_distances.as_chunks::<LANES>().0.iter().zip(indices.as_chunks::<LANES>().0) {
            if distances.iter().copied().fold(f32::INFINITY, smaller) <= max_sq_distance {
                for (&sq_distance, &index) in distances.iter().zip(indices) {
                    if sq_distance <= max_sq_distance {
                        self.take(Neighbor { index, sq_distance });
                    }
                }
            }
        }
    }
}

/// The nearest point.
pub(super) struct Nearest {
    pub(super) best: Neighbor,
}

impl Search for Nearest {
    fn limit(&self) -> Neighbor {
        self.best
    }

    /// Finds the smallest distance of the leaf in SIMD vectors, then the smallest index at that distance.
    #[inline]
    fn visit(&mut self, sq_distances: &[f32; LEAF], indices: &[u32; LEAF]) {
        let mut smallest = [f32::INFINITY; LANES];
        for lanes in sq_distances.as_chunks::<LANES>().0 {
            for (smallest, &x) in smallest.iter_mut().zip(lanes) {
                *smallest = smaller(*smallest, x);
            }
        }
        let sq_distance = smallest.into_iter().fold(f32::INFINITY, smaller);
        if sq_distance <= self.best.sq_distance {
            let at_distance = sq_distances.iter().zip(indices);
            let index = at_distance
                .map(|(&x, &index)| if x == sq_distance { index } else { u32::MAX })
                .fold(u32::MAX, u32::min);
            let candidate = Neighbor { index, sq_distance };
            if candidate.comes_before(self.best) {
                self.best = candidate;
            }
        }
    }
}

/// The nearest of the points that `accept` admits.
pub(super) struct NearestWhere<F> {
    pub(super) best: Neighbor,
    pub(super) accept: F,
}

impl<F: FnMut(u32) -> bool> PointByPoint for NearestWhere<F> {
    fn limit(&self) -> Neighbor {
        self.best
    }

    #[inline]
    fn take(&mut self, candidate: Neighbor) {
        if candidate.comes_before(self.best) && (self.accept)(candidate.index) {
            self.best = candidate;
        }
    }
}

/// Whether there is a point within the limit.
pub(super) struct HasWithin {
    pub(super) limit: Neighbor,
    pub(super) found: bool,
}

impl Search for HasWithin {
    /// Once a point is found, the limit excludes all others.
    fn limit(&self) -> Neighbor {
        if self.found { Neighbor { index: 0, sq_distance: -1.0 } } else { self.limit }
    }

    #[inline]
    fn visit(&mut self, sq_distances: &[f32; LEAF], _indices: &[u32; LEAF]) {
        self.found |= sq_distances.iter().copied().fold(f32::INFINITY, smaller) <= self.limit.sq_distance;
    }
}

/// The nearest point by another distance than the Euclidean one.
pub(super) struct NearestBy<F> {
    pub(super) best: Neighbor,
    pub(super) sq_distance: F,
}

impl<F: FnMut(u32) -> f32> PointByPoint for NearestBy<F> {
    fn limit(&self) -> Neighbor {
        self.best
    }

    #[inline]
    fn take(&mut self, Neighbor { index, sq_distance }: Neighbor) {
        if sq_distance <= self.best.sq_distance {
            let candidate = Neighbor { index, sq_distance: (self.sq_distance)(index) };
            if candidate.comes_before(self.best) {
                self.best = candidate;
            }
        }
    }
}

/// The `k` nearest points. All that are near enough are collected, and cut down to the nearest whenever there are about twice as many: an
/// ordered list or a heap would have to be updated for each.
pub(super) struct KNearest<'a> {
    pub(super) k: usize,
    pub(super) limit: Neighbor,
    pub(super) found: &'a mut Vec<Neighbor>,
}

impl KNearest<'_> {
    /// Leaves the `k` nearest ones, in no order.
    pub(super) fn cut(&mut self) {
        if self.found.len() < self.k {
            return;
        }
        let (_, &mut furthest, _) = self.found.select_nth_unstable_by_key(self.k - 1, |neighbor| neighbor.key());
        self.found.truncate(self.k);
        self.limit = furthest;
    }
}

impl Search for KNearest<'_> {
    #[inline]
    fn limit(&self) -> Neighbor {
        self.limit
    }

    #[inline]
    fn visit(&mut self, sq_distances: &[f32; LEAF], indices: &[u32; LEAF]) {
        let max_sq_distance = self.limit.sq_distance;
        for (&sq_distance, &index) in sq_distances.iter().zip(indices) {
            if sq_distance <= max_sq_distance {
                self.found.push(Neighbor { index, sq_distance });
            }
        }
        if self.found.len() >= self.k + self.k.max(LEAF) {
            self.cut();
        }
    }
}

/// All points within the limit.
pub(super) struct Within<'a> {
    pub(super) limit: Neighbor,
    pub(super) found: &'a mut Vec<Neighbor>,
}

impl PointByPoint for Within<'_> {
    fn limit(&self) -> Neighbor {
        self.limit
    }

    #[inline]
    fn take(&mut self, candidate: Neighbor) {
        self.found.push(candidate);
    }
}
