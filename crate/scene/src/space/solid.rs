//! Solids: boxes, rounded boxes, round posts and ellipsoids, each with any position and rotation.

use nalgebra::{Matrix3, Vector3};

/// A convex body about its own origin (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A box.
    Cuboid {
        /// Half its sides.
        half: Vector3<f64>,
    },
    /// A box whose edges and corners are rounded.
    Rounded {
        /// Half its sides.
        half: Vector3<f64>,
        /// Radius of its edges, at most the smallest half side.
        radius: f64,
    },
    /// A round post along z that may taper: a cylinder, a cone, a lampshade.
    Post {
        /// Radius at its lower end.
        bottom: f64,
        /// Radius at its upper end.
        top: f64,
        /// Half its height.
        half_height: f64,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Half its axes.
        radii: Vector3<f64>,
    },
}

/// A shape in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// What it looks like about its own origin.
    pub shape: Shape,
    /// Its axes in the world.
    pub R_world_solid: Matrix3<f64>,
    /// Its origin in the world (m).
    pub center: Vector3<f64>,
    /// Index of its material.
    pub material: usize,
}

/// Newton's steps until a rounded box is hit or missed. At a grazing ray, where they only halve the way, this leaves
/// less than a nanometre.
const MAX_STEPS: usize = 40;
/// A point this near (m) lies on the surface.
const ON_SURFACE: f64 = 1e-12;

impl Shape {
    /// Lengths of the ray up to where it enters the body; `None` where it does not, or starts within.
    pub fn enter(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        match self {
            Self::Cuboid { half } => {
                let (enter, leave) = slabs(half, origin, direction);
                (enter <= leave && enter > 0.0).then_some(enter)
            }
            Self::Rounded { half, radius } => enter_rounded(half, *radius, origin, direction),
            Self::Post { bottom, top, half_height } => enter_post([*bottom, *top], *half_height, origin, direction),
            Self::Ellipsoid { radii } => {
                let (o, d) = (origin.component_div(radii), direction.component_div(radii));
                let (a, b, c) = (d.dot(&d), o.dot(&d), o.dot(&o) - 1.0);
                let root = b * b - a * c;
                if root < 0.0 {
                    return None;
                }
                Some((-b - root.sqrt()) / a).filter(|enter| *enter > 0.0)
            }
        }
    }

    /// Unit normal at a point of the surface.
    pub fn normal(&self, p: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Cuboid { half } => {
                let axis = p.component_div(half).iamax();
                Vector3::ith(axis, p[axis].signum())
            }
            Self::Rounded { half, radius } => {
                let core = half.map(|side| side - radius);
                rounded_gradient(&core, p).1
            }
            Self::Post { bottom, top, half_height } => {
                let across = (p.x * p.x + p.y * p.y).sqrt();
                let slope = (top - bottom) / (2.0 * half_height);
                let radius = f64::midpoint(*bottom, *top) + slope * p.z;
                if half_height - p.z.abs() < (radius - across).abs() {
                    Vector3::z() * p.z.signum()
                } else {
                    Vector3::new(p.x, p.y, -slope * across).normalize()
                }
            }
            Self::Ellipsoid { radii } => p.component_div(&radii.component_mul(radii)).normalize(),
        }
    }

    /// Half the sides of the box around it.
    pub fn half_extent(&self) -> Vector3<f64> {
        match self {
            Self::Cuboid { half } | Self::Rounded { half, .. } => *half,
            Self::Post { bottom, top, half_height } => {
                let radius = bottom.max(*top);
                Vector3::new(radius, radius, *half_height)
            }
            Self::Ellipsoid { radii } => *radii,
        }
    }
}

impl Solid {
    /// Lengths of a ray of the world up to where it enters.
    pub fn enter(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let o = self.R_world_solid.tr_mul(&(origin - self.center));
        self.shape.enter(&o, &self.R_world_solid.tr_mul(direction))
    }

    /// A point of the world in the solid's own frame.
    pub fn to_own_frame(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.R_world_solid.tr_mul(&(point - self.center))
    }

    /// Unit normal in the world at a point of the surface.
    pub fn normal(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.R_world_solid * self.shape.normal(&self.to_own_frame(point))
    }

    /// Lower and upper corner of the box around it, along the axes of the world.
    pub fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        let half = self.R_world_solid.abs() * self.shape.half_extent();
        (self.center - half, self.center + half)
    }
}

/// Where a ray enters and leaves the box of these half sides: it misses the box where it leaves before it enters.
fn slabs(half: &Vector3<f64>, origin: &Vector3<f64>, direction: &Vector3<f64>) -> (f64, f64) {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let inverse = 1.0 / direction[axis];
        let (near, far) = ((-half[axis] - origin[axis]) * inverse, (half[axis] - origin[axis]) * inverse);
        enter = enter.max(near.min(far));
        leave = leave.min(near.max(far));
    }
    (enter, leave)
}

/// Distance of a point from the core of a rounded box and the direction away from it.
fn rounded_gradient(core: &Vector3<f64>, p: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let beyond = p.zip_map(core, |p, core| p.signum() * (p.abs() - core).max(0.0));
    let distance = beyond.norm();
    (distance, beyond / distance.max(f64::MIN_POSITIVE))
}

