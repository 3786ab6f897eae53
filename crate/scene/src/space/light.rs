//! Light sources.

use nalgebra::Vector3;

use super::material::Color;

/// A source that is not a point, so its shadows are soft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// A ball that shines all round.
    Lamp {
        /// Its middle (m).
        center: Vector3<f64>,
        /// Its radius (m).
        radius: f64,
        /// Light at a distance of 1 m, on a surface that faces it.
        power: Color,
    },
    /// A window that daylight comes in by.
    Window {
        /// Its middle (m).
        center: Vector3<f64>,
        /// Half its width, along the wall.
        across: Vector3<f64>,
        /// Half its height, upwards.
        up: Vector3<f64>,
        /// Unit vector into the room.
        inwards: Vector3<f64>,
        /// Light of the sky.
        radiance: Color,
    },
}

/// Light from far away in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Unit vector towards it.
    pub direction: Vector3<f64>,
    /// Light on a surface that faces it.
    pub irradiance: Color,
}

/// Light that would reach a surface from one point of a source, were nothing in between.
pub struct Arriving {
    /// From the surface to the point of the source (m).
    pub path: Vector3<f64>,
    /// Irradiance, or zero where the surface faces away.
    pub irradiance: Color,
}

impl Light {
    /// From a point of the source picked by `a` and `b`, both of [0, 1), to a point of a surface with this normal.
    pub fn towards(&self, point: &Vector3<f64>, normal: &Vector3<f64>, [a, b]: [f64; 2]) -> Arriving {
        match self {
            Self::Lamp { center, radius, power } => {
                let aim = center - point;
                let (u, v) = across(&aim);
                // A disc that faces the surface (the square's corners cut): ball and disc look alike.
                let path = aim + (u * (2.0 * a - 1.0) + v * (2.0 * b - 1.0)) * (0.8 * radius);
                let sq_distance = aim.norm_squared() + radius * radius;
                let cosine = (normal.dot(&aim) / aim.norm()).max(0.0);
                Arriving { path, irradiance: power * (cosine / sq_distance) }
            }
            Self::Window { center, across, up, inwards, radiance } => {
                let path = center + across * (2.0 * a - 1.0) + up * (2.0 * b - 1.0) - point;
                let sq_distance = path.norm_squared();
                let area = 4.0 * across.norm() * up.norm();
                let cosines = normal.dot(&path).max(0.0) * (-inwards.dot(&path)).max(0.0);
                // Seen whole, a window fills no more than the half space.
                let fills = (area * cosines / (sq_distance * (sq_distance + 0.3 * area))).min(1.5);
                Arriving { path, irradiance: radiance * fills }
            }
        }
    }
}

/// Two unit vectors that span the plane across `axis`.
pub fn across(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let other = if axis.z.abs() < 0.9 * axis.norm() { Vector3::z() } else { Vector3::x() };
    let u = axis.cross(&other).normalize();
    (u, axis.cross(&u).normalize())
}
