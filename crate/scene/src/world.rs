//! A floor plan of walls, boxes and pillars, with exact ray casting.

use nalgebra::Vector2;

use scanstitch::geometry::{Pose2, RigidMotion};

/// Something that a planar laser sees.
#[derive(Debug, Clone, PartialEq)]
pub enum Obstacle {
    /// A straight wall between two points (m).
    Wall {
        /// One end.
        from: Vector2<f64>,
        /// The other end.
        to: Vector2<f64>,
    },
    /// A round pillar.
    Pillar {
        /// Centre (m).
        center: Vector2<f64>,
        /// Radius (m).
        radius: f64,
    },
}

/// Obstacles in the plane.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct World {
    /// All obstacles.
    pub obstacles: Vec<Obstacle>,
}

impl World {
    /// Adds walls from corner to corner.
    pub fn add_walls(&mut self, corners: &[Vector2<f64>]) {
        let walls = corners.windows(2).map(|pair| Obstacle::Wall { from: pair[0], to: pair[1] });
        self.obstacles.extend(walls);
    }

    /// Adds a box by its centre, its sides (m) and the turn of the first side from x (rad).
    pub fn add_box(&mut self, center: Vector2<f64>, sides: Vector2<f64>, turn: f64) {
        let (sin, cos) = (libm::sin(turn), libm::cos(turn));
        let (along, across) = (Vector2::new(cos, sin) * (sides.x / 2.0), Vector2::new(-sin, cos) * (sides.y / 2.0));
        let corners = [-along - across, along - across, along + across, across - along, -along - across];
        self.add_walls(&corners.map(|corner| center + corner));
    }

    /// The same world in another frame.
    #[must_use]
    pub(super) fn moved(&self, T_target_source: &Pose2) -> Self {
        let moved = |obstacle: &Obstacle| match obstacle {
            Obstacle::Wall { from, to } => {
                Obstacle::Wall { from: T_target_source.act(from), to: T_target_source.act(to) }
            }
            Obstacle::Pillar { center, radius } => {
                Obstacle::Pillar { center: T_target_source.act(center), radius: *radius }
            }
        };
        Self { obstacles: self.obstacles.iter().map(moved).collect() }
    }

    /// The obstacles within `range` (m) of a point: all that a ray of that length can meet.
    #[must_use]
    pub fn within(&self, point: &Vector2<f64>, range: f64) -> Self {
        let near = |obstacle: &&Obstacle| obstacle.distance(point) <= range;
        Self { obstacles: self.obstacles.iter().filter(near).cloned().collect() }
    }

    /// Distance (m) from `origin` along the unit vector `direction` to the first obstacle; `None` where there is none.
    pub fn cast(&self, origin: &Vector2<f64>, direction: &Vector2<f64>) -> Option<f64> {
        self.obstacles.iter().filter_map(|obstacle| obstacle.cast(origin, direction)).min_by(f64::total_cmp)
    }

    /// Distance (m) from a point to the nearest obstacle's surface; infinite in an empty world.
    pub fn clearance(&self, point: &Vector2<f64>) -> f64 {
        self.obstacles.iter().map(|obstacle| obstacle.distance(point)).fold(f64::INFINITY, f64::min)
    }
}

impl Obstacle {
    fn cast(&self, origin: &Vector2<f64>, direction: &Vector2<f64>) -> Option<f64> {
        match self {
            // origin + range * direction = from + share * (to - from)
            Self::Wall { from, to } => {
                let (along, offset) = (to - from, from - origin);
                let determinant = direction.perp(&along);
                let (range, share) = (offset.perp(&along) / determinant, offset.perp(direction) / determinant);
                (range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
            }
            // |origin + range * direction - center| = radius, the nearer solution
            Self::Pillar { center, radius } => {
                let offset = center - origin;
                let (ahead, aside) = (offset.dot(direction), offset.perp(direction));
                let sq_depth = radius * radius - aside * aside;
                let range = ahead - sq_depth.max(0.0).sqrt();
                (sq_depth >= 0.0 && range > 0.0).then_some(range)
            }
        }
    }

    fn distance(&self, point: &Vector2<f64>) -> f64 {
        match self {
            Self::Wall { from, to } => {
                let along = to - from;
                let share = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (from + along * share - point).norm()
            }
            Self::Pillar { center, radius } => (center - point).norm() - radius,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_walls_boxes_and_pillars_where_geometry_says() {
        let x = Vector2::new(1.0, 0.0);
        let mut world = World::default();
        assert_eq!(world.cast(&Vector2::zeros(), &x), None);
        world.add_box(Vector2::new(5.0, 0.0), Vector2::new(2.0, 2.0), std::f64::consts::FRAC_PI_4);
        assert!((world.cast(&Vector2::zeros(), &x).unwrap() - (5.0 - 2f64.sqrt())).abs() < 1e-12);
        assert_eq!(world.cast(&Vector2::zeros(), &-x), None);
        world.obstacles.push(Obstacle::Pillar { center: Vector2::new(3.0, 0.3), radius: 0.5 });
        assert!((world.cast(&Vector2::zeros(), &x).unwrap() - (3.0 - 0.4)).abs() < 1e-12);
        assert!((world.cast(&Vector2::new(0.0, -0.3), &x).unwrap() - (5.0 - 2f64.sqrt() + 0.3)).abs() < 1e-12);
        assert!((world.clearance(&Vector2::new(3.0, 1.0)) - 0.2).abs() < 1e-12);
        assert!((world.clearance(&Vector2::new(9.0, 0.0)) - (4.0 - 2f64.sqrt())).abs() < 1e-12);
    }
}
