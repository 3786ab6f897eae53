//! Holes of a surface, filled up to a stated size: the triangulation of the rim that has the least area (Barequet and Sharir, "Filling
//! gaps in the boundary of a polyhedron", CAGD 12, 1995), with a vertex of its own in each triangle, so that what is filled is known by
//! its vertices.

use glam::Vec3;
use rustc_hash::FxHashMap;

use crate::geometry::TriangleMesh;

/// Rims with more vertices are left: the triangulation takes the cube of their number, here 10 million steps.
const MAX_RIM: usize = 400;
/// Triangles with a smaller area than this share of the squares of their sides are slivers, 50 times as long as wide, as corners on a
/// straight rim make them.
const SLIVER: f32 = 0.01;

/// Fills the holes whose rims extend to `max_size` (m) at most, where no more than half of the filling was seen to be empty
/// (`is_seen_through`). Normals are left as they are.
pub(super) fn fill_holes(mesh: &mut TriangleMesh, max_size: f32, is_seen_through: impl Fn(Vec3) -> bool) {
    let num_measured = mesh.positions.len();
    for rim in rims(&mesh.triangles) {
        let Some(extent) = extent(mesh, &rim, max_size) else { continue };
        let filling = least_area(mesh, &rim);
        if is_hole(mesh, &rim, &filling) && !is_open(mesh, &filling, &is_seen_through) {
            fill(mesh, &filling, extent);
        }
    }
    if mesh.positions.len() > num_measured {
        mesh.filled = (0..mesh.positions.len()).map(|vertex| vertex >= num_measured).collect();
    }
}

/// The closed chains of edges that belong to one triangle alone, against its sense, no vertex twice in a chain.
fn rims(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut open: FxHashMap<[u32; 2], bool> = FxHashMap::default();
    for &[a, b, c] in triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let edge = [from.min(to), from.max(to)];
            if open.remove(&edge).is_none() {
                open.insert(edge, from < to);
            }
        }
    }
    let mut edges: Vec<[u32; 2]> =
        open.into_iter().map(|([low, high], is_rising)| if is_rising { [high, low] } else { [low, high] }).collect();
    edges.sort_unstable();
    chains(&edges)
}

/// Follows edges, which are in the order of their first vertices; where a chain meets itself, that part of it is closed.
fn chains(edges: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut is_used = vec![false; edges.len()];
    let mut closed = Vec::new();
    for start in 0..edges.len() {
        let (mut path, mut places): (Vec<u32>, FxHashMap<u32, usize>) = (Vec::new(), FxHashMap::default());
        let mut next = Some(start).filter(|&edge| !is_used[edge]);
        while let Some(edge) = next {
            is_used[edge] = true;
            let [from, to] = edges[edge];
            places.insert(from, path.len());
            path.push(from);
            if let Some(&place) = places.get(&to) {
                let part = path.split_off(place);
                for vertex in &part {
                    places.remove(vertex);
                }
                closed.push(part);
            }
            let first = edges.partition_point(|&[vertex, _]| vertex < to);
            next = (first..edges.len()).take_while(|&at| edges[at][0] == to).find(|&at| !is_used[at]);
        }
    }
    closed
}

/// Largest distance between two vertices of a rim (m); none where that exceeds `max_size`, or the rim is too long.
fn extent(mesh: &TriangleMesh, rim: &[u32], max_size: f32) -> Option<f32> {
    if !(3..=MAX_RIM).contains(&rim.len()) {
        return None;
    }
    let places = || rim.iter().map(|&vertex| mesh.positions[vertex as usize]);
    let square = places().flat_map(|a| places().map(move |b| a.distance_squared(b))).fold(0.0, f32::max);
    (square <= max_size * max_size).then(|| square.sqrt())
}

/// The triangles over a rim that have the least area together, without slivers where that is possible.
fn least_area(mesh: &TriangleMesh, rim: &[u32]) -> Vec<[u32; 3]> {
    let n = rim.len();
    let cost = |i: usize, k: usize, j: usize| {
        let [a, b, c] = [i, k, j].map(|at| mesh.positions[rim[at] as usize]);
        let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        let area = mesh.area([rim[i], rim[k], rim[j]]);
        if area < SLIVER * squares { area + squares } else { area }
    };
    // Of the part of the rim from i to j: the least cost, and the vertex between that makes the triangle with its ends.
    let mut best = vec![(0.0_f32, 0_usize); n * n];
    for length in 2..n {
        for i in 0..n - length {
            let j = i + length;
            let ways = (i + 1..j).map(|k| (best[i * n + k].0 + best[k * n + j].0 + cost(i, k, j), k));
            best[i * n + j] = ways.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
        }
    }
    let (mut triangles, mut parts) = (Vec::with_capacity(n - 2), vec![(0, n - 1)]);
    while let Some((i, j)) = parts.pop() {
        if j - i < 2 {
            continue;
        }
        let (_, k) = best[i * n + j];
        triangles.push([rim[i], rim[k], rim[j]]);
        parts.extend([(i, k), (k, j)]);
    }
    triangles
}

