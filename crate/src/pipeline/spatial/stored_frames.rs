//! What is kept of the frames once they are registered, within a bound.
//!
//! The map can be made anew at any time, so every frame's points are kept. Of a long recording that is more than a browser
//! gives to a page: then all frames are thinned out alike, those to come as well. Which points go depends on the frames
//! alone, so the same recording gives the same map everywhere.

use glam::Vec3;
use nalgebra::Vector6;

use crate::geometry::PointCloud;
use crate::pipeline::prepared_frame::{FrameLabel, MapPoints};
use crate::preprocess::azimuth_clock::AzimuthClock;
use crate::preprocess::deskew::deskew;

/// Kept points take at most this much (bytes): 416 frames of 640 x 480 pixels with colours as they come, four times as
/// many thinned once.
const MOST_BYTES: usize = 1 << 28;

/// What is kept of a frame.
pub(super) struct Frame {
    pub label: FrameLabel,
    pub map_points: MapPoints,
    /// Velocity of the sensor by which the points are straightened; zeros where they are not.
    straightened_by: Vector6<f64>,
}

impl Frame {
    /// As it was prepared.
    pub(super) fn new(label: FrameLabel, map_points: MapPoints) -> Self {
        Self { label, map_points, straightened_by: Vector6::zeros() }
    }
}

/// The frames, in order.
#[derive(Default)]
pub(super) struct StoredFrames {
    frames: Vec<Frame>,
    num_bytes: usize,
    /// How often all were thinned out, each time to a quarter.
    num_thinnings: usize,
}

impl StoredFrames {
    /// Takes a frame in; whether those before it had to be thinned out for it.
    pub(super) fn push(&mut self, mut frame: Frame) -> bool {
        for round in 0..self.num_thinnings {
            frame.map_points.thin(self.frames.len(), round);
        }
        self.num_bytes += frame.map_points.num_bytes();
        self.frames.push(frame);
        if self.num_bytes <= MOST_BYTES {
            return false;
        }
        for (index, frame) in self.frames.iter_mut().enumerate() {
            frame.map_points.thin(index, self.num_thinnings);
        }
        self.num_thinnings += 1;
        self.num_bytes = self.frames.iter().map(|frame| frame.map_points.num_bytes()).sum();
        true
    }

    /// Straightens the points of a sweep by this velocity, as they are seen from where the sensor was at the frame's time stamp, in
    /// place of an earlier one.
    pub(super) fn straighten(&mut self, number: usize, velocity: &Vector6<f64>) {
        let Some(Frame { map_points: MapPoints::Cloud(cloud), straightened_by, .. }) = self.frames.get_mut(number)
        else {
            return;
        };
        for velocity in [-*straightened_by, *velocity].iter().filter(|velocity| **velocity != Vector6::zeros()) {
            let times = cloud.times.clone();
            *cloud = PointCloud { times, ..deskew(std::mem::take(cloud), velocity, 0.0) };
        }
        *straightened_by = *velocity;
    }

    /// Gives a cloud without times those of this clock.
    pub(super) fn set_times(&mut self, number: usize, clock: &AzimuthClock) {
        if let Some(Frame { map_points: MapPoints::Cloud(cloud), .. }) = self.frames.get_mut(number) {
            cloud.times.get_or_insert_with(|| clock.times(&cloud.positions));
        }
    }

    /// Takes points out of a frame; how many there were.
    pub(super) fn take_out(&mut self, number: usize, is_out: impl Fn(&Vec3) -> bool) -> usize {
        let Some(Frame { map_points: MapPoints::Cloud(cloud), .. }) = self.frames.get_mut(number) else { return 0 };
        let kept: Vec<usize> = (0..cloud.len()).filter(|&point| !is_out(&cloud.positions[point])).collect();
        let num_out = cloud.len() - kept.len();
        if num_out > 0 {
            *cloud = cloud.selected(&kept);
        }
        num_out
    }

    /// Number of points of all frames that are clouds.
    pub(super) fn num_points(&self) -> usize {
        let of = |frame: &Frame| if let MapPoints::Cloud(cloud) = &frame.map_points { cloud.len() } else { 0 };
        self.frames.iter().map(of).sum()
    }

