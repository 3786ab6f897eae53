//! Registration targets: points with a nearest-neighbour index, and normals for the metrics that need them.

use std::rc::Rc;

use nalgebra::{SVector, Vector2};

use crate::geometry::Vector;
use crate::geometry::algebra::single;
use crate::geometry::scalar::SINGLE_ERROR;
use crate::search::{KdTree, NearestTable, Neighbor};

/// Points (m) with a nearest-neighbour index.
#[derive(Clone)]
pub struct PointTarget<const D: usize> {
    points: Vec<SVector<f64, D>>,
    tree: KdTree<D>,
}

impl<const D: usize> PointTarget<D> {
    /// Indexes the points. Non-finite ones are never found.
    pub fn new(points: Vec<SVector<f64, D>>) -> Self {
        let single: Vec<[f32; D]> = points.iter().map(single).collect();
        Self { tree: KdTree::build(&single), points }
    }

    /// The points (m).
    pub fn points(&self) -> &[SVector<f64, D>] {
        &self.points
    }

    /// The nearest point within `max_distance` (m); the distance of the point `last`, if smaller, bounds the search.
    fn nearest_up_to(&self, query: &SVector<f64, D>, max_distance: f64, last: u32) -> Option<Neighbor> {
        let query = single(query);
        let last = single(&self.points[last as usize]);
        let sq_distance = query.iter().zip(last).fold(0.0, |sum, (a, b)| sum + (a - b) * (a - b));
        // The limit is squared again: slightly enlarged, so that rounding does not exclude `last` itself.
        let reach = sq_distance.sqrt() * (1.0 + 4.0 * f32::EPSILON) + f32::MIN_POSITIVE;
        self.tree.nearest(&query, reach.min(max_distance as f32))
    }
}

/// Points (m) with an index and unit normals, for point-to-line, point-to-plane and plane-to-plane residuals.
#[derive(Clone)]
pub struct OrientedTarget<const D: usize> {
    points: PointTarget<D>,
    normals: Vec<Option<SVector<f64, D>>>,
}

impl<const D: usize> OrientedTarget<D> {
    /// Indexes the points. A point whose normal is `None` can be found but gives no residual.
    ///
    /// # Panics
    /// When there is not one entry of `normals` for each point.
    pub fn new(points: Vec<SVector<f64, D>>, normals: Vec<Option<SVector<f64, D>>>) -> Self {
        assert_eq!(points.len(), normals.len(), "one normal a point");
        Self { points: PointTarget::new(points), normals }
    }

    /// The points (m).
    pub fn points(&self) -> &[SVector<f64, D>] {
        self.points.points()
    }

    /// The index of the points.
    pub fn tree(&self) -> &KdTree<D> {
        &self.points.tree
    }

    /// Unit normals, where they are known; one entry a point.
    pub fn normals(&self) -> &[Option<SVector<f64, D>>] {
        &self.normals
    }
}

/// The result of the last search for a point, kept for the next one.
#[derive(Debug, Clone, Copy)]
pub enum LastSearch<P> {
    /// There was no search.
    None,
    /// Index of the nearest target point.
    Nearest(u32),
    /// No target point was within this distance (m) of this query.
    NoneWithin(P, f64),
}

impl<P: Vector> LastSearch<P> {
    /// The search of [`Target::nearest_again`]. `nearest` searches within a distance (m), `up_to` no further than the point of
    /// this index. `clearance`: ratio of the search radius to the distance limit; a point without a partner in that radius needs
    /// no new search until it has moved by the difference.
    pub(crate) fn again(
        &mut self,
        query: &P,
        max_distance: f64,
        clearance: f64,
        nearest: impl Fn(f64) -> Option<Neighbor>,
        up_to: impl Fn(u32) -> Option<Neighbor>,
    ) -> Option<Neighbor> {
        let found = match *self {
            Self::Nearest(index) => up_to(index),
            Self::NoneWithin(place, clear) if (*query - place).norm() + max_distance < clear => return None,
            Self::None | Self::NoneWithin(..) => {
                let reach = clearance * max_distance;
                let nearest = nearest(reach);
                let distance = nearest.map_or(reach, |nearest| f64::from(nearest.sq_distance).sqrt());
                *self = Self::NoneWithin(*query, distance * (1.0 - SINGLE_ERROR));
                let limit = max_distance as f32;
                nearest.filter(|nearest| nearest.sq_distance <= limit * limit)
            }
        };
        if let Some(found) = found {
            *self = Self::Nearest(found.index);
        }
        found
    }
}

