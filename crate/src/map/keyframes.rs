//! What key frames saw: which space is known to be free, and which places have been seen before.
//!
//! A map of surfaces as seen from a new place shows what is behind walls that nobody has seen yet. Whether space is free
//! can only be told from where somebody looked through it.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::camera::surfel_image::SurfelImage;
use crate::geometry::Pose3;
use crate::geometry::rotation::angle_of;
use crate::registration::free_space::FreeSpaceTest;
use crate::registration::photometric::Picture;
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::projective::ProjectiveTarget;

/// What one frame saw.
#[derive(Clone)]
pub struct Keyframe {
    /// Where it was taken.
    pub T_world_camera: Pose3,
    /// The number of its frame.
    frame: u32,
    /// In the camera's own frame.
    view: Arc<ProjectiveTarget>,
    picture: Option<Picture>,
}

/// The key frames so far.
#[derive(Clone, Default)]
pub struct Keyframes {
    views: Vec<Keyframe>,
    /// What they take on the heap.
    num_bytes: usize,
}

/// A turn by a radian takes as much out of view as a move by so many metres.
const METRES_A_RADIAN: f64 = 2.0;
/// Frames nearer to a key frame than this are none (m, turns included).
const SPACING: f64 = 0.3;
/// Views further away see other things (m, turns included).
const REACH: f64 = 4.0;
/// Views that are asked.
const MAX_NEARBY: usize = 6;
/// All together take at most this much memory (bytes): of more, the ones with the nearest neighbours go, ...
const MOST_BYTES: usize = 96 << 20;
/// ... until this much is left.
const LEFT_BYTES: usize = 72 << 20;
/// How much further apart they must be than before, each time that they are thinned out.
const THINNING: f64 = 1.25;
/// Surfaces this far (m) in front of what was seen stand in free space.
const TOLERANCE: f64 = 0.05;

impl Keyframes {
    /// Keeps a frame that is believed, with a number of the caller's, unless there is one like it.
    pub fn add(&mut self, frame: &PreparedSurfels, number: u32, T_world_camera: &Pose3) {
        if self.views.iter().any(|known| apart_within(&known.T_world_camera, T_world_camera, SPACING).is_some()) {
            return;
        }
        let SurfelImage { brightness, camera, .. } = &frame.image;
        let picture = brightness.clone().map(|brightness| Picture::new(brightness, camera));
        let view = Arc::new(frame.coarse_view());
        self.push(Keyframe { T_world_camera: *T_world_camera, frame: number, view, picture });
    }

    fn push(&mut self, added: Keyframe) {
        self.num_bytes += added.num_bytes();
        self.views.push(added);
        if self.num_bytes > MOST_BYTES {
            let mut spacing = SPACING;
            while self.num_bytes > LEFT_BYTES && self.views.len() > 1 {
                spacing *= THINNING;
                self.thin(spacing);
            }
        }
    }

    /// Leaves the later one of any two that are nearer to each other than this (m, turns included). Where the camera comes
    /// by again, what has gone is replaced.
    fn thin(&mut self, spacing: f64) {
        let mut kept: Vec<Keyframe> = Vec::with_capacity(self.views.len());
        for view in std::mem::take(&mut self.views).into_iter().rev() {
            if kept.iter().all(|other| apart(&other.T_world_camera, &view.T_world_camera) >= spacing) {
                kept.push(view);
            }
        }
        kept.reverse();
        self.num_bytes = kept.iter().map(Keyframe::num_bytes).sum();
        self.views = kept;
    }

    /// Moves each by `motion` (of the world) of its frame's number.
    pub fn apply_corrections(&mut self, motion: impl Fn(u32) -> Pose3) {
        for view in &mut self.views {
            view.T_world_camera = motion(view.frame) * view.T_world_camera;
        }
    }

    /// Adds those of another map that have a `motion` (of the world) by their frame's number, moved by it.
    pub fn merge(&mut self, other: &Self, motion: impl Fn(u32) -> Option<Pose3>) {
        for view in &other.views {
            if let Some(motion) = motion(view.frame) {
                self.push(Keyframe { T_world_camera: motion * view.T_world_camera, ..view.clone() });
            }
        }
    }

    /// All of them, in the order they were taken.
    pub fn all(&self) -> &[Keyframe] {
        &self.views
    }

