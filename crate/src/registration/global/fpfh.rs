//! Fast point feature histograms: a description of the surface around a point that is invariant under rigid motions.
//!
//! Rusu, Blodow and Beetz, "Fast point feature histograms (FPFH) for 3D registration", ICRA 2009, eqs. 1-2, with 11 bins for
//! each of the three angles. The first point of a pair is the one whose normal is nearer to the line between them, so that the
//! angles do not depend on the order (Rusu et al., "Learning informative point classes for the acquisition of object model
//! maps", ICARCV 2008).

use glam::Vec3;
use nalgebra::Vector3;

use crate::search::{KdTree, Neighbor, Neighborhood};

/// Bins of one angle.
const BINS: usize = 11;
/// Length of a histogram.
pub const FEATURE_SIZE: usize = 3 * BINS;
/// A histogram; each third sums up to 200, the point's own share and its neighbours' being 100 each. NaN where the point has no
/// normal or no neighbour.
pub type Feature = [f32; FEATURE_SIZE];

/// The histogram of every point of `tree`, which was built from `points` (m). Points without a normal get none and are no
/// neighbours.
///
/// # Panics
/// When there is not one entry of `normals` for each point.
pub fn fpfh(
    points: &[Vec3],
    normals: &[Option<Vector3<f64>>],
    tree: &KdTree<3>,
    neighborhood: Neighborhood,
) -> Vec<Feature> {
    assert_eq!(points.len(), normals.len(), "one normal a point");
    let single = |normal: &Vector3<f64>| Vec3::new(normal.x as f32, normal.y as f32, normal.z as f32);
    let normals: Vec<Vec3> = normals.iter().map(|normal| normal.as_ref().map_or(Vec3::NAN, single)).collect();
    let neighbors = Neighbors::new(points, &normals, tree, neighborhood);
    let simple: Vec<Feature> =
        (0..points.len()).map(|index| simple_histogram(points, &normals, index, neighbors.of(index))).collect();
    (0..points.len()).map(|index| weighted(&simple, index, neighbors.of(index))).collect()
}

/// The neighbours of every point, one list after the other. The point itself is not among its own.
struct Neighbors {
    starts: Vec<usize>,
    all: Vec<Neighbor>,
}

impl Neighbors {
    fn new(
        points: &[Vec3],
        normals: &[Vec3],
        tree: &KdTree<3>,
        Neighborhood { max_neighbors, radius }: Neighborhood,
    ) -> Self {
        let mut starts = Vec::with_capacity(points.len() + 1);
        let (mut all, mut found) = (Vec::new(), Vec::new());
        starts.push(0);
        for (index, point) in points.iter().enumerate() {
            if normals[index].is_finite() {
                tree.within(&point.to_array(), radius as f32, &mut found);
                if found.len() > max_neighbors && max_neighbors > 0 {
                    let order = |neighbor: &Neighbor| (neighbor.sq_distance.to_bits(), neighbor.index);
                    found.select_nth_unstable_by_key(max_neighbors - 1, order);
                    found.truncate(max_neighbors);
                }
                // A point on another one has no direction to it and infinite weight.
                let counts =
                    |neighbor: &&Neighbor| neighbor.sq_distance > 0.0 && normals[neighbor.index as usize].is_finite();
                all.extend(found.iter().filter(counts));
            }
            starts.push(all.len());
        }
        Self { starts, all }
    }

    fn of(&self, index: usize) -> &[Neighbor] {
        &self.all[self.starts[index]..self.starts[index + 1]]
    }
}

/// Pairs that are computed at once, lane by lane.
const LANES: usize = 16;

