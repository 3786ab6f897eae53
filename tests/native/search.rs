//! Every search against brute force, to the last bit, on random and on degenerate clouds.

use glam::Vec3;
use scanstitch::search::{KdTree, Neighbor, RadiusGrid};

/// Uniform numbers from a constant seed (xorshift64*).
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 40) as f32 / (1u32 << 24) as f32
    }

    fn point<const D: usize>(&mut self) -> [f32; D] {
        std::array::from_fn(|_| self.uniform())
    }

    fn cloud<const D: usize>(&mut self, len: usize) -> Vec<[f32; D]> {
        (0..len).map(|_| self.point()).collect()
    }
}

/// All points within reach, nearest first, of equal distances the smallest index first.
fn brute_force<const D: usize>(points: &[[f32; D]], query: &[f32; D], max_distance: f32) -> Vec<Neighbor> {
    let mut found: Vec<Neighbor> = points
        .iter()
        .enumerate()
        .filter(|(_, point)| point.iter().all(|x| x.is_finite()))
        .map(|(index, point)| {
            let sq_distance = point.iter().zip(query).fold(0.0, |sum, (a, b)| sum + (a - b) * (a - b));
            Neighbor { index: index as u32, sq_distance }
        })
        .filter(|neighbor| neighbor.sq_distance.is_finite() && neighbor.sq_distance <= max_distance * max_distance)
        .collect();
    sort(&mut found);
    found
}

fn sort(neighbors: &mut [Neighbor]) {
    neighbors.sort_by(|a, b| a.sq_distance.total_cmp(&b.sq_distance).then(a.index.cmp(&b.index)));
}

/// Compares all four searches with brute force for each query and each reach.
fn check<const D: usize>(name: &str, points: &[[f32; D]], queries: &[[f32; D]], reaches: &[f32]) {
    let tree = KdTree::build(points);
    let num_finite = points.iter().filter(|point| point.iter().all(|x| x.is_finite())).count();
    assert_eq!(tree.len(), num_finite, "{name}");
    assert_eq!(tree.is_empty(), num_finite == 0, "{name}");
    let mut order: Vec<u32> = tree.order().collect();
    order.sort_unstable();
    let finite = (0u32..).zip(points).filter(|(_, point)| point.iter().all(|x| x.is_finite()));
    assert!(order.into_iter().eq(finite.map(|(index, _)| index)), "{name}");
    // Left over from another search, to be dropped.
    let mut out = vec![Neighbor { index: 7, sq_distance: -1.0 }];
    for query in queries {
        for &reach in reaches {
            let place = format!("{name}, D = {D}, query {query:?}, within {reach}");
            let expected = brute_force(points, query, reach);
            assert_eq!(tree.nearest(query, reach), expected.first().copied(), "{place}");
            assert_eq!(tree.has_within(query, reach), !expected.is_empty(), "{place}");
            for divisor in [1, 2, 7, u32::MAX] {
                let accept = |index: u32| index % divisor == divisor / 2;
                let nearest = expected.iter().copied().find(|neighbor| accept(neighbor.index));
                assert_eq!(tree.nearest_where(query, reach, accept), nearest, "{place}, every {divisor}th");
            }
            for k in [0, 1, 2, 10, 32, 33, 200, usize::MAX] {
                tree.k_nearest(query, reach, k, &mut out);
                assert_eq!(out, expected[..k.min(expected.len())], "{place}, k = {k}");
            }
            tree.within(query, reach, &mut out);
            sort(&mut out);
            assert_eq!(out, expected, "{place}");
        }
    }
}

const REACHES: [f32; 5] = [0.0, 0.02, 0.1, 0.7, f32::INFINITY];

/// Points of the cloud themselves, points among them, and points outside.
fn queries<const D: usize>(random: &mut Random, points: &[[f32; D]]) -> Vec<[f32; D]> {
    let of_cloud = points.iter().step_by(points.len() / 20 + 1).copied();
    let near = points.iter().skip(3).step_by(points.len() / 20 + 1).map(|p| p.map(|x| x + 0.013));
    let mut queries: Vec<_> = of_cloud.chain(near).collect();
    queries.extend((0..15).map(|_| random.point::<D>().map(|x| 3.0 * x - 1.0)));
    queries
}

fn random_clouds<const D: usize>() {
    let mut random = Random(1);
    // Around the sizes at which a leaf fills and a level is added.
    for len in [1, 2, 3, 15, 16, 17, 31, 32, 33, 47, 48, 49, 64, 65, 100, 257, 1000, 3000] {
        let points = random.cloud::<D>(len);
        let queries = queries(&mut random, &points);
        check(&format!("{len} random points"), &points, &queries, &REACHES);
    }
}

