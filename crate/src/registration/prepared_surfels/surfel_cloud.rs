//! Sampled surfels of a frame, for registration.

use nalgebra::Vector3;

use crate::camera::Surfel;
use crate::registration::icp::Source;
use crate::registration::projective::PointBatch;

/// Surfels of a frame, one vector per attribute.
#[derive(Clone)]
pub(crate) struct SurfelCloud {
    pub(crate) points: Vec<Vector3<f64>>,
    pub(crate) normals: Vec<Vector3<f64>>,
    known_normals: Vec<Option<Vector3<f64>>>,
    sigmas: Vec<f64>,
}

impl SurfelCloud {
    /// From these surfels, in their order.
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

    /// Its surfels, in order.
    pub(crate) fn surfels(&self) -> impl Iterator<Item = Surfel> {
        let columns = self.points.iter().zip(&self.normals).zip(&self.sigmas);
        columns.map(|((&point, &normal), &sigma)| Surfel { point, normal, sigma })
    }

    /// About `most` of them, sampled evenly over the directions of their normals, so that the few surfels that constrain the
    /// position along a corridor count beside those of its walls (Rusinkiewicz and Levoy, "Efficient variants of the ICP algorithm", 3DIM 2001).
    pub(crate) fn at_most(&self, most: usize) -> Self {
        let kept = Directions::of(self.normals.iter()).evenly(most);
        Self {
            points: kept.iter().map(|&index| self.points[index]).collect(),
            normals: kept.iter().map(|&index| self.normals[index]).collect(),
            known_normals: kept.iter().map(|&index| self.known_normals[index]).collect(),
            sigmas: kept.iter().map(|&index| self.sigmas[index]).collect(),
        }
    }

    /// The same points for scoring many poses.
    pub(crate) fn point_batch(&self) -> PointBatch {
        PointBatch::new(&self.points, &self.normals)
    }

    pub(crate) fn source(&self) -> Source<'_, Vector3<f64>> {
        Source { points: &self.points, normals: Some(&self.known_normals), sigmas: Some(&self.sigmas) }
    }
}

/// Threshold on the components of a normal that separates the bins of directions.
const DIRECTION_COMPONENT: f64 = 0.4;
/// Bins of directions: each component of a normal is low, about zero or high.
const NUM_DIRECTIONS: usize = 27;

/// The direction bin of each normal, one of [`NUM_DIRECTIONS`], and the number of normals in each bin.
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

    /// Indices, ascending, of about `most` of the normals, sampled evenly over the bins as far as they are filled.
    pub(super) fn evenly(&self, most: usize) -> Vec<usize> {
        let counts = &self.counts;
        // The quota that small bins do not use is shared among the larger ones.
        let mut by_size: [usize; NUM_DIRECTIONS] = std::array::from_fn(|index| index);
        by_size.sort_by_key(|&index| (counts[index], index));
        let (mut quotas, mut left) = ([0usize; NUM_DIRECTIONS], most);
        for (place, &index) in by_size.iter().enumerate() {
            quotas[index] = counts[index].min(left / (NUM_DIRECTIONS - place));
            left -= quotas[index];
        }
        // Keeps an index whenever the accumulated quota of its bin passes another whole number.
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
