//! A map in space flattened to a grid, on a furnished flat whose solids tell what stands in the band.

use std::borrow::Cow;

use glam::Vec3;
use nalgebra::{Vector2, Vector3};
use scanstitch::camera::Pinhole;
use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
use scanstitch::map::occupancy_grid::{Cell, OccupancyGrid};
use scanstitch_scene::apartment::{Apartment, WalkOptions};

const BAND: [f64; 2] = [0.2, 1.8];
const SIDE: f64 = 0.05;

/// The cloud of each frame of a walk through the flat, without noise.
fn frames(apartment: &Apartment) -> Vec<(PointCloud, Pose3)> {
    let camera = Pinhole::from_field_of_view(128, 96, 70f64.to_radians()).unwrap();
    let cloud = |T: &Pose3| {
        let depth = apartment.space.depth(T, &camera);
        let points = (0..depth.len()).filter(|&pixel| depth[pixel].is_finite()).map(|pixel| {
            let (u, v) = ((pixel % camera.width) as f64, (pixel / camera.width) as f64);
            let point = camera.ray(u, v) * depth[pixel];
            Vec3::new(point.x as f32, point.y as f32, point.z as f32)
        });
        PointCloud::from_positions(points.collect())
    };
    let walk = apartment.walk(&WalkOptions { step: 0.25, ..WalkOptions::default() });
    walk.iter().map(|T| (cloud(T), *T)).collect()
}

fn index(grid: &OccupancyGrid, place: &Vector2<f64>) -> [isize; 2] {
    let along = (place - grid.origin) / grid.resolution;
    [along.x.floor() as isize, along.y.floor() as isize]
}

fn cell(grid: &OccupancyGrid, [x, y]: [isize; 2]) -> Cell {
    let at =
        usize::try_from(x).ok().filter(|&x| x < grid.width).zip(usize::try_from(y).ok().filter(|&y| y < grid.height));
    at.map_or(Cell::Unknown, |(x, y)| grid.cell(x, y))
}

/// A cell and those beside it.
fn around([x, y]: [isize; 2]) -> [[isize; 2]; 9] {
    std::array::from_fn(|i| [x + i.cast_signed() % 3 - 1, y + i.cast_signed() / 3 - 1])
}

fn center(grid: &OccupancyGrid, x: usize, y: usize) -> Vector2<f64> {
    grid.origin + Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * grid.resolution
}

/// Whether a surface stands in the band within `reach` of a place: level rays at every 5 cm of height and upright ones, a centimetre apart, from both
/// sides.
fn stands(apartment: &Apartment, place: &Vector2<f64>, reach: f64) -> bool {
    let across =
        |count: usize, low: f64, high: f64| (0..=count).map(move |i| low + (high - low) * i as f64 / count as f64);
    let count = (2.0 * reach / 0.01) as usize;
    let is_met = |from: Vector3<f64>, way: Vector3<f64>| {
        [(from, way), (from + way, -way)]
            .iter()
            .any(|(from, way)| apartment.space.cast(from, way).is_some_and(|hit| hit.distance <= 1.0))
    };
    across(count, -reach, reach).any(|off| {
        let level = across(32, BAND[0], BAND[1]).any(|z| {
            is_met(Vector3::new(place.x - reach, place.y + off, z), Vector3::new(2.0 * reach, 0.0, 0.0))
                || is_met(Vector3::new(place.x + off, place.y - reach, z), Vector3::new(0.0, 2.0 * reach, 0.0))
        });
        let upright = across(count, -reach, reach).any(|other| {
            let from = Vector3::new(place.x + off, place.y + other, BAND[0]);
            is_met(from, Vector3::new(0.0, 0.0, BAND[1] - BAND[0]))
        });
        level || upright
    })
}

#[test]
fn a_flat_is_occupied_where_it_has_walls_and_furniture_and_free_where_nothing_stands() {
    let apartment = Apartment::generate(3);
    let frames = frames(&apartment);
    let placed = frames.iter().map(|(cloud, T)| (Cow::Borrowed(cloud), *T));
    let grid = OccupancyGrid::flattened(placed, BAND, SIDE);
    assert_eq!(grid.resolution, SIDE);

    // Each point that was measured in the band is in an occupied cell, or beside one.
    let points = frames
        .iter()
        .flat_map(|(cloud, T)| cloud.positions.iter().map(|point| T.act(&Vector3::from(point.as_dvec3().to_array()))));
    let (mut num_points, mut num_off, mut num_beside) = (0, 0, 0);
    for point in points.filter(|point| (BAND[0]..BAND[1]).contains(&point.z)) {
        let [x, y] = index(&grid, &point.xy());
        num_points += 1;
        num_beside += usize::from(cell(&grid, [x, y]) != Cell::Occupied);
        num_off += usize::from(!around([x, y]).into_iter().any(|other| cell(&grid, other) == Cell::Occupied));
    }
    println!("{num_points} points, {num_beside} beside, {num_off} off");
    assert!(num_off as f64 <= 1e-3 * num_points as f64, "{num_off} of {num_points} points are in no occupied cell");

    // Each occupied cell has something standing in it or beside it, and nothing stands in free cells, but at the edge
    // of what is occupied.
    let (mut num_occupied, mut num_empty, mut num_free, mut num_in_walls, mut num_standing) = (0, 0, 0, 0, 0);
    let half = SIDE / 2.0;
    for y in 0..grid.height {
        for x in 0..grid.width {
            let place = center(&grid, x, y);
            match grid.cell(x, y) {
                Cell::Occupied => {
                    num_occupied += 1;
                    num_empty += usize::from(!stands(&apartment, &place, 3.0 * half));
                }
                Cell::Free => {
                    num_free += 1;
                    num_in_walls += usize::from(is_in_wall(&apartment, &place));
                    let cells = around([x.cast_signed(), y.cast_signed()]);
                    let is_beside = cells.into_iter().any(|other| cell(&grid, other) == Cell::Occupied);
                    num_standing += usize::from(!is_beside && stands(&apartment, &place, half));
                }
                Cell::Unknown => {}
            }
        }
    }
    println!(
        "{num_occupied} occupied, {num_empty} of them empty; {num_free} free, {num_standing} with something, {num_in_walls} in walls"
    );
    assert!(num_occupied > 2000 && num_free > 10_000);
    assert_eq!((num_empty, num_in_walls), (0, 0));
    // 74 of 24,089: tops of furniture, of which so coarse an image has few points, over floor that is seen.
    assert!(200 * num_standing < num_free, "{num_standing} of {num_free} free cells are not");
}

/// Whether a place is more than a cell deep in a wall.
fn is_in_wall(apartment: &Apartment, place: &Vector2<f64>) -> bool {
    let plan = &apartment.plan;
    let is_open = plan.rooms.iter().any(|room| room.inner().distance(place) <= SIDE)
        || plan.openings.iter().any(|opening| opening.approach(0.3).distance(place) <= SIDE);
    !is_open
}
