//! A static k-d tree for points in the plane and in space.
//!
//! Bucketed leaves and splits at the median of the widest axis follow Friedman, Bentley and Finkel, "An algorithm for finding
//! best matches in logarithmic expected time" (1977); the bound of a subtree is updated axis by axis as in Arya and Mount,
//! "Algorithms for fast vector quantization" (1993).
//!
//! Results do not depend on the layout of the tree: among equal distances the smallest index is returned, so the same points
//! give the same neighbours on every platform. Bounds and distances are sums of corresponding terms in the same order, and
//! rounding is monotonic, so a bound never exceeds the computed distance of a point below it and the search is exact.
//!
//! Kept beside kiddo 6.3 (`npm run bench -- neighbours_`; kiddo's time over ours, natively / in WebAssembly under Node):
//!
//! | | build | nearest | within three spacings |
//! |---|---|---|---|
//! | planar scans, 1,620 points | 0.7 / 0.7 | 1.0 to 1.4 / 1.0 to 1.4 | 1.4 to 2.4 / 1.3 to 1.7 |
//! | lidar cloud, 70,000 points | 0.8 / 0.4 | 4.7 / 5.2 | 1.1 / 0.6 |
//! | surfels of a depth image, 12,000 | 0.8 / 0.5 | 1.8 / 2.2 | 2.6 / 4.2 |
//!
//! Registration queries a tree for all points in each of about ten iterations, so the faster query outweighs the slower
//! build. Both libraries take 40 kB of WebAssembly. kiddo does not specify which of equally distant points it returns; here
//! it is the smallest index, on which equal results on every platform depend.

mod queries;

pub(crate) use queries::LANES;
use queries::{HasWithin, KNearest, Nearest, NearestBy, NearestWhere, Search, Within};

/// Points in a leaf. Measured on 100,000 points in the plane and in space: with 32 the build takes 0.8 of the time, but
/// queries take up to a quarter longer; with 8 both are slower.
const LEAF: usize = 16;

/// Depth of the tree at most: there are fewer than 2^32 / [`LEAF`] leaves. The search defers at most one subtree a level.
const MAX_DEPTH: usize = 32 - LEAF.ilog2() as usize;

/// A result of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbor {
    /// Index of the point in the array that the tree was built from.
    pub index: u32,
    /// Squared distance from the query (m^2), summed in single precision in the order of the axes.
    pub sq_distance: f32,
}

impl Neighbor {
    /// The order of all results: nearest first, among equal distances the smallest index first.
    #[inline]
    fn comes_before(self, other: Self) -> bool {
        self.sq_distance < other.sq_distance || (self.sq_distance == other.sq_distance && self.index < other.index)
    }

    /// An integer in the same order; the bits of floats that are not negative ascend with their values.
    #[inline]
    fn key(self) -> u64 {
        u64::from(self.sq_distance.to_bits()) << 32 | u64::from(self.index)
    }

    /// The limit that admits every point up to `max_distance` (m), and none where that is negative or NaN.
    /// Points whose squared distance overflows (beyond 1.8e19 m) are never found.
    pub(crate) fn limit(max_distance: f32) -> Self {
        let sq_distance = if max_distance >= 0.0 { (max_distance * max_distance).min(f32::MAX) } else { -1.0 };
        Self { index: u32::MAX, sq_distance }
    }
}

/// An index of `D`-dimensional points in single precision; it keeps its own copy of them.
///
/// In all searches `max_distance` is inclusive: a point is found when its squared distance is at most
/// `max_distance * max_distance`, both in single precision. A negative or NaN distance finds nothing, and so does a
/// query that is not finite.
#[derive(Debug, Clone)]
pub struct KdTree<const D: usize> {
    /// Inner nodes in heap order: the children of node i are 2i and 2i + 1, the root is 1, entry 0 is not used.
    /// The nodes from `splits.len()` on are the leaves.
    splits: Vec<Split>,
    /// The leaves; all but the rightmost are full.
    leaves: Vec<Leaf<D>>,
    /// Bounds of the points below each node, leaves included.
    bounds: Vec<Bounds<D>>,
    num_points: usize,
}

