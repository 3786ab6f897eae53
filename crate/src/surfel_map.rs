//! A map of pieces of surface: what a depth frame is matched with, and what it is added to.
//!
//! Keller et al., "Real-time 3D reconstruction in dynamic scenes using point-based fusion", 3DV 2013: a piece that was
//! seen before is averaged by its certainty, one that was not is added.

use crate::camera::Pinhole;
use crate::camera::surfel_image::{Surfel, SurfelImage};
use crate::geometry::Pose3;
use crate::registration::projective::ProjectiveTarget;
use crate::registration::target::Target;

/// Pieces of surface in the world frame.
#[derive(Debug, Clone, Default)]
pub struct SurfelMap {
    surfels: Vec<Surfel>,
}

/// Views reach beyond the image by this share of its size on every side: the map goes on where the image ends.
const MARGIN: f64 = 0.25;
/// Pieces of one surface are at least this far apart (m).
const SPACING: f64 = 0.025;
/// Pieces whose normals differ by more (cosine) are of different surfaces.
const SAME_SURFACE_COSINE: f64 = 0.9;
/// Pieces further apart than this along the normal (m), beyond their own uncertainty, are of different surfaces.
const SAME_SURFACE_DISTANCE: f64 = 0.03;
/// Poses are no better than this: a surface seen often is not known better (m).
const MIN_DEVIATION: f64 = 2e-3;

impl SurfelMap {
    /// A map without anything in it.
    pub fn new() -> Self {
        Self::default()
    }

    /// Everything in it, world frame.
    pub fn surfels(&self) -> &[Surfel] {
        &self.surfels
    }

    /// Whether nothing has been added.
    pub fn is_empty(&self) -> bool {
        self.surfels.is_empty()
    }

    /// The map as seen from `T_world_view` with cells like those of `frame`, and some beyond its border.
    pub fn view(&self, frame: &SurfelImage, T_world_view: &Pose3) -> ProjectiveTarget {
        ProjectiveTarget::draw(self.surfels.iter(), &with_margin(&frame.cell_camera()), T_world_view)
    }

    /// Adds a frame at its pose; `view` is the map as seen from about there.
    pub fn insert(&mut self, frame: &SurfelImage, T_world_camera: &Pose3, view: &ProjectiveTarget) {
        let cell_width = 1.0 / frame.cell_camera().fx;
        for surfel in frame.surfels() {
            let moved = Surfel {
                point: T_world_camera * nalgebra::Point3::from(surfel.point) - nalgebra::Point3::origin(),
                normal: T_world_camera * surfel.normal,
                ..*surfel
            };
            let reach = SPACING.max(cell_width * surfel.point.z);
            match view.nearest(&moved.point, 2.0 * reach) {
                Some(neighbor) => {
                    let known = &mut self.surfels[view.origin(neighbor.index)];
                    let offset = moved.point - known.point;
                    let across = known.normal.dot(&offset);
                    let same = known.normal.dot(&moved.normal) > SAME_SURFACE_COSINE
                        && across.abs() < SAME_SURFACE_DISTANCE + 2.0 * known.deviation.hypot(moved.deviation);
                    if same {
                        average(known, &moved, across);
                    } else if neighbor.sq_distance as f64 > reach * reach {
                        self.surfels.push(moved);
                    }
                }
                None => self.surfels.push(moved),
            }
        }
    }
}

/// The known piece moves along its normal only: where on the surface it lies is as good as any other place.
fn average(known: &mut Surfel, seen: &Surfel, across: f64) {
    let (known_weight, seen_weight) = (known.deviation.powi(-2), seen.deviation.powi(-2));
    let share = seen_weight / (known_weight + seen_weight);
    known.point += known.normal * (across * share);
    known.normal = (known.normal * (1.0 - share) + seen.normal * share).normalize();
    known.deviation = (known_weight + seen_weight).powf(-0.5).max(MIN_DEVIATION);
}

fn with_margin(camera: &Pinhole) -> Pinhole {
    let (columns, rows) =
        ((camera.width as f64 * MARGIN).round() as usize, (camera.height as f64 * MARGIN).round() as usize);
    Pinhole {
        width: camera.width + 2 * columns,
        height: camera.height + 2 * rows,
        cx: camera.cx + columns as f64,
        cy: camera.cy + rows as f64,
        ..*camera
    }
}
