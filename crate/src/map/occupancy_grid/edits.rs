//! Grids edited by hand: shapes painted in them, and what lies outside a shape cut off.
//!
//! A cell belongs to a shape where its centre lies in it.

use std::f64::consts::SQRT_2;

use nalgebra::Vector2;

use super::{Cell, MAX_LOG_ODDS, OccupancyGrid};
use crate::geometry::{Pose2, RigidMotion};

/// What is painted or kept, in the world (m).
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// All within half of `width` (m) of the straight line between two points, and at least all cells that the line passes through: a
    /// wall that is drawn so has no gaps.
    Line {
        /// Where it begins and ends.
        ends: [Vector2<f64>; 2],
        /// Its width (m).
        width: f64,
    },
    /// The inside of a closed line through these corners, by the even-odd rule.
    Polygon(Vec<Vector2<f64>>),
}

impl Shape {
    /// The rectangle along the axes with these opposite corners.
    pub fn rectangle([a, b]: [Vector2<f64>; 2]) -> Self {
        Self::Polygon(vec![a, Vector2::new(b.x, a.y), b, Vector2::new(a.x, b.y)])
    }

    /// The shape moved.
    #[must_use]
    pub fn moved(&self, motion: &Pose2) -> Self {
        self.with_points(|point| motion.act(point))
    }

    fn with_points(&self, moved: impl Fn(&Vector2<f64>) -> Vector2<f64>) -> Self {
        match self {
            Self::Line { ends: [a, b], width } => Self::Line { ends: [moved(a), moved(b)], width: *width },
            Self::Polygon(corners) => Self::Polygon(corners.iter().map(moved).collect()),
        }
    }

