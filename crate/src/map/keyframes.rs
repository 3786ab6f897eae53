//! Keyframes: single frames at their poses, for the test of free space and for the comparison of brightness.
//!
//! A map of surfaces rendered from a new pose also shows surfaces behind walls that have not been measured yet. Only frames
//! whose rays crossed a volume prove that it is free.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::camera::surfel_image::SurfelImage;
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::registration::free_space::{DepthNoise, FreeSpaceTest};
use crate::registration::photometric::Picture;
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::projective::ProjectiveTarget;

/// One frame at its pose.
#[derive(Clone)]
pub struct Keyframe {
    /// Pose of the camera.
    pub T_world_camera: Pose3,
    /// Number of the frame.
    frame: u32,
    /// Its surfaces, in the camera's own frame.
    view: Arc<ProjectiveTarget>,
    picture: Option<Picture>,
}

/// The keyframes so far.
#[derive(Clone, Default)]
pub struct Keyframes {
    keyframes: Vec<Keyframe>,
    /// Memory on the heap (bytes).
    num_bytes: usize,
}

/// Smallest distance between two keyframes (m, two metres per radian).
pub(crate) const KEYFRAME_SPACING: f64 = 0.3;
/// Largest distance at which a keyframe shares the view of a camera (m, two metres per radian).
pub(crate) const MAX_VIEW_DISTANCE: f64 = 4.0;
/// Largest number of keyframes that are compared with a camera.
pub(crate) const MAX_NEARBY: usize = 6;
/// Memory above which a store of frames, such as this one, is thinned (bytes).
pub(crate) const MAX_BYTES: usize = 64 << 20;
/// Most memory of a thinned one (bytes): less than [`MAX_BYTES`], since thinning again at each frame would cost too much.
pub(crate) const TARGET_BYTES: usize = MAX_BYTES / 4 * 3;
/// Factor by which the spacing grows in each round of thinning.
const SPACING_GROWTH: f64 = 1.25;
/// Distance along the normal up to which a point lies on a surface, and not in the free space in front of it (m).
const SURFACE_TOLERANCE: f64 = 0.05;

impl Keyframes {
    /// Adds a frame, unless it is nearer to another keyframe than the spacing.
    #[inline(never)]
    pub fn add(&mut self, frame: &PreparedSurfels, number: u32, T_world_camera: &Pose3) {
        if !is_keyframe(T_world_camera, self.keyframes.iter().map(|known| &known.T_world_camera)) {
            return;
        }
        let SurfelImage { brightness, camera, .. } = &frame.image;
        let picture = brightness.clone().map(|brightness| Picture::new(brightness, camera));
        let view = Arc::new(frame.coarse_view());
        self.push(Keyframe { T_world_camera: *T_world_camera, frame: number, view, picture });
    }

    fn push(&mut self, added: Keyframe) {
        self.num_bytes += added.num_bytes();
        self.keyframes.push(added);
        if self.num_bytes > MAX_BYTES {
            let mut spacing = KEYFRAME_SPACING;
            while self.num_bytes > TARGET_BYTES && self.keyframes.len() > 1 {
                spacing *= SPACING_GROWTH;
                self.thin(spacing);
            }
        }
    }

    /// Removes the earlier of any two that are nearer to each other than this (m, two metres per radian).
    fn thin(&mut self, spacing: f64) {
        let mut kept: Vec<Keyframe> = Vec::with_capacity(self.keyframes.len());
        for keyframe in std::mem::take(&mut self.keyframes).into_iter().rev() {
            if kept.iter().all(|other| pose_distance(&other.T_world_camera, &keyframe.T_world_camera) >= spacing) {
                kept.push(keyframe);
            }
        }
        kept.reverse();
        self.num_bytes = kept.iter().map(Keyframe::num_bytes).sum();
        self.keyframes = kept;
    }

    /// Moves each by `motion` (of the world) of its frame's number.
    pub fn apply_corrections(&mut self, motion: impl Fn(u32) -> Pose3) {
        for keyframe in &mut self.keyframes {
            keyframe.T_world_camera = motion(keyframe.frame) * keyframe.T_world_camera;
        }
    }

    /// All of them, in the order in which they were added.
    pub fn all(&self) -> &[Keyframe] {
        &self.keyframes
    }

    /// The keyframes that share most of the view of a camera at this pose, judged by their distance.
    pub fn near(&self, T_world_camera: &Pose3) -> Vec<&Keyframe> {
        let distance = |keyframe: &Keyframe| apart_within(&keyframe.T_world_camera, T_world_camera, MAX_VIEW_DISTANCE);
        let mut near: Vec<_> =
            self.keyframes.iter().filter_map(|keyframe| Some((distance(keyframe)?, keyframe))).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(MAX_NEARBY);
        near.into_iter().map(|(_, keyframe)| keyframe).collect()
    }
}

