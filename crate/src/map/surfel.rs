//! The surfel map: depth frames are registered to it and added to it.
//!
//! Keller et al., "Real-time 3D reconstruction in dynamic scenes using point-based fusion", 3DV 2013: a surfel that
//! has been measured before is averaged by the inverse variances, others are added.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::camera::Pinhole;
use crate::camera::surfel_image::{Surfel, SurfelImage};
use crate::geometry::{Pose3, RigidMotion};
use crate::preprocess::voxel_hash::VoxelHash;
use crate::registration::projective::{PackedSurfel, ProjectiveTarget, SurfelRasterizer};

/// Surfels in the world frame, in blocks of space: of a large map only the blocks in view are rendered.
#[derive(Debug, Clone)]
pub struct SurfelMap {
    /// Shared with clones of the map until one of them changes.
    blocks: Vec<Arc<Block>>,
    /// Indices of the blocks by their position.
    hash: VoxelHash,
}

/// The surfels of a block, each with the number of the frame that measured it first.
#[derive(Debug, Clone, Default)]
struct Block {
    center: Vector3<f64>,
    surfels: Vec<PackedSurfel>,
}

/// Side of a block (m).
const BLOCK_SIZE: f64 = 1.0;
/// Margin of a view beyond the image on every side, as a share of the image's size.
const VIEW_MARGIN: f64 = 0.25;
/// Depth up to which the map is always rendered (m).
const MIN_VIEW_DEPTH: f64 = 12.0;
/// Depth beyond the frame's largest up to which the map is rendered as well (m): a pose hypothesis may be off by a few metres.
const DEPTH_MARGIN: f64 = 4.0;
/// Stride of the cells of which the largest depth is taken.
const DEPTH_STRIDE: usize = 13;
/// Smallest distance between two surfels of one surface (m).
const MIN_SURFEL_SPACING: f64 = 0.025;
/// Cosine between two normals below which surfels belong to different surfaces.
const SAME_SURFACE_COSINE: f64 = 0.9;
/// Distance along the normal above which surfels belong to different surfaces (m), beyond their own uncertainty.
pub(crate) const SAME_SURFACE_DISTANCE: f64 = 0.03;
/// Smallest standard deviation of a surfel (m), since the errors of its frames' poses are correlated. With twice the value each
/// frame of a long recording displaces the map; with half of it the errors of the first frames persist.
const MIN_DEVIATION: f64 = 1e-3;

impl Default for SurfelMap {
    fn default() -> Self {
        Self { blocks: Vec::new(), hash: VoxelHash::new(BLOCK_SIZE) }
    }
}

impl SurfelMap {
    /// All surfels, world frame.
    #[cfg(test)]
    fn surfels(&self) -> impl Iterator<Item = Surfel> {
        self.blocks.iter().flat_map(|block| &block.surfels).map(PackedSurfel::surfel)
    }

    /// The map as seen from `T_world_view`, with cells like those of `frame` and a margin.
    pub fn view(&self, frame: &SurfelImage, T_world_view: &Pose3) -> ProjectiveTarget {
        let camera = with_margin(&frame.cell_camera());
        let depths = frame.cells.iter().step_by(DEPTH_STRIDE).flatten().map(|surfel| surfel.point.z);
        let max_depth = MIN_VIEW_DEPTH.max(depths.fold(0.0, f64::max) + DEPTH_MARGIN);
        let frustum = Frustum::new(&camera, T_world_view, max_depth);
        let mut rasterizer = SurfelRasterizer::new(&camera, T_world_view);
        for (number, block) in (0u64..).zip(&self.blocks) {
            if frustum.may_contain(&block.center) {
                rasterizer.add(number << 32, &block.surfels);
            }
        }
        rasterizer.finish()
    }

    /// Adds a frame by its number at its pose. `view` is this map as seen from about there, unchanged since.
    pub fn insert(&mut self, frame: &SurfelImage, number: u32, T_world_camera: &Pose3, view: &ProjectiveTarget) {
        let cell_width = 1.0 / frame.cell_camera().fx;
        let R = T_world_camera.rotation.to_rotation_matrix().into_inner();
        let t = T_world_camera.translation.vector;
        let (mut points, mut spacings) = (Vec::with_capacity(frame.cells.len()), Vec::with_capacity(frame.cells.len()));
        for surfel in frame.surfels() {
            points.push(R * surfel.point + t);
            spacings.push(MIN_SURFEL_SPACING.max(cell_width * surfel.point.z));
        }
        let mut surfels = frame.surfels();
        view.nearest_of_each(
            &points,
            |index| 2.0 * spacings[index],
            |index, neighbor| {
                let Some(surfel) = surfels.next() else { return };
                let moved = Surfel { point: points[index], normal: R * surfel.normal, ..*surfel };
                let Some(neighbor) = neighbor else { return self.add(moved, number) };
                let (block, place) = parts(view.number(neighbor.index));
                let Some(packed) = self.blocks.get(block).and_then(|block| block.surfels.get(place)).copied() else {
                    return;
                };
                let known = packed.surfel();
                let across = known.normal.dot(&(moved.point - known.point));
                let distance = SAME_SURFACE_DISTANCE + 2.0 * (known.sigma + moved.sigma);
                if known.normal.dot(&moved.normal) > SAME_SURFACE_COSINE && across.abs() < distance {
                    let averaged = averaged(&known, &moved, across);
                    Arc::make_mut(&mut self.blocks[block]).surfels[place] = PackedSurfel::new(&averaged, packed.tag);
                } else if f64::from(neighbor.sq_distance) > spacings[index] * spacings[index] {
                    self.add(moved, number);
                }
            },
        );
    }