/// The histogram of a point's own pairs.
fn simple_histogram(points: &[Vec3], normals: &[Vec3], index: usize, neighbors: &[Neighbor]) -> Feature {
    let (point, normal) = (points[index], normals[index]);
    let mut counts = [0u32; FEATURE_SIZE];
    for neighbors in neighbors.chunks(LANES) {
        let (mut lines, mut others) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for (lane, neighbor) in neighbors.iter().enumerate() {
            let line = points[neighbor.index as usize] - point;
            let other = normals[neighbor.index as usize];
            (lines[0][lane], lines[1][lane], lines[2][lane]) = (line.x, line.y, line.z);
            (others[0][lane], others[1][lane], others[2][lane]) = (other.x, other.y, other.z);
        }
        // In steps, each over all lanes: one after the other they need fewer registers than all at once.
        let mut cosines = [[0.0; LANES]; 4];
        for lane in 0..LANES {
            let line = Vec3::new(lines[0][lane], lines[1][lane], lines[2][lane]);
            let other = Vec3::new(others[0][lane], others[1][lane], others[2][lane]);
            let scale = 1.0 / line.length_squared().sqrt();
            cosines[0][lane] = normal.dot(line) * scale;
            cosines[1][lane] = other.dot(line) * scale;
            cosines[2][lane] = normal.dot(other);
            cosines[3][lane] = other.dot(line.cross(normal)) * scale;
        }
        let mut angles = [[0.0; LANES]; 4];
        for lane in 0..LANES {
            let found = pair_angles(cosines[0][lane], cosines[1][lane], cosines[2][lane], cosines[3][lane]);
            (angles[0][lane], angles[1][lane], angles[2][lane], angles[3][lane]) = (found.0, found.1, found.2, found.3);
        }
        let mut bins = [[0; LANES]; 3];
        for lane in 0..LANES {
            bins[0][lane] = bin(atan2(angles[0][lane], angles[1][lane]) * std::f32::consts::FRAC_1_PI);
            bins[1][lane] = bin(angles[2][lane]);
            bins[2][lane] = bin(angles[3][lane]);
        }
        for (third, bins) in bins.iter().enumerate() {
            for &bin in &bins[..neighbors.len()] {
                counts[BINS * third + bin as usize] += 1;
            }
        }
    }
    let share = 100.0 / neighbors.len() as f32; // no neighbour: NaN
    counts.map(|count| count as f32 * share)
}

/// w . n2, u . n2, alpha = v . n2 and phi = u . d of a pair, with theta = atan2(w . n2, u . n2). d is the unit vector from the first
/// point to the second, and u = n1, v = d x u, w = u x v is the frame of the first. They are computed from the cosines a = n1 . d,
/// b = n2 . d, c = n1 . n2 and the triple product t = n2 . (d x n1), without the frame. Exchanging the points exchanges a and b
/// and negates both; c and t do not change.
#[inline]
fn pair_angles(a: f32, b: f32, c: f32, t: f32) -> (f32, f32, f32, f32) {
    let exchanged = a.abs() < b.abs();
    let (phi, other) = if exchanged { (-b, -a) } else { (a, b) };
    let sq_sine = 1.0 - phi * phi;
    // Where n1 is parallel to d, the frame is undefined, and all angles are set to zero.
    let is_undefined = sq_sine < 1e-12;
    let inverse_sine = if is_undefined { 0.0 } else { 1.0 / sq_sine.sqrt() };
    let cosine = if is_undefined { 1.0 } else { c };
    let phi_or_zero = if is_undefined { 0.0 } else { phi };
    ((other - c * phi) * inverse_sine, cosine, t * inverse_sine, phi_or_zero)
}

/// The bin of a number in [-1, 1].
#[inline]
fn bin(value: f32) -> u32 {
    let place = (value + 1.0) * (BINS as f32 / 2.0);
    (place as u32).min(BINS as u32 - 1)
}

/// The angle of (x, y) to 1e-5, without a branch. (Abramowitz and Stegun, "Handbook of mathematical functions", 4.4.49.)
#[inline]
fn atan2(y: f32, x: f32) -> f32 {
    let (abs_x, abs_y) = (x.abs(), y.abs());
    let larger = if abs_x > abs_y { abs_x } else { abs_y };
    let smaller = if abs_x > abs_y { abs_y } else { abs_x };
    let ratio = smaller / if larger > 0.0 { larger } else { 1.0 };
    let s = ratio * ratio;
    let series = 0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1)));
    let octant = ratio * series;
    let quadrant = if abs_y > abs_x { std::f32::consts::FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { std::f32::consts::PI - quadrant } else { quadrant };
    if y < 0.0 { -half } else { half }
}

