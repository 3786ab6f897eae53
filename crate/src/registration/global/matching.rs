//! Pairs of points whose features are each other's nearest.
//!
//! Features have many dimensions, but most of their variance is in a few directions. A k-d tree over their coordinates along
//! these gives lower bounds of the distances, which the search then refines (Faloutsos et al., "Efficient and effective querying
//! by image content", J. Intelligent Information Systems 3 (1994)). The result equals that of a brute-force comparison.

use nalgebra::DMatrix;

use super::fpfh::{FEATURE_SIZE, Feature};
use crate::geometry::scalar::SINGLE_ERROR;
use crate::search::KdTree;

/// Two points that look alike, by their indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Match {
    /// In the source.
    pub source: u32,
    /// In the target.
    pub target: u32,
}

/// Dimensions of the tree: principal directions of the features. Measured on rooms: they hold 97 % of the variance.
const DIRECTIONS: usize = 8;
/// Most features from which the directions are computed.
const MAX_SAMPLES: usize = 2000;

/// Features with an index of them.
pub struct FeatureIndex {
    features: Vec<Feature>,
    /// Unit vectors, shortened, in which the features spread most.
    directions: [Feature; DIRECTIONS],
    /// Of the features in the order of `sorted`.
    tree: KdTree<DIRECTIONS>,
    /// The features once more, those that are alike next to each other, which is how they are looked up.
    sorted: Vec<Feature>,
    /// Where each of `sorted` stands in `features`.
    numbers: Vec<u32>,
}

impl FeatureIndex {
    /// Indexes features. Those that are not finite are never found.
    pub fn new(features: Vec<Feature>) -> Self {
        let directions = widest_directions(&features);
        let projected: Vec<_> = features.iter().map(|feature| project(&directions, feature)).collect();
        let numbers: Vec<u32> = KdTree::build(&projected).order().collect();
        let sorted: Vec<Feature> = numbers.iter().map(|&number| features[number as usize]).collect();
        let projected: Vec<_> = numbers.iter().map(|&number| projected[number as usize]).collect();
        Self { tree: KdTree::build(&projected), directions, features, sorted, numbers }
    }

    /// The features, one a point.
    pub fn features(&self) -> &[Feature] {
        &self.features
    }

    /// The index of the feature nearest to another, up to a squared distance. Of equally near ones it is always the same.
    pub fn nearest(&self, feature: &Feature, max_sq_distance: f32) -> Option<u32> {
        let query = project(&self.directions, feature);
        let sq_distance = |index: u32| sq_distance(&self.sorted[index as usize], feature);
        let nearest = self.tree.nearest_by(&query, max_sq_distance, sq_distance);
        nearest.map(|neighbor| self.numbers[neighbor.index as usize])
    }
}

fn project(directions: &[Feature; DIRECTIONS], feature: &Feature) -> [f32; DIRECTIONS] {
    std::array::from_fn(|k| directions[k].iter().zip(feature).map(|(a, b)| a * b).sum())
}

/// Sums in four lanes, which a vector holds.
fn sq_distance(a: &Feature, b: &Feature) -> f32 {
    let mut lanes = [0.0f32; 4];
    let (a, a_rest) = a.as_chunks::<4>();
    let (b, b_rest) = b.as_chunks::<4>();
    for (a, b) in a.iter().zip(b) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += (a - b) * (a - b);
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| (a - b) * (a - b)).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

/// The principal directions of the features with the largest variances.
fn widest_directions(features: &[Feature]) -> [Feature; DIRECTIONS] {
    let stride = features.len().div_ceil(MAX_SAMPLES).max(1);
    let samples: Vec<&Feature> = features.iter().step_by(stride).filter(|f| f.iter().all(|x| x.is_finite())).collect();
    let count = samples.len().max(1) as f64;
    let mean: [f64; FEATURE_SIZE] =
        std::array::from_fn(|k| samples.iter().map(|feature| f64::from(feature[k])).sum::<f64>() / count);
    let mut covariance = [[0.0; FEATURE_SIZE]; FEATURE_SIZE];
    for feature in samples {
        let centred: [f64; FEATURE_SIZE] = std::array::from_fn(|k| f64::from(feature[k]) - mean[k]);
        for (row, x) in covariance.iter_mut().zip(centred) {
            for (entry, y) in row.iter_mut().zip(centred) {
                *entry += x * y;
            }
        }
    }
    let eigen = DMatrix::from_fn(FEATURE_SIZE, FEATURE_SIZE, |row, column| covariance[row][column]).symmetric_eigen();
    let mut order: Vec<usize> = (0..FEATURE_SIZE).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    // Shortened a little, so that rounding cannot make a lower bound larger than the distance.
    let length = 1.0 - SINGLE_ERROR;
    std::array::from_fn(|k| std::array::from_fn(|i| (length * eigen.eigenvectors[(i, order[k])]) as f32))
}