/// Points whose coordinate along `axis` is at most `position` are on the left, those with at least `position` on the right.
/// `axis` is `D` where all points are equal: the smaller indices are then on the left, which is always searched first.
#[derive(Debug, Clone, Copy, Default)]
struct Split {
    position: f32,
    axis: u32,
}

/// The smallest box around some points, and the smallest index among them.
///
/// Splits bound only the axes that they cut: for a query half a metre off a wall, splits alone would have the search visit
/// all of the wall within half a metre. The index spares a visit to further points equal to the one found.
#[derive(Debug, Clone, Copy)]
struct Bounds<const D: usize> {
    low: [f32; D],
    high: [f32; D],
    smallest_index: u32,
}

/// Points of a leaf, stored axis by axis so that distances are computed in SIMD vectors. Unused entries hold infinity.
#[derive(Debug, Clone)]
struct Leaf<const D: usize> {
    coordinates: [[f32; LEAF]; D],
    indices: [u32; LEAF],
}

#[derive(Clone, Copy)]
struct IndexedPoint<const D: usize> {
    coordinates: [f32; D],
    index: u32,
}

impl<const D: usize> KdTree<D> {
    /// Builds the index. Points with a coordinate that is not finite, and points after the first 2^32 - 1, are left out and
    /// never found.
    pub fn build(points: &[[f32; D]]) -> Self {
        let mut finite = Vec::with_capacity(points.len());
        let numbered = (0..u32::MAX).zip(points).filter(|(_, point)| point.iter().all(|x| x.is_finite()));
        finite.extend(numbered.map(|(index, &coordinates)| IndexedPoint { coordinates, index }));
        let num_leaves = finite.len().div_ceil(LEAF);
        let empty = Leaf { coordinates: [[f32::INFINITY; LEAF]; D], indices: [u32::MAX; LEAF] };
        let mut tree = Self {
            splits: vec![Split::default(); num_leaves],
            leaves: vec![empty; num_leaves],
            bounds: vec![Bounds::new(&[]); 2 * num_leaves],
            num_points: finite.len(),
        };
        if num_leaves > 0 {
            tree.build_node(1, &mut finite);
        }
        tree
    }

    /// Number of points in the index.
    pub fn len(&self) -> usize {
        self.num_points
    }

    /// Whether there is no point in the index.
    pub fn is_empty(&self) -> bool {
        self.num_points == 0
    }