#[test]
fn random_clouds_in_the_plane() {
    random_clouds::<2>();
}

#[test]
fn random_clouds_in_space() {
    random_clouds::<3>();
}

fn degenerate_clouds<const D: usize>() {
    let mut random = Random(2);
    let axis = |x: f32| std::array::from_fn(|row| if row == 0 { x } else { 0.25 });
    let diagonal = |x: f32| [x; D];
    let mut clouds: Vec<(&str, Vec<[f32; D]>)> = vec![
        ("no point", vec![]),
        ("one point", vec![[0.5; D]]),
        ("one point with negative zeros", vec![[-0.0; D], [0.0; D]]),
        ("identical points", vec![[0.5; D]; 500]),
        ("on an axis", (0..300).map(|_| axis(random.uniform())).collect()),
        ("on the diagonal", (0..300).map(|_| diagonal(random.uniform())).collect()),
        ("on a line, each three times", (0..300).map(|i| axis((i % 100) as f32 * 0.01)).collect()),
        (
            "on a grid",
            (0..1000).map(|i| std::array::from_fn(|row| (i / 10_i32.pow(row as u32) % 10) as f32 * 0.1)).collect(),
        ),
        (
            "in two clusters",
            random.cloud(600).iter().enumerate().map(|(i, p)| p.map(|x| x * 1e-3 + (i % 2) as f32)).collect(),
        ),
        ("identical but for one", [vec![[0.5; D]; 200], vec![[0.4; D]], vec![[0.5; D]; 200]].concat()),
        ("about zero", random.cloud(300).iter().map(|p: &[f32; D]| p.map(|x| x - 0.5)).collect()),
        ("quantised", random.cloud(500).iter().map(|p: &[f32; D]| p.map(|x| (x * 4.0).round() / 4.0)).collect()),
    ];
    let mut holes = random.cloud(400);
    for (place, value) in [(0, f32::NAN), (1, f32::INFINITY), (2, f32::NEG_INFINITY), (77, f32::NAN), (399, f32::NAN)] {
        holes[place][place % D] = value;
    }
    clouds.push(("with points that are not finite", holes));
    clouds.push(("no finite point", vec![[f32::NAN; D]; 40]));
    for (name, points) in &clouds {
        let mut queries = queries(&mut random, points);
        // Halfway between the points of the grid, where many are as near.
        queries.extend([[0.0; D], [0.45; D], [0.5; D], axis(0.455), axis(0.45)]);
        queries.retain(|query| query.iter().all(|x| x.is_finite()));
        check(name, points, &queries, &REACHES);
    }
}

#[test]
fn degenerate_clouds_in_the_plane() {
    degenerate_clouds::<2>();
}

#[test]
fn degenerate_clouds_in_space() {
    degenerate_clouds::<3>();
}

/// The same cloud far away, where coordinates are coarse and many distances equal, and at scales from a femtometre to
/// an exametre; beyond that squares overflow and nothing is in reach.
fn offsets_and_scales<const D: usize>() {
    let mut random = Random(3);
    let cloud = random.cloud::<D>(700);
    let around = queries(&mut random, &cloud);
    for offset in [1e3, -1e5, 4e6] {
        let shift = |points: &[[f32; D]]| points.iter().map(|p| p.map(|x| x + offset)).collect::<Vec<_>>();
        check(&format!("at {offset}"), &shift(&cloud), &shift(&around), &REACHES);
    }
    for scale in [1e-15, 1e-6, 1e6, 1e18, 3e19, 3e38] {
        let scaled = |points: &[[f32; D]]| points.iter().map(|p| p.map(|x| (x - 0.5) * scale)).collect::<Vec<_>>();
        check(&format!("times {scale}"), &scaled(&cloud), &scaled(&around), &REACHES.map(|reach| reach * scale));
    }
}

#[test]
fn offsets_and_scales_in_the_plane() {
    offsets_and_scales::<2>();
}

#[test]
fn offsets_and_scales_in_space() {
    offsets_and_scales::<3>();
}