    /// The frame that measured a surfel of a view first, by the surfel's number there.
    pub(crate) fn frame_of(&self, number: u64) -> Option<u32> {
        let (block, index) = parts(number);
        self.blocks.get(block)?.surfels.get(index).map(|packed| packed.tag)
    }

    /// Moves every surfel by the `motion` (of the world) of the frame that measured it first.
    pub fn apply_corrections(&mut self, motion: impl Fn(u32) -> Pose3) {
        let unmoved = std::mem::take(self);
        let mut last: Option<(u32, Pose3)> = None;
        for packed in unmoved.blocks.iter().flat_map(|block| &block.surfels) {
            let (surfel, frame) = (packed.surfel(), packed.tag);
            let (_, T) = *last.insert(last.filter(|(known, _)| *known == frame).unwrap_or((frame, motion(frame))));
            let point = <Pose3 as RigidMotion>::act(&T, &surfel.point);
            self.add(Surfel { point, normal: T.rotation * surfel.normal, ..surfel }, frame);
        }
    }

    fn add(&mut self, surfel: Surfel, frame: u32) {
        let Some(voxel) = self.hash.voxel(&surfel.point) else { return };
        let number = self.hash.insert(voxel) as usize;
        if number == self.blocks.len() {
            let center = Vector3::from(voxel).map(|x| (f64::from(x) + 0.5) * BLOCK_SIZE);
            self.blocks.push(Arc::new(Block { center, ..Block::default() }));
        }
        Arc::make_mut(&mut self.blocks[number]).surfels.push(PackedSurfel::new(&surfel, frame));
    }
}

/// The average of two surfels. The known one moves along its normal only: its position on the surface is arbitrary.
fn averaged(known: &Surfel, seen: &Surfel, across: f64) -> Surfel {
    let (known_weight, seen_weight) = (known.sigma.powi(-2), seen.sigma.powi(-2));
    let share = seen_weight / (known_weight + seen_weight);
    Surfel {
        point: known.point + known.normal * (across * share),
        normal: (known.normal * (1.0 - share) + seen.normal * share).normalize(),
        sigma: (known_weight + seen_weight).sqrt().recip().max(MIN_DEVIATION),
    }
}

/// The block of a number, and the index in it.
fn parts(number: u64) -> (usize, usize) {
    ((number >> 32) as usize, (number & u64::from(u32::MAX)) as usize)
}

fn with_margin(camera: &Pinhole) -> Pinhole {
    let margin = |size: usize| (size as f64 * VIEW_MARGIN).round() as usize;
    let (columns, rows) = (margin(camera.width), margin(camera.height));
    Pinhole {
        width: camera.width + 2 * columns,
        height: camera.height + 2 * rows,
        cx: camera.cx + columns as f64,
        cy: camera.cy + rows as f64,
        ..*camera
    }
}

/// The view frustum of a camera: four planes through it, and the largest depth.
struct Frustum {
    T_view_world: Pose3,
    /// Unit normals, inwards.
    sides: [Vector3<f64>; 4],
    /// Largest depth (m).
    max_depth: f64,
}

impl Frustum {
    fn new(camera: &Pinhole, T_world_view: &Pose3, max_depth: f64) -> Self {
        let (right, down) = (camera.width as f64 - 0.5, camera.height as f64 - 0.5);
        let corners = [(-0.5, -0.5), (right, -0.5), (right, down), (-0.5, down)].map(|(u, v)| camera.ray(u, v));
        // Clockwise on the image with y down: the product of a corner with the next points inwards.
        let sides = [0, 1, 2, 3].map(|side| corners[side].cross(&corners[(side + 1) % 4]).normalize());
        Self { T_view_world: T_world_view.inverse(), sides, max_depth }
    }