/// The point's own histogram and the mean of its neighbours', weighted by the inverse of their squared distances and brought
/// to the same sum.
fn weighted(simple: &[Feature], index: usize, neighbors: &[Neighbor]) -> Feature {
    let mut sums = [0.0; FEATURE_SIZE];
    for neighbor in neighbors {
        let weight = 1.0 / neighbor.sq_distance;
        for (sum, value) in sums.iter_mut().zip(&simple[neighbor.index as usize]) {
            *sum += weight * value;
        }
    }
    let mut feature = simple[index];
    for (sums, feature) in sums.chunks_exact(BINS).zip(feature.chunks_exact_mut(BINS)) {
        let share = 100.0 / sums.iter().sum::<f32>();
        for (value, sum) in feature.iter_mut().zip(sums) {
            *value += share * sum;
        }
    }
    feature
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::scalar::wave;

    fn unit(i: usize) -> Vec3 {
        Vec3::new(wave(i, 1.9) as f32, wave(i, 2.7) as f32, wave(i, 3.3) as f32).normalize()
    }

    fn pair_bins(a: f32, b: f32, c: f32, t: f32) -> [u32; 3] {
        let (y, x, alpha, phi) = pair_angles(a, b, c, t);
        [bin(atan2(y, x) / std::f32::consts::PI), bin(alpha), bin(phi)]
    }

    /// The angles in the frame itself, as the paper has them.
    fn angles(p: Vec3, n: Vec3, q: Vec3, m: Vec3) -> [f32; 3] {
        let d = (q - p).normalize();
        let (u, m, d) = if n.dot(d).abs() < m.dot(d).abs() { (m, n, -d) } else { (n, m, d) };
        let v = d.cross(u).normalize();
        let w = u.cross(v);
        [w.dot(m).atan2(u.dot(m)) / std::f32::consts::PI, v.dot(m), u.dot(d)]
    }

    #[test]
    fn bins_are_those_of_the_angles_in_the_pairs_frame() {
        for i in 0..5000 {
            let (p, q) = (unit(4 * i) * 3.0, unit(4 * i + 1) * 2.0);
            let (n, m) = (unit(4 * i + 2), unit(4 * i + 3));
            let d = (q - p).normalize();
            let bins = pair_bins(n.dot(d), m.dot(d), n.dot(m), m.dot(d.cross(n)));
            for (found, angle) in bins.iter().zip(angles(p, n, q, m)) {
                let place = (angle + 1.0) * BINS as f32 / 2.0;
                assert!((place - 1e-3).floor() as u32 <= *found && *found <= (place + 1e-3).floor() as u32, "{i}");
            }
            // Seen from the other point it is the same.
            assert_eq!(bins, pair_bins(m.dot(-d), n.dot(-d), n.dot(m), n.dot((-d).cross(m))));
        }
        assert_eq!(pair_bins(1.0, 1.0, 1.0, 0.0), [5, 5, 5]);
    }

    #[test]
    fn the_arc_tangent_is_close_enough() {
        for i in 0..10_000 {
            let (y, x) = (wave(i, 1.7) as f32, wave(i, 2.3) as f32);
            assert!((atan2(y, x) - y.atan2(x)).abs() < 2e-5, "{y} {x}");
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
    }

    #[test]
    fn histograms_do_not_change_with_the_frame_and_sum_up() {
        let points: Vec<Vec3> = (0..800)
            .map(|i| Vec3::new(2.0 * wave(i, 1.1) as f32, wave(i, 2.3) as f32, 0.3 * wave(i, 0.7) as f32))
            .collect();
        let normals: Vec<Option<Vector3<f64>>> = (0..800)
            .map(|i| {
                let n = unit(i).as_dvec3();
                (i % 50 != 3).then(|| Vector3::new(n.x, n.y, n.z))
            })
            .collect();
        let around = Neighborhood { max_neighbors: 40, radius: 0.4 };
        let features = |points: &[Vec3], normals: &[Option<Vector3<f64>>]| {
            fpfh(points, normals, &KdTree::build(bytemuck::cast_slice(points)), around)
        };
        let before = features(&points, &normals);
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.4, -1.2, 2.2);
        let turned: Vec<Vec3> = points
            .iter()
            .map(|p| {
                let p = turn * Vector3::new(f64::from(p.x), f64::from(p.y), f64::from(p.z));
                Vec3::new(p.x as f32 + 3.0, p.y as f32, p.z as f32 - 1.0)
            })
            .collect();
        let after = features(&turned, &normals.iter().map(|n| n.map(|n| turn * n)).collect::<Vec<_>>());
        let mut far = 0;
        for (index, (before, after)) in before.iter().zip(&after).enumerate() {
            if index % 50 == 3 {
                assert!(before[0].is_nan());
                continue;
            }
            for third in before.chunks_exact(BINS) {
                assert!((third.iter().sum::<f32>() - 200.0).abs() < 0.1);
            }
            let distance: f32 = before.iter().zip(after).map(|(a, b)| (a - b).abs()).sum();
            far += usize::from(distance > 10.0); // pairs on the edge of a bin, neighbours on the edge of the radius
        }
        assert!(far < 16, "{far}");
    }
}
