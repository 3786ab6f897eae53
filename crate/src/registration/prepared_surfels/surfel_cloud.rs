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
        let kept = NormalBins::of(self.normals.iter()).sample_evenly(most);
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

/// Size of a component of a normal up to which it counts as about zero.
const BIN_COMPONENT: f64 = 0.4;
/// Bins of normals: each component is negative, about zero or positive.
const NUM_BINS: usize = 27;

/// The bin of each normal, by its direction, and the number of normals in each bin.
pub(super) struct NormalBins {
    bins: Vec<u8>,
    counts: [usize; NUM_BINS],
}

impl NormalBins {
    pub(super) fn of<'a>(normals: impl Iterator<Item = &'a Vector3<f64>>) -> Self {
        let third = |component: f64| u8::from(component > -BIN_COMPONENT) + u8::from(component > BIN_COMPONENT);
        let bin = |normal: &Vector3<f64>| 9 * third(normal.x) + 3 * third(normal.y) + third(normal.z);
        let bins: Vec<u8> = normals.map(bin).collect();
        let mut counts = [0usize; NUM_BINS];
        for &bin in &bins {
            counts[usize::from(bin)] += 1;
        }
        Self { bins, counts }
    }

    /// Indices, ascending, of about `most` of the normals, sampled evenly over the bins as far as they are filled.
    pub(super) fn sample_evenly(&self, most: usize) -> Vec<usize> {
        let counts = &self.counts;
        // The quota that small bins do not use is shared among the larger ones.
        let mut by_size: [usize; NUM_BINS] = std::array::from_fn(|index| index);
        by_size.sort_by_key(|&index| (counts[index], index));
        let (mut quotas, mut left) = ([0usize; NUM_BINS], most);
        for (place, &index) in by_size.iter().enumerate() {
            quotas[index] = counts[index].min(left / (NUM_BINS - place));
            left -= quotas[index];
        }
        // Keeps an index whenever the accumulated quota of its bin passes another whole number.
        let mut filled = [0usize; NUM_BINS];
        let is_kept = |&bin: &u8| {
            let index = usize::from(bin);
            filled[index] += quotas[index];
            let is_full = filled[index] >= counts[index];
            filled[index] -= if is_full { counts[index] } else { 0 };
            is_full
        };
        let kept: Vec<bool> = self.bins.iter().map(is_kept).collect();
        (0..kept.len()).filter(|&index| kept[index]).collect()
    }
}