impl Keyframe {
    /// Memory on the heap (bytes).
    fn num_bytes(&self) -> usize {
        self.view.num_bytes() + self.picture.as_ref().map_or(0, Picture::num_bytes)
    }

    /// Its surfaces, in the camera's own frame.
    pub fn view(&self) -> &ProjectiveTarget {
        &self.view
    }

    /// Its brightness, where the frame has colours that are used.
    pub fn picture(&self) -> Option<&Picture> {
        self.picture.as_ref()
    }

    /// Whether a point (m, world frame) lies in space that this frame measured as free.
    pub fn saw_through(&self, point: &Vector3<f64>, noise: DepthNoise) -> bool {
        let point = self.T_world_camera.inverse_transform_point(&(*point).into()).coords;
        let tolerance = noise.tolerance(SURFACE_TOLERANCE, point.z);
        matches!(self.view.classify_leniently(&point, tolerance), FreeSpaceTest::InFreeSpace)
    }
}

/// Whether a frame at this pose is a keyframe beside those that are known: none of them is nearer than the spacing.
pub(crate) fn is_keyframe<'a>(T_world_camera: &Pose3, known: impl IntoIterator<Item = &'a Pose3>) -> bool {
    !known.into_iter().any(|known| apart_within(known, T_world_camera, KEYFRAME_SPACING).is_some())
}

/// [`pose_distance`], if it is less than `limit`. For most poses the translation alone exceeds it.
pub fn apart_within(a: &Pose3, b: &Pose3, limit: f64) -> Option<f64> {
    let moved = a.translation.vector - b.translation.vector;
    (moved.norm_squared() < limit * limit).then(|| pose_distance(a, b)).filter(|distance| *distance < limit)
}

#[cfg(test)]
mod tests {
    use nalgebra::Translation3;

    use super::*;
    use crate::camera::surfel_image::cell_camera;
    use crate::camera::{Brightness, ColorImage, Pinhole, Surfel};

    /// A wall two metres ahead, as a camera of 640 x 480 pixels with colours sees it.
    fn wall() -> PreparedSurfels {
        let camera = Pinhole::new(640, 480, [500.0, 500.0, 319.5, 239.5]).unwrap();
        let (columns, rows) = (160, 120);
        let cells = cell_camera(&camera, 4);
        let surfel = |cell: usize| {
            let point = 2.0 * cells.ray((cell % columns) as f64, (cell / columns) as f64);
            Some(Surfel { point, normal: -Vector3::z(), sigma: 0.01 })
        };
        let colors = ColorImage { width: 640, height: 480, pixels: vec![[90; 3]; 640 * 480] };
        let image = SurfelImage {
            camera,
            cell_size: 4,
            columns,
            rows,
            cells: Arc::new((0..columns * rows).map(surfel).collect()),
            brightness: Some(Arc::new(Brightness::new(&colors))),
        };
        PreparedSurfels::new(image, 0)
    }

    #[test]
    fn the_memory_of_keyframes_is_bounded_and_they_cover_the_whole_path() {
        let (frame, mut keyframes) = (wall(), Keyframes::default());
        let step = 1.01 * KEYFRAME_SPACING;
        let at = |index: u32| Pose3::from(Translation3::new(step * f64::from(index), 0.0, 0.0));
        let num_frames = 500;
        for index in 0..num_frames {
            keyframes.add(&frame, index, &at(index));
            assert!(keyframes.num_bytes <= MAX_BYTES, "{} bytes", keyframes.num_bytes);
        }
        let bytes_each = keyframes.num_bytes / keyframes.all().len();
        assert!(bytes_each < 560_000, "{bytes_each} bytes a keyframe");
        let counted: usize = keyframes.all().iter().map(Keyframe::num_bytes).sum();
        assert_eq!(counted, keyframes.num_bytes);
        // The last frame is a keyframe, and every pose of the path has keyframes near it.
        assert_eq!(keyframes.all().last().unwrap().frame, num_frames - 1);
        for index in 0..num_frames {
            assert!(!keyframes.near(&at(index)).is_empty(), "no keyframe near frame {index}");
        }
    }

    #[test]
    fn a_short_walk_keeps_every_keyframe() {
        let (frame, mut keyframes) = (wall(), Keyframes::default());
        for index in 0..100 {
            keyframes.add(&frame, index, &Pose3::from(Translation3::new(0.0, 0.0, -0.31 * f64::from(index))));
        }
        assert_eq!(keyframes.all().len(), 100);
    }
}
