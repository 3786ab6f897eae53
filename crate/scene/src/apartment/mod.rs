//! A furnished flat of several rooms and a camera carried through it: a synthetic RGB-D recording of rooms
//! with exact poses and depths.
//!
//! ```
//! use scanstitch::camera::Pinhole;
//! use scanstitch_scene::apartment::{Apartment, WalkOptions};
//!
//! let apartment = Apartment::generate(3);
//! let walk = apartment.walk(&WalkOptions::default());
//! let camera = Pinhole::from_field_of_view(64, 64, std::f64::consts::FRAC_PI_2).unwrap();
//! let frame = apartment.space.render(&walk[0], &camera);
//! assert!(frame.depth.iter().all(|depth| depth.is_finite()));
//! ```

mod builder;
mod furniture;
mod place_furniture;
pub mod plan;
mod shell;
pub mod walk;
mod ways;

pub use plan::FloorPlan;
pub use walk::{CLEARANCE, Tour, WalkOptions};

use nalgebra::Vector3;

use super::random::Random;
use super::space::{Color, Space, Sun};
use builder::Builder;
use plan::{Opening, OpeningKind, RoomKind, Side};
use scanstitch::camera::Pinhole;
use scanstitch::geometry::Pose3;

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
        place_furniture::place_furniture(&plan, &mut builder);
        let sun = sun(&plan, &mut builder.random);
        let space = Space::new(builder.solids, builder.materials, builder.lights, sun);
        Self { plan, space, floors }
    }

    /// The point of the floor that the pixel (u, v) sees, `None` where it sees anything else.
    pub fn floor_seen_at(&self, T_world_camera: &Pose3, camera: &Pinhole, u: f64, v: f64) -> Option<Vector3<f64>> {
        let (solid, point) = self.space.seen_at(T_world_camera, camera, u, v)?;
        self.floors.contains(&solid).then_some(point)
    }
}

/// The sun, low enough to shine in by the windows of the living room.
fn sun(plan: &FloorPlan, random: &mut Random) -> Option<Sun> {
    let living = plan.room(RoomKind::Living)?;
    let side = Side::ALL.into_iter().find(|&side| {
        let french = |opening: &&Opening| opening.kind == OpeningKind::FrenchWindow;
        plan.openings.iter().filter(french).any(|opening| opening.is_in(living, side))
    })?;
    let outwards = side.sign();
    let (aside, up) =
        (random.uniform(0.35, 0.8) * if random.happens(0.5) { 1.0 } else { -1.0 }, random.uniform(0.55, 0.8));
    let (level, along) = (libm::cos(up) * libm::cos(aside) * outwards, libm::cos(up) * libm::sin(aside));
    let direction = if side.along() == 0 {
        Vector3::new(along, level, libm::sin(up))
    } else {
        Vector3::new(level, along, libm::sin(up))
    };
    Some(Sun { direction, irradiance: Color::new(2.1, 1.9, 1.6) })
}