    /// Whether a block with this centre may intersect the frustum.
    fn may_contain(&self, center: &Vector3<f64>) -> bool {
        let center = <Pose3 as RigidMotion>::act(&self.T_view_world, center);
        let radius = BLOCK_SIZE * 3f64.sqrt() / 2.0;
        self.sides.iter().all(|side| side.dot(&center) > -radius)
            && (-radius..self.max_depth + radius).contains(&center.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::surfel_image::cell_camera;

    /// The image of a wall `distance` (m) ahead.
    fn wall(distance: f64, sigma: f64) -> SurfelImage {
        let camera = Pinhole::new(160, 120, [120.0, 120.0, 79.5, 59.5]).unwrap();
        let cells = cell_camera(&camera, 4);
        let surfel = |cell: usize| Surfel {
            point: cells.unproject((cell % cells.width) as f64, (cell / cells.width) as f64, distance),
            normal: -Vector3::z(),
            sigma,
        };
        let surfels = (0..cells.width * cells.height).map(|cell| Some(surfel(cell))).collect();
        let (columns, rows) = (cells.width, cells.height);
        SurfelImage { camera, cell_size: 4, columns, rows, cells: Arc::new(surfels), brightness: None }
    }

    fn len(map: &SurfelMap) -> usize {
        map.surfels().count()
    }

    fn insert(map: &mut SurfelMap, frame: &SurfelImage, T: &Pose3) {
        let view = map.view(frame, T);
        map.insert(frame, 0, T, &view);
    }

    #[test]
    fn a_surfel_measured_again_is_averaged_by_inverse_variance() {
        let mut map = SurfelMap::default();
        assert_eq!(len(&map), 0);
        insert(&mut map, &wall(2.0, 0.01), &Pose3::identity());
        let num_surfels = len(&map);
        assert_eq!(num_surfels, wall(2.0, 0.01).cells.len());
        insert(&mut map, &wall(2.009, 0.02), &Pose3::identity());
        assert_eq!(len(&map), num_surfels);
        for surfel in map.surfels() {
            let expected = (2.0 / 0.01f64.powi(2) + 2.009 / 0.02f64.powi(2)) / (0.01f64.powi(-2) + 0.02f64.powi(-2));
            assert!((surfel.point.z - expected).abs() < 1e-6);
            assert!((surfel.sigma - (0.01f64.powi(-2) + 0.02f64.powi(-2)).sqrt().recip()).abs() < 1e-9);
        }
    }

    #[test]
    fn another_surface_is_added() {
        let mut map = SurfelMap::default();
        insert(&mut map, &wall(2.0, 0.01), &Pose3::identity());
        let num_surfels = len(&map);
        insert(&mut map, &wall(1.5, 0.01), &Pose3::identity());
        assert_eq!(len(&map), 2 * num_surfels);
    }

    #[test]
    fn surfels_move_with_the_frame_that_measured_them_first() {
        let (mut map, at) = (SurfelMap::default(), [Pose3::identity(), Pose3::translation(0.0, 0.0, 5.0)]);
        for (number, T) in (0..).zip(&at) {
            let view = map.view(&wall(2.0, 0.01), T);
            map.insert(&wall(2.0, 0.01), number, T, &view);
        }
        let before: Vec<Surfel> = map.surfels().collect();
        map.apply_corrections(|frame| Pose3::translation(0.0, 0.0, 1.5 * f64::from(frame)));
        assert_eq!(len(&map), before.len());
        let at_depth = |z: f64| map.surfels().filter(|surfel| (surfel.point.z - z).abs() < 1e-6).count();
        assert_eq!((at_depth(2.0), at_depth(8.5)), (before.len() / 2, before.len() / 2));
        let (camera, T) = (wall(2.0, 0.01), Pose3::translation(0.0, 0.0, 6.5));
        assert_eq!(map.view(&camera, &T).len(), before.len() / 2, "blocks lie where their surfels are");
    }

    #[test]
    fn only_blocks_in_view_are_rendered_and_none_of_them_is_missing() {
        let mut map = SurfelMap::default();
        let frame = wall(2.0, 0.01);
        for turn in 0..12 {
            let T = <Pose3 as RigidMotion>::exp(&nalgebra::Vector6::new(
                0.0,
                f64::from(turn) * 30f64.to_radians(),
                0.0,
                0.0,
                0.0,
                0.0,
            ));
            insert(&mut map, &frame, &T);
        }
        for turn in 0..36 {
            let tangent = nalgebra::Vector6::new(0.1, f64::from(turn) * 0.17, 0.0, 0.3, 0.1, -0.2);
            let T = <Pose3 as RigidMotion>::exp(&tangent);
            let surfels: Vec<Surfel> = map.surfels().collect();
            let everything = ProjectiveTarget::draw(surfels.iter(), &with_margin(&frame.cell_camera()), &T);
            assert_eq!(map.view(&frame, &T).len(), everything.len());
        }
    }
}