#[test]
fn reach_is_inclusive_and_bad_input_finds_nothing() {
    let tree = KdTree::build(&[[0.0, 0.0], [3.0, 4.0], [3.0, -4.0]]);
    assert_eq!(tree.nearest_where(&[0.0, 0.0], 5.0, |i| i != 0), Some(Neighbor { index: 1, sq_distance: 25.0 }));
    assert_eq!(tree.nearest_where(&[0.0, 0.0], 4.999, |i| i != 0), None);
    let mut out = vec![];
    for query in [[f32::NAN, 0.0], [0.0, f32::INFINITY], [f32::NEG_INFINITY, f32::NAN]] {
        assert_eq!(tree.nearest(&query, f32::INFINITY), None);
        assert_eq!(tree.nearest_where(&query, f32::INFINITY, |_| true), None);
        tree.k_nearest(&query, f32::INFINITY, 3, &mut out);
        assert_eq!(out, []);
        tree.within(&query, f32::INFINITY, &mut out);
        assert_eq!(out, []);
    }
    for reach in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        assert_eq!(tree.nearest(&[0.0, 0.0], reach), None);
        tree.k_nearest(&[0.0, 0.0], reach, 3, &mut out);
        assert_eq!(out, []);
        tree.within(&[0.0, 0.0], reach, &mut out);
        assert_eq!(out, []);
    }
}

/// Sensors write the origin where nothing came back, and a wall seen from afar is flat: without care for ties and for
/// the axes that no split cuts, each of these queries would look at every point. Only the answers are tested: a trap would not
/// fail this test, it would take minutes.
#[test]
fn a_hundred_thousand_identical_or_coplanar_points_are_no_trap() {
    let mut random = Random(4);
    let identical = vec![[1.0, 2.0, 3.0]; 100_000];
    let two_places: Vec<_> = (0..100_000).map(|i| [(i % 2) as f32; 3]).collect();
    let two_walls: Vec<_> = (0..100_000).map(|i| [(i % 2) as f32 * 10.0, random.uniform(), random.uniform()]).collect();
    let mut out = vec![];
    for points in [&identical, &two_places, &two_walls] {
        let tree = KdTree::build(points);
        for i in 0..20_000 {
            let query = [1.2, 0.4, (i % 7) as f32 * 0.1];
            let nearest = tree.nearest(&query, 10.0);
            let second = tree.nearest_where(&query, 10.0, |index| nearest.is_none_or(|first| index != first.index));
            tree.k_nearest(&query, 10.0, 2, &mut out);
            assert_eq!(nearest.into_iter().chain(second).collect::<Vec<_>>(), out);
            assert_eq!(out.len(), 2);
        }
        tree.k_nearest(&[1.2, 0.4, 0.5], 10.0, 50, &mut out);
        assert_eq!(out, brute_force(points, &[1.2, 0.4, 0.5], 10.0)[..50]);
    }
}

#[test]
fn a_grid_of_reach_answers_as_brute_force_does() {
    let mut random = Random(5);
    let mut points = random.cloud::<3>(400);
    points[7] = [f32::NAN, 0.5, 0.5];
    points[8] = [0.5, f32::INFINITY, 0.5];
    // A flat cloud, one point, the points far from the origin, and one cloud too large for a grid.
    let flat: Vec<_> = points.iter().map(|&[x, y, _]| [x, y, 0.25]).collect();
    let far: Vec<_> = points.iter().map(|&[x, y, z]| [x + 500.0, y - 300.0, z]).collect();
    let huge: Vec<_> = points.iter().map(|&[x, y, z]| [1e6 * x, 1e6 * y, 1e6 * z]).collect();
    let (mut grids, mut answers) = (0, [0; 2]);
    for points in [&points[..], &flat, &points[..1], &far, &huge, &[]] {
        let tree = KdTree::build(points);
        let positions: Vec<Vec3> = points.iter().map(|&p| Vec3::from(p)).collect();
        for distance in [0.02, 0.05, 0.3, 10.0, 0.0, -1.0, f32::NAN] {
            let grid = RadiusGrid::new(&positions, &tree, distance);
            grids += usize::from(grid.has_cells());
            let near =
                points.iter().flat_map(|&p| [-1.0, -0.8, 0.0, 0.5, 0.999, 1.001].map(|k| p.map(|x| x + k * distance)));
            let along = points.iter().flat_map(|&[x, y, z]| [0.999, 1.0, 1.001].map(|k| [x, y + k * distance, z]));
            let others = [[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [-1e30, 0.0, 0.0], [0.0; 3]];
            for query in near.chain(along).chain(others) {
                let expected = tree.has_within(&query, distance);
                assert_eq!(expected, !brute_force(points, &query, distance).is_empty() && distance >= 0.0);
                assert_eq!(grid.has_within(Vec3::from(query)), expected, "{query:?} within {distance}");
                answers[usize::from(expected)] += 1;
            }
        }
    }
    assert!(grids > 10 && answers[0] > 5000 && answers[1] > 5000, "{grids} {answers:?}");
}
