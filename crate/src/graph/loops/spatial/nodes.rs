//! The frames of the graph along the path, with what they saw, within a bound on memory.

use std::ops::Range;
use std::sync::Arc;

use super::stored_surfaces::StoredSurfaces;
use super::submap::{FrameSurfaces, Submap};
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::map::keyframes::{MAX_BYTES, MAX_NEARBY, MAX_VIEW_DISTANCE, TARGET_BYTES, apart_within};

/// Distance up to which two poses share a view (m, two metres per radian).
const MAX_REVISIT_DISTANCE: f64 = 1.2;
/// Largest number of frames in a submap of recent frames, as of keyframes that a camera is compared with; a submap around a node has the
/// node besides.
pub(super) const MAX_SUBMAP_FRAMES: usize = MAX_NEARBY;

/// A frame of the graph.
pub(super) struct Node {
    /// Its number among all frames.
    pub(super) frame: u32,
    pub(super) T_world_camera: Pose3,
    /// Its pose by the recent frames alone, on a path through a revisited place; elsewhere the same as `T_world_camera`.
    pub(super) T_world_local: Pose3,
    /// Length of the path up to it (m, two metres per radian).
    pub(super) path_length: f64,
    /// `None` once it has been thinned out.
    pub(super) surfaces: Option<StoredSurfaces>,
}

/// All nodes, in the order of the path.
#[derive(Default)]
pub(super) struct Nodes {
    /// One a frame.
    pub(super) all: Vec<Node>,
    /// Memory of the packed surfaces (bytes).
    pub(super) num_packed_bytes: usize,
    /// Smallest path length between older frames that still have surfaces (m, two metres per radian).
    spacing: f64,
}

impl Nodes {
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    pub(super) fn push(&mut self, frame: u32, T_world_camera: Pose3, T_world_local: Pose3, surfaces: FrameSurfaces) {
        let step = self.all.last().map_or(0.0, |last| pose_distance(&last.T_world_camera, &T_world_camera));
        let path_length = self.all.last().map_or(0.0, |last| last.path_length) + step;
        let surfaces = Some(StoredSurfaces::Whole(Arc::new(surfaces)));
        self.all.push(Node { frame, T_world_camera, T_world_local, path_length, surfaces });
        let num_older = self.all.len().saturating_sub(2 * MAX_SUBMAP_FRAMES);
        if let Some(stored) = num_older.checked_sub(1).and_then(|last| self.all[last].surfaces.as_mut()) {
            stored.pack();
            self.num_packed_bytes += stored.num_packed_bytes();
        }
        if self.num_packed_bytes > MAX_BYTES {
            let mut num_stored = self.thin(num_older);
            while self.num_packed_bytes > TARGET_BYTES {
                let mean_spacing = self.all[num_older - 1].path_length / num_stored as f64;
                self.spacing = mean_spacing.max(1.5 * self.spacing);
                num_stored = self.thin(num_older);
            }
        }
    }

    /// Drops the surfaces of those of the first `num_older` nodes that follow another one within the spacing. Returns how many remain.
    fn thin(&mut self, num_older: usize) -> usize {
        let (mut last, mut num_bytes, mut num_stored) = (f64::NEG_INFINITY, 0, 0);
        for node in &mut self.all[..num_older] {
            let Some(stored) = &node.surfaces else { continue };
            if node.path_length - last <= self.spacing {
                node.surfaces = None;
            } else {
                last = node.path_length;
                num_bytes += stored.num_packed_bytes();
                num_stored += 1;
            }
        }
        self.num_packed_bytes = num_bytes;
        num_stored
    }

    /// The nearest node that may share its view with a camera at this pose after a loop.
    pub(super) fn revisited(&self, before: usize, T_world_camera: &Pose3, path_length: f64) -> Option<usize> {
        let near = self.all[..before].iter().enumerate().filter_map(|(index, node)| {
            // A loop leaves the view and returns.
            if path_length - node.path_length <= 2.0 * MAX_VIEW_DISTANCE || node.surfaces.is_none() {
                return None;
            }
            Some((apart_within(&node.T_world_camera, T_world_camera, MAX_REVISIT_DISTANCE)?, index))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, index)| index)
    }

    /// The recent nodes.
    pub(super) fn recent(&self) -> Range<usize> {
        self.len().saturating_sub(MAX_SUBMAP_FRAMES)..self.len()
    }

    /// The nodes around one that have surfaces.
    pub(super) fn around(&self, index: usize) -> Vec<usize> {
        let has_surfaces = |node: &usize| self.all[*node].surfaces.is_some();
        let before = (0..index).rev().filter(has_surfaces).take(MAX_SUBMAP_FRAMES / 2);
        let from = (index..self.len()).filter(has_surfaces).take(MAX_SUBMAP_FRAMES / 2 + 1);
        let mut around: Vec<usize> = before.chain(from).collect();
        around.sort_unstable();
        around
    }

    /// The submap of some nodes, in the frame of one of them.
    pub(super) fn submap(
        &self,
        nodes: impl IntoIterator<Item = usize>,
        in_frame_of: usize,
        pose: impl Fn(usize) -> Pose3,
    ) -> Submap<'_> {
        let T_submap_world = pose(in_frame_of).inverse();
        let frames = nodes.into_iter().filter_map(|node| {
            let seen = self.all[node].surfaces.as_ref()?.as_submap_frame();
            Some((seen, T_submap_world * pose(node)))
        });
        Submap::new(frames.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::stored_surfaces::tests::wall;
    use super::*;

    #[test]
    fn the_stored_surfaces_are_bounded_and_spread_over_the_path() {
        let (frame, mut nodes) = (wall(), Nodes::default());
        for number in 0..1200 {
            let T_world_camera = Pose3::translation(0.05 * f64::from(number), 0.0, 0.0);
            nodes.push(number, T_world_camera, T_world_camera, FrameSurfaces::new(&frame));
            assert!(nodes.num_packed_bytes <= MAX_BYTES, "{} bytes", nodes.num_packed_bytes);
        }
        let stored = nodes.all.iter().flat_map(|node| &node.surfaces);
        let counted: usize = stored.map(StoredSurfaces::num_packed_bytes).sum();
        assert_eq!(counted, nodes.num_packed_bytes);
        let with_surfaces = nodes.all.iter().filter(|node| node.surfaces.is_some());
        let lengths: Vec<f64> = with_surfaces.map(|node| node.path_length).collect();
        assert!(lengths.len() < 400, "{} frames have surfaces", lengths.len());
        assert_eq!(lengths[0], 0.0);
        let widest = lengths.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        assert!(widest < 0.4, "{widest} m without surfaces");
        assert_eq!(nodes.around(600).len(), MAX_SUBMAP_FRAMES + 1, "thinning does not shrink a submap");
    }
}