/// Whether the filling faces as its rim does: around an island, it would be the back of that.
fn is_hole(mesh: &TriangleMesh, rim: &[u32], filling: &[[u32; 3]]) -> bool {
    let of_rim: Vec3 = rim.iter().map(|&vertex| mesh.normals[vertex as usize]).sum();
    let facing = filling.iter().map(|triangle| {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        (b - a).cross(c - a)
    });
    facing.sum::<Vec3>().dot(of_rim) > 0.0
}

/// Whether more than half of the filling's area was seen to be empty.
fn is_open(mesh: &TriangleMesh, filling: &[[u32; 3]], is_seen_through: impl Fn(Vec3) -> bool) -> bool {
    let areas = filling.iter().map(|&triangle| (mesh.area(triangle), is_seen_through(center(mesh, triangle))));
    let (empty, all) = areas
        .fold((0.0, 0.0), |(empty, all), (area, is_empty)| (empty + if is_empty { area } else { 0.0 }, all + area));
    2.0 * empty > all
}

fn center(mesh: &TriangleMesh, triangle: [u32; 3]) -> Vec3 {
    triangle.iter().map(|&vertex| mesh.positions[vertex as usize]).sum::<Vec3>() / 3.0
}

/// Adds the filling, with a vertex in the middle of each triangle. Nothing is known of where the surface is in a hole: the deviation of
/// these vertices is half of the hole's extent.
fn fill(mesh: &mut TriangleMesh, filling: &[[u32; 3]], extent: f32) {
    for &triangle @ [a, b, c] in filling {
        let middle = mesh.positions.len() as u32;
        mesh.positions.push(center(mesh, triangle));
        mesh.deviations.push(extent / 2.0);
        if !mesh.colors.is_empty() {
            let sums =
                [0, 1, 2].map(|k| triangle.iter().map(|&at| u16::from(mesh.colors[at as usize][k])).sum::<u16>());
            mesh.colors.push(sums.map(|sum| (sum / 3) as u8));
        }
        mesh.triangles.extend([[a, b, middle], [b, c, middle], [c, a, middle]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of cells of 1 cm without those that `is_hole` names.
    fn sheet(side: u32, is_hole: impl Fn(u32, u32) -> bool) -> TriangleMesh {
        let vertex = |x: u32, y: u32| y * (side + 1) + x;
        let cells = (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).filter(|&(x, y)| !is_hole(x, y));
        let triangles = cells.flat_map(|(x, y)| {
            let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x + 1, y + 1), vertex(x, y + 1)];
            [[a, b, c], [a, c, d]]
        });
        let positions = (0..=side).flat_map(|y| (0..=side).map(move |x| Vec3::new(x as f32, y as f32, 0.0) / 100.0));
        let positions: Vec<Vec3> = positions.collect();
        let deviations = vec![1e-3; positions.len()];
        let mut mesh = TriangleMesh { positions, deviations, triangles: triangles.collect(), ..Default::default() };
        mesh.set_normals();
        mesh
    }

    fn area(mesh: &TriangleMesh) -> f32 {
        mesh.triangles.iter().map(|&triangle| mesh.area(triangle)).sum()
    }

    #[test]
    fn a_hole_is_filled_flat_with_its_own_vertices_and_the_outer_rim_is_none() {
        let mut mesh = sheet(12, |x, y| (3..8).contains(&x) && (4..7).contains(&y));
        let (num_vertices, num_triangles) = (mesh.positions.len(), mesh.triangles.len());
        fill_holes(&mut mesh, 0.3, |_| false);
        assert!((area(&mesh) - 0.12 * 0.12).abs() < 1e-6, "{}", area(&mesh));
        assert_eq!(mesh.filled.iter().position(|&is_filled| is_filled), Some(num_vertices));
        for (at, triangle) in mesh.triangles.iter().enumerate() {
            let is_filled = triangle.iter().any(|&vertex| mesh.filled[vertex as usize]);
            assert_eq!(is_filled, at >= num_triangles);
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            assert!((b - a).cross(c - a).z > 0.0, "faces as the rest does");
        }
        let extent = 0.05_f32.hypot(0.03);
        assert!((mesh.deviations[num_vertices] - extent / 2.0).abs() < 1e-6);
    }

    #[test]
    fn holes_that_are_larger_or_were_seen_through_stay() {
        let is_small = |x: u32, y: u32| x == 2 && y == 2;
        let is_large = |x: u32, y: u32| (5..11).contains(&x) && (5..11).contains(&y);
        let both = sheet(12, |x, y| is_small(x, y) || is_large(x, y));
        let filled = |max_size: f32, is_seen_through: fn(Vec3) -> bool| {
            let mut mesh = both.clone();
            fill_holes(&mut mesh, max_size, is_seen_through);
            ((area(&mesh) - area(&both)) * 1e4).round()
        };
        assert_eq!(filled(0.05, |_| false), 1.0);
        assert_eq!(filled(0.09, |_| false), 37.0);
        assert_eq!(filled(0.09, |place| place.x > 0.04), 1.0);
        assert_eq!(filled(0.001, |_| false), 0.0);
    }

    #[test]
    fn holes_that_touch_in_a_vertex_are_two() {
        let mut mesh = sheet(6, |x, y| (x == 2 && y == 2) || (x == 3 && y == 3));
        fill_holes(&mut mesh, 0.02, |_| false);
        assert!((area(&mesh) - 0.06 * 0.06).abs() < 1e-7, "{}", area(&mesh));
    }
}
