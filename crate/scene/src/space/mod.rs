//! A world of solids in space, and a camera in it: exact depth, and shaded colours.
//!
//! The world's z axis points up. Rays may have any length: the parameter of a hit counts lengths of the ray, so that with
//! rays of z = 1 in the camera's frame it is the depth itself.

pub mod depth_sensor;
mod hierarchy;
mod light;
pub mod material;
mod noise;
mod pattern;
pub mod render;
mod shading;
pub mod solid;
pub mod stereo_camera;

pub use depth_sensor::DepthSensor;
pub use light::{Light, Sun};
pub use material::{Color, Material, Pattern, srgb};
pub use render::RenderedFrame;
pub use solid::{Shape, Solid};

use nalgebra::Vector3;

use hierarchy::{Hierarchy, lies_between};

/// What a ray meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index of the solid.
    pub solid: usize,
    /// Lengths of the ray up to the surface.
    pub distance: f64,
}

/// Everything that can be seen, and the light it is seen in.
#[derive(Debug, Clone)]
pub struct Space {
    solids: Vec<Solid>,
    materials: Vec<Material>,
    lights: Vec<Light>,
    sun: Option<Sun>,
    hierarchy: Hierarchy,
}

impl Space {
    /// A world of these solids, whose `material` is an index into `materials`.
    pub fn new(solids: Vec<Solid>, materials: Vec<Material>, lights: Vec<Light>, sun: Option<Sun>) -> Self {
        let hierarchy = Hierarchy::new(&solids);
        Self { solids, materials, lights, sun, hierarchy }
    }

    /// All solids.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The material of a solid.
    pub fn material(&self, solid: &Solid) -> &Material {
        &self.materials[solid.material]
    }

    /// The first solid that a ray meets, `None` where there is none.
    pub fn cast(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        self.hierarchy.cast(&self.solids, origin, direction, None)
    }

    /// Whether something opaque lies on the way from `origin` to `origin + direction`. `last` is tried first, and is what
    /// was met: the next ray to the same light is likely to meet it, too.
    fn is_shaded(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, last: &mut Option<usize>) -> bool {
        if last.is_some_and(|solid| lies_between(&self.solids[solid], origin, direction)) {
            return true;
        }
        let casts_shadow = |solid: &Solid| self.materials[solid.material].casts_shadow;
        let met = self.hierarchy.meets(&self.solids, origin, direction, casts_shadow);
        *last = met.or(*last);
        met.is_some()
    }
}