/// The distance to a convex body is a convex function along a ray, so Newton's steps from outside never pass its root.
fn enter_rounded(half: &Vector3<f64>, radius: f64, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<f64> {
    let (enter, leave) = slabs(half, origin, direction);
    if enter > leave || leave <= 0.0 {
        return None;
    }
    let core = half.map(|side| side - radius);
    let mut at = enter;
    for _ in 0..MAX_STEPS {
        let (distance, away) = rounded_gradient(&core, &(origin + direction * at));
        let slope = away.dot(direction);
        let left = distance - radius;
        if left <= ON_SURFACE {
            return (at > 0.0).then_some(at);
        }
        if slope >= 0.0 {
            return None;
        }
        at -= left / slope;
        if at > leave {
            return None;
        }
    }
    None
}

fn enter_post([bottom, top]: [f64; 2], half_height: f64, o: &Vector3<f64>, d: &Vector3<f64>) -> Option<f64> {
    // x^2 + y^2 = (middle + slope z)^2
    let (middle, slope) = (f64::midpoint(bottom, top), (top - bottom) / (2.0 * half_height));
    let r = middle + slope * o.z;
    let a = d.x * d.x + d.y * d.y - slope * slope * d.z * d.z;
    let b = o.x * d.x + o.y * d.y - r * slope * d.z;
    let c = o.x * o.x + o.y * o.y - r * r;
    let root = b * b - a * c;
    let mut first = f64::INFINITY;
    if root >= 0.0 && a != 0.0 {
        for side in [-1.0, 1.0] {
            let at = (-b + side * root.sqrt()) / a;
            let z = o.z + at * d.z;
            // Into the body, not out of it on the far side or into the mirrored half of the cone.
            let inwards = a * at + b < 0.0;
            if at > 0.0 && inwards && z.abs() <= half_height && at < first {
                first = at;
            }
        }
    }
    for (z, radius) in [(-half_height, bottom), (half_height, top)] {
        let at = (z - o.z) / d.z;
        let (x, y) = (o.x + at * d.x, o.y + at * d.y);
        if at > 0.0 && d.z * z < 0.0 && x * x + y * y <= radius * radius && at < first {
            first = at;
        }
    }
    first.is_finite().then_some(first)
}

#[cfg(test)]
mod tests {
    use super::super::super::random::Random;
    use super::*;

    const SHAPES: [Shape; 5] = [
        Shape::Cuboid { half: Vector3::new(0.5, 0.3, 0.8) },
        Shape::Rounded { half: Vector3::new(0.5, 0.3, 0.8), radius: 0.12 },
        Shape::Post { bottom: 0.4, top: 0.4, half_height: 0.7 },
        Shape::Post { bottom: 0.6, top: 0.2, half_height: 0.5 },
        Shape::Ellipsoid { radii: Vector3::new(0.5, 0.9, 0.2) },
    ];

    /// How far outside the body a point lies, zero within.
    fn outside(shape: &Shape, p: &Vector3<f64>) -> f64 {
        match shape {
            Shape::Cuboid { half } => p.abs().zip_map(half, |p, half| (p - half).max(0.0)).max(),
            Shape::Rounded { half, radius } => {
                (rounded_gradient(&half.map(|side| side - radius), p).0 - radius).max(0.0)
            }
            Shape::Post { bottom, top, half_height } => {
                let share = (p.z + half_height) / (2.0 * half_height);
                let radius = bottom + share * (top - bottom);
                (p.xy().norm() - radius).max(p.z.abs() - half_height).max(0.0)
            }
            Shape::Ellipsoid { radii } => (p.component_div(radii).norm() - 1.0).max(0.0),
        }
    }

    #[test]
    fn rays_enter_where_marching_along_them_first_finds_the_body() {
        let mut random = Random::new(5);
        let mut coordinate = |reach: f64| random.uniform(-reach, reach);
        for shape in SHAPES {
            let mut hits = 0;
            for _ in 0..400 {
                let origin = Vector3::new(coordinate(3.0), coordinate(3.0), coordinate(3.0));
                if outside(&shape, &origin) == 0.0 {
                    continue;
                }
                let aim = Vector3::new(coordinate(0.6), coordinate(0.6), coordinate(0.8));
                let direction = aim - origin;
                let enter = shape.enter(&origin, &direction);
                let up_to = enter.unwrap_or(3.0);
                for step in 0..2000 {
                    let at = f64::from(step) * 1e-3;
                    if at < up_to - 1e-9 {
                        let p = origin + direction * at;
                        assert!(outside(&shape, &p) > 0.0, "{shape:?} is entered before {up_to}: {at}");
                    }
                }
                if let Some(enter) = enter {
                    hits += 1;
                    let p = origin + direction * enter;
                    let normal = shape.normal(&p);
                    assert!(outside(&shape, &p) < 1e-9 && normal.dot(&direction) < 1e-6, "{shape:?}");
                    assert!((normal.norm() - 1.0).abs() < 1e-12);
                    assert!(outside(&shape, &(p + normal * 1e-6)) > 0.0, "{shape:?}");
                    assert!(p.abs().zip_map(&shape.half_extent(), |p, half| p - half).max() < 1e-9);
                }
            }
            assert!(hits > 150, "{shape:?}: {hits}");
        }
    }

    #[test]
    fn known_distances() {
        let x = Vector3::x();
        let from = Vector3::new(-3.0, 0.0, 0.0);
        let expected = [2.5, 2.5, 2.6, 2.6, 2.5];
        for (shape, distance) in SHAPES.iter().zip(expected) {
            assert!((shape.enter(&from, &x).unwrap() - distance).abs() < 1e-12, "{shape:?}");
            assert_eq!(shape.enter(&from, &-x), None);
            assert_eq!(shape.enter(&Vector3::zeros(), &x), None);
        }
    }
}