    pub(super) fn len(&self) -> usize {
        self.frames.len()
    }

    pub(super) fn last(&self) -> Option<&Frame> {
        self.frames.last()
    }

    pub(super) fn get(&self, index: usize) -> Option<&Frame> {
        self.frames.get(index)
    }

    pub(super) fn iter(&self) -> std::slice::Iter<'_, Frame> {
        self.frames.iter()
    }

    /// A note where the frames were thinned out.
    pub(super) fn note(&self) -> Option<String> {
        let share = 4usize.pow(u32::try_from(self.num_thinnings).unwrap_or(u32::MAX).min(10));
        (share > 1).then(|| {
            let count = self.frames.len();
            format!("To fit the memory, each of the {count} frames gives one point in {share} to the map; poses are not touched")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Pinhole;
    use crate::geometry::PointCloud;
    use crate::pipeline::spatial_settings::Quantisation;
    use crate::preprocess::map_image::MapImage;

    fn frame(index: usize, map_points: MapPoints) -> Frame {
        Frame::new(FrameLabel { name: index.to_string(), index, time: None }, map_points)
    }

    /// Depth from which the pixel follows.
    fn image(width: usize, height: usize) -> MapImage {
        let camera = Pinhole::from_field_of_view(width, height, 1.0).unwrap();
        let size = width * height;
        let depths = (0..size).map(|index| 1000 + (index % 60_000) as u16).collect();
        MapImage { camera, unit: 1e-3, depths, normals: vec![[0; 3]; size], colors: Some(vec![[1, 2, 3]; size]) }
    }

    #[test]
    fn what_is_kept_is_bounded_and_is_a_part_of_what_came() {
        let mut kept = StoredFrames::default();
        let whole = image(1024, 768);
        let of_one = MapPoints::Image(whole.clone(), Quantisation::Rounded).num_bytes();
        let (mut num_thinned, total) = (0, 3 * MOST_BYTES / of_one);
        for index in 0..total {
            num_thinned += usize::from(kept.push(frame(index, MapPoints::Image(whole.clone(), Quantisation::Rounded))));
            assert!(kept.num_bytes <= MOST_BYTES);
        }
        assert_eq!((kept.len(), num_thinned), (total, 1));
        assert!(kept.note().unwrap().contains("one point in 4"));
        let everything = whole.cloud(0.0).positions;
        let near = |point: &Vec3| everything.iter().any(|other| other.distance(*point) < 1e-4);
        for index in [0, 1, 2, 3, total - 1] {
            let Some(Frame { map_points: MapPoints::Image(thin, _), .. }) = kept.get(index) else { panic!("no image") };
            assert_eq!(thin.depths.len(), whole.depths.len() / 4);
            let points = thin.cloud(0.0).positions;
            // The same points in space: the camera of the fewer pixels is the right one.
            assert!(points.iter().step_by(30_011).all(near), "frame {index}");
        }
        let first_depths = (0..4).map(|index| match &kept.get(index).unwrap().map_points {
            MapPoints::Image(thin, _) => thin.depths[0],
            MapPoints::Cloud(_) => 0,
        });
        assert_eq!(first_depths.collect::<Vec<_>>(), [1000, 1001, 2024, 2025], "frames fill each other's gaps");
    }

    #[test]
    fn few_frames_are_kept_as_they_are() {
        let mut kept = StoredFrames::default();
        let whole = image(320, 240);
        assert!(!kept.push(frame(0, MapPoints::Image(whole.clone(), Quantisation::Rounded))));
        assert!(matches!(&kept.get(0).unwrap().map_points, MapPoints::Image(image, _) if *image == whole));
        assert_eq!(kept.note(), None);
    }

    #[test]
    fn clouds_lose_three_points_in_four() {
        let positions = (0..10).map(|x| Vec3::new(x as f32, 0.0, 0.0)).collect();
        let mut points = MapPoints::Cloud(PointCloud { positions, ..PointCloud::default() });
        points.thin(2, 0);
        let MapPoints::Cloud(cloud) = points else { panic!("no cloud") };
        assert_eq!(cloud.positions.iter().map(|p| p.x).collect::<Vec<_>>(), [2.0, 6.0]);
    }
}
