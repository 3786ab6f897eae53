//! A frame's pieces of surface, thinned out for the registration.

use nalgebra::Vector3;

use crate::camera::Surfel;
use crate::registration::icp::Source;
use crate::registration::projective::PointBatch;

/// A frame's pieces of surface, column by column.
#[derive(Clone)]
pub(crate) struct SurfelCloud {
    pub(crate) points: Vec<Vector3<f64>>,
    pub(crate) normals: Vec<Vector3<f64>>,
    known_normals: Vec<Option<Vector3<f64>>>,
    sigmas: Vec<f64>,
}

impl SurfelCloud {
    /// Of these pieces, in their order.
    pub(crate) fn of(surfels: impl Iterator<Item = Surfel>) -> Self {
        let most = surfels.size_hint().1.unwrap_or(0);
        let mut cloud = Self {
            points: Vec::with_capacity(most),
            normals: Vec::with_capacity(most),
            known_normals: Vec::with_capacity(most),
            sigmas: Vec::with_capacity(most),
        };
        for Surfel { point, normal, sigma } in surfels {
            cloud.points.push(point);
            cloud.normals.push(normal);
            cloud.known_normals.push(Some(normal));
            cloud.sigmas.push(sigma);
        }
        cloud
    }

    /// Its pieces, in order.
    pub(crate) fn surfels(&self) -> impl Iterator<Item = Surfel> {
        let columns = self.points.iter().zip(&self.normals).zip(&self.sigmas);
        columns.map(|((&point, &normal), &sigma)| Surfel { point, normal, sigma })
    }

    /// About `most` of them, as many of every direction as there are, so that the few that hold a corridor's length count
    /// beside its long walls (Rusinkiewicz and Levoy, "Efficient variants of the ICP algorithm", 3DIM 2001).
    pub(crate) fn at_most(&self, most: usize) -> Self {
        let kept = Directions::of(self.normals.iter()).evenly(most);
        Self {
            points: kept.iter().map(|&index| self.points[index]).collect(),
            normals: kept.iter().map(|&index| self.normals[index]).collect(),
            known_normals: kept.iter().map(|&index| self.known_normals[index]).collect(),
            sigmas: kept.iter().map(|&index| self.sigmas[index]).collect(),
        }
    }

    /// The same points for many quick looks.
    pub(crate) fn point_batch(&self) -> PointBatch {
        PointBatch::new(&self.points, &self.normals)
    }

    pub(crate) fn source(&self) -> Source<'_, Vector3<f64>> {
        Source { points: &self.points, normals: Some(&self.known_normals), sigmas: Some(&self.sigmas) }
    }
}

/// Directions are told apart by which of their components are beyond this, and on which side.
const DIRECTION_COMPONENT: f64 = 0.4;
const NUM_DIRECTIONS: usize = 27;

/// Which of [`NUM_DIRECTIONS`] each of some normals has, and how many have each.
pub(super) struct Directions {
    of: Vec<u8>,
    counts: [usize; NUM_DIRECTIONS],
}

impl Directions {
    pub(super) fn of<'a>(normals: impl Iterator<Item = &'a Vector3<f64>>) -> Self {
        let third =
            |component: f64| u8::from(component > -DIRECTION_COMPONENT) + u8::from(component > DIRECTION_COMPONENT);
        let direction = |normal: &Vector3<f64>| 9 * third(normal.x) + 3 * third(normal.y) + third(normal.z);
        let of: Vec<u8> = normals.map(direction).collect();
        let mut counts = [0usize; NUM_DIRECTIONS];
        for &direction in &of {
            counts[usize::from(direction)] += 1;
        }
        Self { of, counts }
    }

    /// Indices of about `most` of the normals in their order, evenly over their directions as far as there are enough.
    pub(super) fn evenly(&self, most: usize) -> Vec<usize> {
        let counts = &self.counts;
        // What small directions do not use up is shared among the larger ones.
        let mut by_size: [usize; NUM_DIRECTIONS] = std::array::from_fn(|index| index);
        by_size.sort_by_key(|&index| (counts[index], index));
        let (mut quotas, mut left) = ([0usize; NUM_DIRECTIONS], most);
        for (place, &index) in by_size.iter().enumerate() {
            quotas[index] = counts[index].min(left / (NUM_DIRECTIONS - place));
            left -= quotas[index];
        }
        // The next one is kept whenever the quotas of those so far come to another whole.
        let mut filled = [0usize; NUM_DIRECTIONS];
        let is_kept = |&direction: &u8| {
            let index = usize::from(direction);
            filled[index] += quotas[index];
            let is_full = filled[index] >= counts[index];
            filled[index] -= if is_full { counts[index] } else { 0 };
            is_full
        };
        let kept: Vec<bool> = self.of.iter().map(is_kept).collect();
        (0..kept.len()).filter(|&index| kept[index]).collect()
    }
}
