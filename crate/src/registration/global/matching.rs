//! Pairs of points whose features are each other's nearest.

use super::fpfh::{FEATURE_SIZE, Feature};
use crate::search::KdTree;

/// Two points that look alike, by their indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Match {
    /// In the source.
    pub source: u32,
    /// In the target.
    pub target: u32,
}

/// Features with an index of them.
pub struct FeatureIndex {
    features: Vec<Feature>,
    tree: KdTree<FEATURE_SIZE>,
}

impl FeatureIndex {
    /// Indexes features. Those that are not finite are never found.
    pub fn new(features: Vec<Feature>) -> Self {
        Self { tree: KdTree::build(&features), features }
    }

    /// The features, one a point.
    pub fn features(&self) -> &[Feature] {
        &self.features
    }

    /// The index of the feature nearest to another.
    pub fn nearest(&self, feature: &Feature) -> Option<u32> {
        self.tree.nearest(feature, f32::MAX.sqrt()).map(|neighbor| neighbor.index)
    }
}

/// All pairs that are each other's nearest in the space of features, by source.
pub fn mutual_matches(source: &FeatureIndex, target: &FeatureIndex) -> Vec<Match> {
    // Whether a target point's nearest is a source point is asked only of those that are a source point's nearest.
    let mut nearest_source: Vec<Option<Option<u32>>> = vec![None; target.features.len()];
    let mut matches = Vec::new();
    for (index, feature) in (0..).zip(&source.features) {
        let Some(partner) = target.nearest(feature) else { continue };
        let back =
            nearest_source[partner as usize].get_or_insert_with(|| source.nearest(&target.features[partner as usize]));
        if *back == Some(index) {
            matches.push(Match { source: index, target: partner });
        }
    }
    matches
}