/// [`LastSearch::again`]'s `clearance` for a tree or blocks of voxels.
pub(crate) const CLEARANCE_FACTOR: f64 = 2.0;

/// A registration target, for every metric.
pub trait Target {
    /// The type of its points and normals.
    type Point: Vector;

    /// The nearest target point within `max_distance` (m) of a point in the target frame.
    fn nearest(&self, query: &Self::Point, max_distance: f64) -> Option<Neighbor>;
    /// [`nearest`](Self::nearest) for a point of which an earlier search is known. It makes the search faster and does not change
    /// the result.
    fn nearest_again(
        &self,
        query: &Self::Point,
        max_distance: f64,
        _last: &mut LastSearch<Self::Point>,
    ) -> Option<Neighbor> {
        self.nearest(query, max_distance)
    }
    /// [`nearest_again`](Self::nearest_again) for many points: `found` is called for each one, in their order.
    fn nearest_of_all(
        &self,
        queries: &[Self::Point],
        max_distance: f64,
        last: &mut [LastSearch<Self::Point>],
        mut found: impl FnMut(usize, Option<Neighbor>),
    ) {
        for (index, (query, last)) in queries.iter().zip(last).enumerate() {
            found(index, self.nearest_again(query, max_distance, last));
        }
    }
    /// Position of a target point (m).
    fn point(&self, index: u32) -> Self::Point;
    /// Unit normal of a target point, where it has one.
    fn normal(&self, index: u32) -> Option<Self::Point>;
    /// Standard deviation of the surface at a target point along its normal (m); 0 where unknown.
    fn sigma(&self, _index: u32) -> f64 {
        0.0
    }
}

/// A target whose points have normals. Metrics that need normals require this trait, so that their use with another target does
/// not compile.
pub trait SurfaceTarget: Target {}

impl<const D: usize> SurfaceTarget for OrientedTarget<D> {}

impl<const D: usize> Target for PointTarget<D> {
    type Point = SVector<f64, D>;

    fn nearest(&self, query: &SVector<f64, D>, max_distance: f64) -> Option<Neighbor> {
        self.tree.nearest(&single(query), max_distance as f32)
    }

    fn nearest_again(
        &self,
        query: &SVector<f64, D>,
        max_distance: f64,
        last: &mut LastSearch<Self::Point>,
    ) -> Option<Neighbor> {
        let nearest = |reach| self.nearest(query, reach);
        last.again(query, max_distance, CLEARANCE_FACTOR, nearest, |index| {
            self.nearest_up_to(query, max_distance, index)
        })
    }

    fn point(&self, index: u32) -> SVector<f64, D> {
        self.points[index as usize]
    }

    fn normal(&self, _index: u32) -> Option<SVector<f64, D>> {
        None
    }
}

impl<const D: usize> Target for OrientedTarget<D> {
    type Point = SVector<f64, D>;

    fn nearest(&self, query: &SVector<f64, D>, max_distance: f64) -> Option<Neighbor> {
        self.points.nearest(query, max_distance)
    }

    fn nearest_again(
        &self,
        query: &SVector<f64, D>,
        max_distance: f64,
        last: &mut LastSearch<Self::Point>,
    ) -> Option<Neighbor> {
        self.points.nearest_again(query, max_distance, last)
    }

    fn point(&self, index: u32) -> SVector<f64, D> {
        self.points.point(index)
    }

    fn normal(&self, index: u32) -> Option<SVector<f64, D>> {
        self.normals[index as usize]
    }
}

/// A target in the plane with a [`NearestTable`], for very many searches within one distance.
#[derive(Clone)]
pub struct TabledTarget<T> {
    target: T,
    table: Rc<NearestTable>,
}

impl<T> TabledTarget<T> {
    /// Adds a table of the target's points.
    pub fn new(target: T, table: Rc<NearestTable>) -> Self {
        Self { target, table }
    }
}

impl<T: Target<Point = Vector2<f64>>> Target for TabledTarget<T> {
    type Point = Vector2<f64>;

    /// Uses the target's own search for any distance but that of the table.
    #[inline]
    fn nearest(&self, query: &Vector2<f64>, max_distance: f64) -> Option<Neighbor> {
        if max_distance == self.table.max_distance() {
            self.table.nearest(query)
        } else {
            self.target.nearest(query, max_distance)
        }
    }

    fn point(&self, index: u32) -> Vector2<f64> {
        self.target.point(index)
    }

    fn normal(&self, index: u32) -> Option<Vector2<f64>> {
        self.target.normal(index)
    }
}

impl<T: SurfaceTarget<Point = Vector2<f64>>> SurfaceTarget for TabledTarget<T> {}