    /// Its bounds: smallest and largest coordinates.
    fn bounds(&self) -> [Vector2<f64>; 2] {
        let (points, around): (&[Vector2<f64>], f64) = match self {
            Self::Line { ends, width } => (ends, width / 2.0),
            Self::Polygon(corners) => (corners, 0.0),
        };
        let low = points.iter().fold(Vector2::repeat(f64::INFINITY), |low, point| low.inf(point));
        let high = points.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, point| high.sup(point));
        [low.add_scalar(-around), high.add_scalar(around)]
    }

    fn contains(&self, point: &Vector2<f64>) -> bool {
        match self {
            Self::Line { ends: [a, b], width } => {
                let along = b - a;
                let share = ((point - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (point - a - along * share).norm() <= width / 2.0
            }
            Self::Polygon(corners) => {
                let is_crossed = |(a, b): (&Vector2<f64>, &Vector2<f64>)| {
                    (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
                };
                let edges = corners.iter().zip(corners.iter().cycle().skip(1));
                edges.filter(|edge| is_crossed(*edge)).count() % 2 == 1
            }
        }
    }
}

impl OccupancyGrid {
    /// Makes the cells of a shape what they are said to be, whatever the beams say. Whether there is one in the grid.
    pub fn paint(&mut self, shape: &Shape, cell: Cell) -> bool {
        let painted = match cell {
            Cell::Free => -MAX_LOG_ODDS,
            Cell::Occupied => MAX_LOG_ODDS,
            Cell::Unknown => 0.0,
        };
        let mut log_odds = std::mem::take(&mut self.log_odds);
        let mut is_painted = false;
        self.visit(shape, |x, y| {
            log_odds[y * self.width + x] = painted;
            is_painted = true;
        });
        self.log_odds = log_odds;
        is_painted
    }

    /// Keeps the cells of a shape: the others are unknown, and the grid ends with the last of those that are kept. Whether there is one;
    /// otherwise the grid stays.
    pub fn crop(&mut self, shape: &Shape) -> bool {
        let (mut low, mut high) = (Vector2::repeat(usize::MAX), Vector2::repeat(0));
        self.visit(shape, |x, y| {
            (low.x, low.y) = (low.x.min(x), low.y.min(y));
            (high.x, high.y) = (high.x.max(x), high.y.max(y));
        });
        if low.x > high.x {
            return false;
        }
        let (width, height) = (high.x - low.x + 1, high.y - low.y + 1);
        let mut log_odds = vec![0.0; width * height];
        self.visit(shape, |x, y| log_odds[(y - low.y) * width + x - low.x] = self.log_odds[y * self.width + x]);
        self.origin = self.T_world_grid().act(&(low.map(|cells| cells as f64) * self.resolution));
        (self.width, self.height, self.log_odds) = (width, height, log_odds);
        true
    }

    /// Visits the cells of a shape, by column and row.
    fn visit(&self, shape: &Shape, mut visit: impl FnMut(usize, usize)) {
        let T_grid_world = self.T_world_grid().inverse();
        let mut in_cells = shape.with_points(|point| T_grid_world.act(point) / self.resolution);
        if let Shape::Line { width, .. } = &mut in_cells {
            // The centre of a cell that the line passes through is at most half the cell's diagonal away.
            *width = (*width / self.resolution).max(SQRT_2);
        }
        let [low, high] = in_cells.bounds();
        let range =
            |axis: usize, size: usize| (low[axis].max(0.0) as usize)..(high[axis].max(0.0).ceil() as usize).min(size);
        let columns = range(0, self.width);
        for y in range(1, self.height) {
            let is_inside = |x: &usize| in_cells.contains(&Vector2::new(*x as f64 + 0.5, y as f64 + 0.5));
            columns.clone().filter(is_inside).for_each(|x| visit(x, y));
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitComplex;

    use super::*;

    /// 40 by 30 unknown cells of 0.1 m from (-1, -1).
    fn blank(yaw: f64) -> OccupancyGrid {
        let (width, height) = (40, 30);
        let log_odds = vec![0.0; width * height];
        OccupancyGrid {
            resolution: 0.1,
            origin: Vector2::new(-1.0, -1.0),
            yaw,
            width,
            height,
            log_odds,
            ..Default::default()
        }
    }

    fn count(grid: &OccupancyGrid, cell: Cell) -> usize {
        (0..grid.width * grid.height).filter(|i| grid.cell(i % grid.width, i / grid.width) == cell).count()
    }

    #[test]
    fn rectangles_and_polygons_cover_the_cells_with_their_centres_in_them() {
        let mut grid = blank(0.0);
        assert!(grid.paint(&Shape::rectangle([Vector2::new(1.0, 1.0), Vector2::new(0.0, 0.5)]), Cell::Occupied));
        assert_eq!(count(&grid, Cell::Occupied), 10 * 5);
        assert_eq!(
            [grid.cell(10, 15), grid.cell(19, 19), grid.cell(20, 19), grid.cell(9, 15)],
            [Cell::Occupied, Cell::Occupied, Cell::Unknown, Cell::Unknown]
        );
        let triangle = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| Vector2::new(x, y));
        assert!(grid.paint(&Shape::Polygon(triangle.to_vec()), Cell::Free));
        assert!((45..=55).contains(&count(&grid, Cell::Free)), "half of 100 cells, but for those on the edge");
        assert!(!grid.paint(&Shape::rectangle([Vector2::repeat(50.0), Vector2::repeat(60.0)]), Cell::Free));
        assert!(
            !grid.paint(&Shape::rectangle([Vector2::repeat(0.01), Vector2::repeat(0.02)]), Cell::Free),
            "no centre"
        );
    }

    #[test]
    fn a_thin_line_has_no_gaps_in_any_direction_and_a_thick_one_its_width() {
        for degrees in (0..180).step_by(7) {
            let mut grid = blank(0.3);
            let along = UnitComplex::new(f64::from(degrees).to_radians()) * Vector2::new(0.8, 0.0);
            let middle = grid.T_world_grid().act(&Vector2::new(2.0, 1.5));
            let ends = [middle - along, middle + along];
            grid.paint(&Shape::Line { ends, width: 1e-3 }, Cell::Occupied);
            for step in 0..=1000 {
                let point = ends[0] + (ends[1] - ends[0]) * (f64::from(step) / 1000.0);
                let cell = grid.T_world_grid().inverse().act(&point) / grid.resolution;
                assert_eq!(grid.cell(cell.x as usize, cell.y as usize), Cell::Occupied, "{degrees} degrees");
            }
            assert!(count(&grid, Cell::Occupied) < 16 * 3, "{degrees} degrees");
        }
        let mut grid = blank(0.0);
        grid.paint(&Shape::Line { ends: [Vector2::zeros(), Vector2::new(2.0, 0.0)], width: 0.4 }, Cell::Occupied);
        let thick = (0..grid.height).filter(|&y| grid.cell(20, y) == Cell::Occupied).count();
        assert_eq!(thick, 4);
    }

    #[test]
    fn a_cropped_grid_keeps_its_cells_where_they_were() {
        for yaw in [0.0, -0.4] {
            let mut grid = blank(yaw);
            let at = |grid: &OccupancyGrid, x: usize, y: usize| {
                grid.T_world_grid().act(&(Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * grid.resolution))
            };
            let corner = at(&grid, 12, 7);
            grid.paint(&Shape::Line { ends: [corner, corner + Vector2::new(1e-9, 0.0)], width: 1e-9 }, Cell::Occupied);
            let kept = [(10, 5), (20, 5), (20, 15), (10, 15)].map(|(x, y)| at(&grid, x, y)).to_vec();
            assert!(grid.crop(&Shape::Polygon(kept)));
            assert!(
                (9..=11).contains(&grid.width) && (9..=11).contains(&grid.height),
                "{} {}",
                grid.width,
                grid.height
            );
            let found =
                (0..grid.width * grid.height).find(|i| grid.cell(i % grid.width, i / grid.width) == Cell::Occupied);
            let place = found.map(|i| at(&grid, i % grid.width, i / grid.width)).unwrap();
            assert!((place - corner).norm() < 0.11, "{place} {corner}");
            let before = grid.clone();
            assert!(!grid.crop(&Shape::rectangle([Vector2::repeat(90.0), Vector2::repeat(99.0)])));
            assert_eq!(grid, before);
        }
    }

    #[test]
    fn outside_of_a_slanted_crop_cells_are_unknown() {
        let mut grid = blank(0.0);
        grid.paint(&Shape::rectangle([Vector2::repeat(-2.0), Vector2::repeat(5.0)]), Cell::Free);
        let square = Shape::rectangle([Vector2::repeat(-0.5), Vector2::repeat(0.5)]);
        assert!(grid.crop(&square.moved(&Pose2::rotation(std::f64::consts::FRAC_PI_4))));
        assert_eq!(grid.cell(0, 0), Cell::Unknown);
        assert!((85..=115).contains(&count(&grid, Cell::Free)), "{}", count(&grid, Cell::Free));
        assert!((13..=15).contains(&grid.width), "{}", grid.width);
    }
}