/// Pairs that are each other's nearest in the space of features, by source: all of them, or those of about
/// `max_points` source points, evenly spread.
pub fn mutual_matches(source: &FeatureIndex, target: &FeatureIndex, max_points: usize) -> Vec<Match> {
    let stride = source.features.len().div_ceil(max_points.max(1)).max(1);
    // Of each target point, the nearest of the source points whose nearest it is: no other can be its own nearest.
    let mut nearest_source: Vec<Option<(f32, u32)>> = vec![None; target.features.len()];
    // Those that are alike follow each other: the next one looks much like the last one's partner as well.
    let mut last: Option<u32> = None;
    for &index in source.numbers.iter().filter(|&&index| (index as usize).is_multiple_of(stride)) {
        let feature = &source.features[index as usize];
        let limit = last.map_or(f32::MAX, |last| sq_distance(&target.features[last as usize], feature));
        let Some(partner) = target.nearest(feature, limit) else { continue };
        last = Some(partner);
        let found = (sq_distance(&target.features[partner as usize], feature), index);
        let nearest = &mut nearest_source[partner as usize];
        if nearest.is_none_or(|nearest| found < nearest) {
            *nearest = Some(found);
        }
    }
    let mut matches = Vec::new();
    for &partner in &target.numbers {
        let Some((limit, index)) = nearest_source[partner as usize] else { continue };
        if source.nearest(&target.features[partner as usize], limit) == Some(index) {
            matches.push(Match { source: index, target: partner });
        }
    }
    matches.sort_unstable_by_key(|found| found.source);
    matches
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::scalar::wave;

    /// Features near a curved surface, some of them not finite.
    fn features(count: usize, shift: f64) -> Vec<Feature> {
        (0..count)
            .map(|i| {
                let (a, b) = (wave(i, 1.7), wave(i, 2.9));
                let mut feature: Feature = std::array::from_fn(|k| {
                    (50.0 * wave(k, a + shift) + 20.0 * wave(3 * k, b) + wave(33 * i + k, 7.7)) as f32
                });
                if i % 97 == 5 {
                    feature[3] = f32::NAN;
                }
                feature
            })
            .collect()
    }

    fn brute_force(features: &[Feature], query: &Feature) -> Option<u32> {
        let finite = (0u32..).zip(features).map(|(index, feature)| (sq_distance(feature, query), index));
        let nearest =
            finite.filter(|(distance, _)| distance.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.map(|(_, index)| index)
    }

    #[test]
    fn matches_are_those_of_comparing_all_with_all() {
        let (a, b) = (features(700, 0.0), features(900, 0.05));
        let (source, target) = (FeatureIndex::new(a.clone()), FeatureIndex::new(b.clone()));
        for feature in &a {
            assert_eq!(target.nearest(feature, f32::MAX), brute_force(&b, feature));
        }
        // Of twins either will do.
        let twins: Vec<Feature> = b.iter().chain(&b).copied().collect();
        let index = FeatureIndex::new(twins.clone());
        for feature in a.iter().filter(|feature| feature.iter().all(|x| x.is_finite())) {
            let distance = |found: Option<u32>| sq_distance(&twins[found.unwrap() as usize], feature);
            assert_eq!(distance(index.nearest(feature, f32::MAX)), distance(brute_force(&twins, feature)));
        }
        let expected: Vec<Match> = (0u32..)
            .zip(&a)
            .filter_map(|(index, feature)| {
                let partner = brute_force(&b, feature)?;
                (brute_force(&a, &b[partner as usize]) == Some(index))
                    .then_some(Match { source: index, target: partner })
            })
            .collect();
        assert!(expected.len() > 50, "{}", expected.len());
        assert_eq!(mutual_matches(&source, &target, usize::MAX), expected);
        let some: Vec<Match> = expected.into_iter().filter(|found| found.source % 3 == 0).collect();
        assert_eq!(mutual_matches(&source, &target, 234), some);
    }

    #[test]
    fn nothing_matches_nothing() {
        let (none, some) = (FeatureIndex::new(Vec::new()), FeatureIndex::new(features(50, 0.0)));
        assert!(mutual_matches(&none, &some, 99).is_empty() && mutual_matches(&some, &none, 99).is_empty());
        let unknown = FeatureIndex::new(vec![[f32::NAN; FEATURE_SIZE]; 5]);
        assert!(mutual_matches(&unknown, &some, 99).is_empty());
    }
}
