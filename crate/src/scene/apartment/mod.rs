//! A furnished flat of several rooms, and a camera that is carried through it: what RGB-D recordings of rooms look like,
//! with every pose and every depth known exactly.
//!
//! ```
//! use scanstitch::camera::Pinhole;
//! use scanstitch::scene::apartment::{Apartment, WalkOptions};
//!
//! let apartment = Apartment::generate(3);
//! let walk = apartment.walk(&WalkOptions::default());
//! let camera = Pinhole::from_field_of_view(64, 64, std::f64::consts::FRAC_PI_2).unwrap();
//! let frame = apartment.space.render(&walk[0], &camera);
//! assert!(frame.depth.iter().all(|depth| depth.is_finite()));
//! ```

mod builder;
mod furnish;
mod furniture;
pub mod plan;
mod shell;
pub mod walk;
mod ways;

pub use plan::FloorPlan;
pub use walk::{CLEARANCE, Tour, WalkOptions};

use nalgebra::Vector3;

use super::random::Random;
use super::space::{Color, Space, Sun};
use crate::camera::Pinhole;
use crate::geometry::Pose3;
use builder::Builder;

/// A flat. The floor is the plane z = 0, z points up, x and y are those of the plan.
#[derive(Debug, Clone)]
pub struct Apartment {
    /// Its rooms, doors and windows.
    pub plan: FloorPlan,
    /// Everything in it.
    pub space: Space,
    /// Which solids are floors.
    floors: Vec<usize>,
}

impl Apartment {
    /// A flat of four to six rooms and a corridor; each seed gives another plan, other furniture and other colours.
    pub fn generate(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let plan = FloorPlan::generate(&mut random);
        let mut builder = Builder::new(random);
        let floors = shell::build(&plan, &mut builder);
        furnish::furnish(&plan, &mut builder);
        let sun = sun(&mut builder.random);
        let space = Space::new(builder.solids, builder.materials, builder.lights, Some(sun));
        Self { plan, space, floors }
    }

    /// The point of the floor that the pixel (u, v) sees, `None` where it sees anything else.
    pub fn floor_seen_at(&self, T_world_camera: &Pose3, camera: &Pinhole, u: f64, v: f64) -> Option<Vector3<f64>> {
        let (solid, point) = self.space.seen_at(T_world_camera, camera, u, v)?;
        self.floors.contains(&solid).then_some(point)
    }
}

/// The sun in the morning or the afternoon, at a slant to all walls.
fn sun(random: &mut Random) -> Sun {
    let quarter = random.uniform(0.0, 4.0).floor() * std::f64::consts::FRAC_PI_2;
    let (around, up) = (quarter + random.uniform(0.4, 1.1), random.uniform(0.45, 0.7));
    let level = libm::cos(up);
    let direction = Vector3::new(level * libm::cos(around), level * libm::sin(around), libm::sin(up));
    Sun { direction, irradiance: Color::new(2.3, 2.05, 1.7) }
}