    /// The views that see most of what a camera at this pose sees, by where they were taken.
    pub fn near(&self, T_world_camera: &Pose3) -> Vec<&Keyframe> {
        let within = |view: &Keyframe| apart_within(&view.T_world_camera, T_world_camera, REACH);
        let mut near: Vec<_> = self.views.iter().filter_map(|view| Some((within(view)?, view))).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(MAX_NEARBY);
        near.into_iter().map(|(_, view)| view).collect()
    }
}

impl Keyframe {
    /// What it takes on the heap.
    fn num_bytes(&self) -> usize {
        self.view.num_bytes() + self.picture.as_ref().map_or(0, Picture::num_bytes)
    }

    /// What it saw, in the camera's own frame.
    pub fn view(&self) -> &ProjectiveTarget {
        &self.view
    }

    /// How bright it was, where the frame had colours that are used.
    pub fn picture(&self) -> Option<&Picture> {
        self.picture.as_ref()
    }

    /// Whether it looked through where this point (world frame) lies.
    pub fn saw_through(&self, point: &Vector3<f64>) -> bool {
        let point = self.T_world_camera.inverse_transform_point(&(*point).into()).coords;
        matches!(self.view.classify_leniently(&point, TOLERANCE), FreeSpaceTest::InFreeSpace)
    }
}

/// How far apart what two cameras see is (m): turns take it out of view as moves do.
pub fn apart(a: &Pose3, b: &Pose3) -> f64 {
    let between = a.inverse() * b;
    between.translation.vector.norm() + METRES_A_RADIAN * angle_of(&between.rotation)
}

/// The same where it is less than a limit; most of many are told by where they are alone.
pub fn apart_within(a: &Pose3, b: &Pose3, limit: f64) -> Option<f64> {
    let moved = a.translation.vector - b.translation.vector;
    (moved.norm_squared() < limit * limit).then(|| apart(a, b)).filter(|distance| *distance < limit)
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
            cells: (0..columns * rows).map(surfel).collect(),
            brightness: Some(Arc::new(Brightness::new(&colors))),
        };
        PreparedSurfels::new(image, 0)
    }

    #[test]
    fn what_key_frames_take_is_bounded_and_they_stay_spread_over_the_way() {
        let (frame, mut keyframes) = (wall(), Keyframes::default());
        let step = 1.01 * SPACING;
        let at = |index: u32| Pose3::from(Translation3::new(step * f64::from(index), 0.0, 0.0));
        let num_frames = 500;
        for index in 0..num_frames {
            keyframes.add(&frame, index, &at(index));
            assert!(keyframes.num_bytes <= MOST_BYTES, "{} bytes", keyframes.num_bytes);
        }
        let bytes_each = keyframes.num_bytes / keyframes.all().len();
        assert!(bytes_each < 560_000, "{bytes_each} bytes a key frame");
        let counted: usize = keyframes.all().iter().map(Keyframe::num_bytes).sum();
        assert_eq!(counted, keyframes.num_bytes);
        // The way is covered from its beginning to its end, the last frame is there, and wherever one comes back to, some saw it.
        assert_eq!(keyframes.all().last().unwrap().frame, num_frames - 1);
        for index in 0..num_frames {
            assert!(!keyframes.near(&at(index)).is_empty(), "nothing is known about frame {index}");
        }
    }

    #[test]
    fn of_others_only_what_is_to_be_moved_is_taken_in() {
        let (frame, mut others, mut keyframes) = (wall(), Keyframes::default(), Keyframes::default());
        for number in 0..3 {
            others.add(&frame, number, &Pose3::from(Translation3::new(f64::from(number), 0.0, 0.0)));
        }
        keyframes.merge(&others, |number| (number > 0).then(|| Translation3::new(0.0, 0.5, 0.0).into()));
        let places: Vec<_> = keyframes.all().iter().map(|view| view.T_world_camera.translation.vector).collect();
        assert_eq!(places, [Vector3::new(1.0, 0.5, 0.0), Vector3::new(2.0, 0.5, 0.0)]);
        assert_eq!(keyframes.num_bytes, keyframes.all().iter().map(Keyframe::num_bytes).sum::<usize>());
    }

    #[test]
    fn a_short_walk_keeps_every_key_frame() {
        let (frame, mut keyframes) = (wall(), Keyframes::default());
        for index in 0..100 {
            keyframes.add(&frame, index, &Pose3::from(Translation3::new(0.0, 0.0, -0.31 * f64::from(index))));
        }
        assert_eq!(keyframes.all().len(), 100);
    }
}