    /// The indices of the points in the order of the leaves, in which neighbouring points are mostly adjacent. Data looked up
    /// by the index of a result are read faster when stored in this order.
    pub fn order(&self) -> impl Iterator<Item = u32> + '_ {
        self.leaves.iter().flat_map(|leaf| leaf.indices).filter(|&index| index != u32::MAX)
    }

    /// The nearest point within `max_distance` (m).
    pub fn nearest(&self, query: &[f32; D], max_distance: f32) -> Option<Neighbor> {
        let mut search = Nearest { best: Neighbor::limit(max_distance) };
        self.search(query, &mut search);
        found(search.best)
    }

    /// The nearest point within `max_distance` (m) among those for whose index `accept` returns true. It is called only for
    /// points nearer than the best so far, in no particular order.
    pub fn nearest_where(
        &self,
        query: &[f32; D],
        max_distance: f32,
        accept: impl FnMut(u32) -> bool,
    ) -> Option<Neighbor> {
        let mut search = NearestWhere { best: Neighbor::limit(max_distance), accept };
        self.search(query, &mut search);
        found(search.best)
    }

    /// Whether there is a point within `max_distance` (m); faster than [`nearest`](Self::nearest).
    pub fn has_within(&self, query: &[f32; D], max_distance: f32) -> bool {
        let mut search = HasWithin { limit: Neighbor::limit(max_distance), found: false };
        self.search(query, &mut search);
        search.found
    }

    /// The nearest point by another distance, of which the Euclidean one must be a lower bound, up to `max_sq_distance`
    /// (m^2). `sq_distance` returns the squared distance of the point of an index; it is called only for points that may be
    /// nearer than the best so far.
    pub(crate) fn nearest_by(
        &self,
        query: &[f32; D],
        max_sq_distance: f32,
        sq_distance: impl FnMut(u32) -> f32,
    ) -> Option<Neighbor> {
        let mut search = NearestBy { best: Neighbor { index: u32::MAX, sq_distance: max_sq_distance }, sq_distance };
        self.search(query, &mut search);
        found(search.best)
    }

    /// Replaces the content of `out` by the `k` nearest points within `max_distance` (m), or all of these if they are fewer:
    /// nearest first, among equal distances the smallest index first.
    pub fn k_nearest(&self, query: &[f32; D], max_distance: f32, k: usize, out: &mut Vec<Neighbor>) {
        out.clear();
        let k = k.min(self.num_points);
        if k > 0 {
            let mut search = KNearest { k, limit: Neighbor::limit(max_distance), found: out };
            self.search(query, &mut search);
            search.cut();
            out.sort_unstable_by_key(|neighbor| neighbor.key());
        }
    }

    /// Replaces the content of `out` by all points within `radius` (m), in no particular order (sorting would double the time).
    pub fn within(&self, query: &[f32; D], radius: f32, out: &mut Vec<Neighbor>) {
        out.clear();
        self.search(query, &mut Within { limit: Neighbor::limit(radius), found: out });
    }

    /// Builds the subtree of `node` from `points`.
    fn build_node(&mut self, node: usize, points: &mut [IndexedPoint<D>]) {
        let num_leaves = self.leaves.len();
        self.bounds[node] = Bounds::new(points);
        if node < num_leaves {
            let axis = self.bounds[node].widest_axis();
            // The left subtree gets full leaves only; the one leaf that may not be full is the rightmost.
            let num_left = LEAF * leaves_below(2 * node, num_leaves);
            points.select_nth_unstable_by_key(num_left, |point| sort_key(point.coordinates[axis], point.index));
            let is_cut = self.bounds[node].width(axis) > 0.0;
            self.splits[node] = Split {
                position: points[num_left].coordinates[axis],
                axis: if is_cut { axis as u32 } else { D as u32 },
            };
            let (left, right) = points.split_at_mut(num_left);
            self.build_node(2 * node, left);
            self.build_node(2 * node + 1, right);
        } else {
            let leaf = &mut self.leaves[node - num_leaves];
            for (place, point) in points.iter().enumerate() {
                for (lanes, &coordinate) in leaf.coordinates.iter_mut().zip(&point.coordinates) {
                    lanes[place] = coordinate;
                }
                leaf.indices[place] = point.index;
            }
        }
    }

    /// Calls `search` with every leaf that may hold a point within its limit, the nearer child of each node first.
    #[inline]
    fn search(&self, query: &[f32; D], search: &mut impl Search) {
        if self.is_empty() || !query.iter().all(|x| x.is_finite()) {
            return;
        }
        let num_leaves = self.leaves.len();
        let mut left_behind = [Subtree { node: 0, sq_distance: 0.0 }; MAX_DEPTH];
        let mut num_left_behind = 0;
        let mut node = 1;
        loop {
            let bounds = &self.bounds[node];
            let offset = bounds.offset_from(query);
            if bounds.may_matter(sq_norm(&offset), search.limit()) {
                while node < num_leaves {
                    let split = self.splits[node];
                    let to_split = query.get(split.axis as usize).map_or(0.0, |x| x - split.position);
                    let far_offset: [f32; D] =
                        std::array::from_fn(|axis| if axis as u32 == split.axis { to_split } else { offset[axis] });
                    let sq_distance = sq_norm(&far_offset);
                    node = 2 * node + usize::from(to_split > 0.0);
                    // Written in any case and kept by the count: a branch here would be mispredicted half of the time.
                    left_behind[num_left_behind] = Subtree { node: (node ^ 1) as u32, sq_distance };
                    num_left_behind += usize::from(sq_distance <= search.limit().sq_distance);
                }
                let leaf = &self.leaves[node - num_leaves];
                search.visit(&leaf.sq_distances(query), &leaf.indices);
            }
            loop {
                if num_left_behind == 0 {
                    return;
                }
                num_left_behind -= 1;
                let subtree = left_behind[num_left_behind];
                if subtree.sq_distance <= search.limit().sq_distance {
                    node = subtree.node as usize;
                    break;
                }
            }
        }
    }
}

