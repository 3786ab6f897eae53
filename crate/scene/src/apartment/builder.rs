//! Adds solids to the world, in the frame of a piece of furniture.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::super::random::Random;
use super::super::space::{Color, Light, Material, Shape, Solid};

/// Index of a material.
pub type Paint = usize;

/// Solids, materials and lamps of the world under construction.
pub struct Builder {
    pub solids: Vec<Solid>,
    pub materials: Vec<Material>,
    pub lights: Vec<Light>,
    pub random: Random,
}

/// Where a piece stands, and how it is turned: a piece looks along its y axis, z is up.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub origin: Vector3<f64>,
    pub turn: f64,
}

/// A piece that is being built.
pub struct Piece<'a> {
    pub builder: &'a mut Builder,
    R_world_own: Matrix3<f64>,
    origin: Vector3<f64>,
}

impl Builder {
    pub fn new(random: Random) -> Self {
        Self { solids: Vec::new(), materials: Vec::new(), lights: Vec::new(), random }
    }

    pub fn paint(&mut self, material: Material) -> Paint {
        let seed = (self.random.uniform(0.0, 1.0) * 1e9) as u64;
        self.materials.push(Material { seed, ..material });
        self.materials.len() - 1
    }

    /// One of these, all equally likely.
    pub fn choose<T: Copy>(&mut self, options: &[T]) -> T {
        let pick = self.random.uniform(0.0, options.len() as f64) as usize;
        options[pick.min(options.len() - 1)]
    }

    pub fn piece(&mut self, place: &Place) -> Piece<'_> {
        Piece { builder: self, R_world_own: about_z(place.turn), origin: place.origin }
    }

    /// A box along the axes of the world, from corner to corner.
    pub fn slab(&mut self, low: Vector3<f64>, high: Vector3<f64>, material: Paint) {
        let (low, high) = (low.inf(&high), low.sup(&high));
        let shape = Shape::Cuboid { half: (high - low) / 2.0 };
        let (R_world_solid, center) = (Matrix3::identity(), (low + high) / 2.0);
        self.solids.push(Solid { shape, R_world_solid, center, material });
    }
}

impl Place {
    /// On the floor.
    pub fn on_floor(at: Vector2<f64>, turn: f64) -> Self {
        Self { origin: Vector3::new(at.x, at.y, 0.0), turn }
    }
}

impl Piece<'_> {
    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.builder.random.uniform(low, high)
    }

    pub fn happens(&mut self, probability: f64) -> bool {
        self.builder.random.happens(probability)
    }

    pub fn paint(&mut self, material: Material) -> Paint {
        self.builder.paint(material)
    }

    pub fn choose<T: Copy>(&mut self, options: &[T]) -> T {
        self.builder.choose(options)
    }

    /// The same piece with its origin so far to the right and to the front.
    pub fn shifted(&mut self, [x, y]: [f64; 2]) -> Piece<'_> {
        let origin = self.at(x, y, 0.0);
        Piece { builder: self.builder, R_world_own: self.R_world_own, origin }
    }

    /// A point of the piece in the world.
    pub fn at(&self, x: f64, y: f64, z: f64) -> Vector3<f64> {
        self.origin + self.R_world_own * Vector3::new(x, y, z)
    }

    fn add(&mut self, shape: Shape, [x, y, z]: [f64; 3], R_piece_solid: Matrix3<f64>, material: Paint) {
        let (center, R_world_solid) = (self.at(x, y, z), self.R_world_own * R_piece_solid);
        self.builder.solids.push(Solid { shape, R_world_solid, center, material });
    }

    /// A box by its middle and its sides.
    pub fn cuboid(&mut self, center: [f64; 3], sides: [f64; 3], material: Paint) {
        let half = Vector3::from(sides) / 2.0;
        self.add(Shape::Cuboid { half }, center, Matrix3::identity(), material);
    }

    /// A box by the middle of its underside and its sides.
    pub fn standing(&mut self, [x, y, z]: [f64; 3], sides: [f64; 3], material: Paint) {
        self.cuboid([x, y, z + sides[2] / 2.0], sides, material);
    }

    /// A box with rounded edges, by its middle and its sides.
    pub fn rounded(&mut self, center: [f64; 3], sides: [f64; 3], radius: f64, material: Paint) {
        self.rounded_turned(center, sides, radius, [0.0; 2], material);
    }

    /// The same, leant back about x and then turned about z (rad).
    pub fn rounded_turned(
        &mut self,
        center: [f64; 3],
        sides: [f64; 3],
        radius: f64,
        [lean, turn]: [f64; 2],
        material: Paint,
    ) {
        let half = Vector3::from(sides) / 2.0;
        let radius = radius.min(half.min());
        self.add(Shape::Rounded { half, radius }, center, about_z(turn) * about_x(lean), material);
    }

    /// A box, leant back about x and then turned about z (rad).
    pub fn turned(&mut self, center: [f64; 3], sides: [f64; 3], [lean, turn]: [f64; 2], material: Paint) {
        let half = Vector3::from(sides) / 2.0;
        self.add(Shape::Cuboid { half }, center, about_z(turn) * about_x(lean), material);
    }

    /// An upright post by the middle of its underside.
    pub fn post(&mut self, bottom: [f64; 3], radius: f64, height: f64, material: Paint) {
        self.tapered(bottom, [radius, radius], height, material);
    }

    /// An upright post whose radius changes from the lower to the upper end.
    pub fn tapered(&mut self, [x, y, z]: [f64; 3], [bottom, top]: [f64; 2], height: f64, material: Paint) {
        let shape = Shape::Post { bottom, top, half_height: height / 2.0 };
        self.add(shape, [x, y, z + height / 2.0], Matrix3::identity(), material);
    }

    /// A rod from end to end.
    pub fn rod(&mut self, from: [f64; 3], to: [f64; 3], radius: f64, material: Paint) {
        let (from, to) = (Vector3::from(from), Vector3::from(to));
        let axis = to - from;
        let shape = Shape::Post { bottom: radius, top: radius, half_height: axis.norm() / 2.0 };
        let z = axis.normalize();
        let other = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let x = other.cross(&z).normalize();
        let R_piece_solid = Matrix3::from_columns(&[x, z.cross(&x), z]);
        let center = (from + to) / 2.0;
        self.add(shape, center.into(), R_piece_solid, material);
    }

    /// An ellipsoid by its middle and half its axes.
    pub fn ball(&mut self, center: [f64; 3], radii: [f64; 3], material: Paint) {
        self.ball_turned(center, radii, [0.0; 2], material);
    }

    /// An ellipsoid, leant back about x and then turned about z (rad).
    pub fn ball_turned(&mut self, center: [f64; 3], radii: [f64; 3], [lean, turn]: [f64; 2], material: Paint) {
        let shape = Shape::Ellipsoid { radii: radii.into() };
        self.add(shape, center, about_z(turn) * about_x(lean), material);
    }

    /// A lamp that shines from a place of the piece.
    pub fn lamp(&mut self, [x, y, z]: [f64; 3], radius: f64, power: Color) {
        let center = self.at(x, y, z);
        self.builder.lights.push(Light::Lamp { center, radius, power });
    }
}

fn about_z(angle: f64) -> Matrix3<f64> {
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}

fn about_x(angle: f64) -> Matrix3<f64> {
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    Matrix3::new(1.0, 0.0, 0.0, 0.0, cos, -sin, 0.0, sin, cos)
}