/// A subtree that the search has deferred, and a lower bound of its squared distance from the query.
#[derive(Clone, Copy)]
struct Subtree {
    node: u32,
    sq_distance: f32,
}

impl<const D: usize> Bounds<D> {
    fn new(points: &[IndexedPoint<D>]) -> Self {
        let mut bounds = Self { low: [f32::INFINITY; D], high: [f32::NEG_INFINITY; D], smallest_index: u32::MAX };
        for point in points {
            for (axis, &x) in point.coordinates.iter().enumerate() {
                bounds.low[axis] = smaller(bounds.low[axis], x);
                bounds.high[axis] = larger(bounds.high[axis], x);
            }
            bounds.smallest_index = bounds.smallest_index.min(point.index);
        }
        bounds
    }

    fn width(&self, axis: usize) -> f32 {
        self.high[axis] - self.low[axis]
    }

    fn widest_axis(&self) -> usize {
        (1..D).fold(0, |widest, axis| if self.width(axis) > self.width(widest) { axis } else { widest })
    }

    /// Offset from the box to the query; zero along the axes on which the query lies within the box.
    #[inline]
    fn offset_from(&self, query: &[f32; D]) -> [f32; D] {
        std::array::from_fn(|axis| larger(0.0, larger(self.low[axis] - query[axis], query[axis] - self.high[axis])))
    }

    /// Whether a point in the box, whose squared distance from the query is `sq_distance`, can come before `limit`.
    #[inline]
    fn may_matter(&self, sq_distance: f32, limit: Neighbor) -> bool {
        sq_distance < limit.sq_distance || (sq_distance == limit.sq_distance && self.smallest_index < limit.index)
    }
}

/// The smaller of two numbers that are not NaN: one instruction, unlike `f32::min`.
#[inline]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The larger of two numbers that are not NaN.
#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

#[inline]
fn sq_norm<const D: usize>(vector: &[f32; D]) -> f32 {
    vector.iter().fold(0.0, |sum, x| sum + x * x)
}

impl<const D: usize> Leaf<D> {
    #[inline]
    fn sq_distances(&self, query: &[f32; D]) -> [f32; LEAF] {
        let mut sq_distances = [0.0; LEAF];
        for (lanes, &x) in self.coordinates.iter().zip(query) {
            for (sum, &coordinate) in sq_distances.iter_mut().zip(lanes) {
                let difference = coordinate - x;
                *sum += difference * difference;
            }
        }
        sq_distances
    }
}

/// The best point of a search; `None` where the search has found none and still holds its initial limit.
fn found(best: Neighbor) -> Option<Neighbor> {
    (best.index != u32::MAX).then_some(best)
}

/// An integer that sorts finite numbers by value and equal ones by index. It is compared without a branch: the build is four
/// times as fast as with a comparison of floats and then of indices.
#[inline]
fn sort_key(value: f32, index: u32) -> u64 {
    let bits = value.to_bits();
    // The bits of negative numbers ascend as the numbers descend: invert all bits. Otherwise set the sign bit.
    let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
    u64::from(ordered) << 32 | u64::from(index)
}

/// Number of leaves below `node`, or 1 where it is one, in a heap whose leaves are `num_leaves..2 * num_leaves`.
fn leaves_below(node: usize, num_leaves: usize) -> usize {
    let mut leaves = 0;
    // The range of nodes below `node` on each level in turn.
    let (mut first, mut end) = (node, node + 1);
    while first < 2 * num_leaves {
        leaves += end.min(2 * num_leaves).saturating_sub(first.max(num_leaves));
        (first, end) = (2 * first, 2 * end);
    }
    leaves
}
