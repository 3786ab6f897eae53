//! Normals from the nearest neighbours, for clouds without a grid or an order of beams.
//!
//! The normal is the direction in which a point's neighbours spread least (Hoppe et al., "Surface reconstruction from
//! unorganized points", SIGGRAPH 1992), oriented towards the viewpoint.

use glam::{DVec3, Vec3};
use nalgebra::Vector3;

use crate::geometry::quantile::MIN_SAMPLE;
use crate::search::{KdTree, Neighbor, Neighborhood};

/// Neighbourhood from which normals of clouds are estimated, whatever their spacing.
pub(crate) const NORMAL_NEIGHBORS: Neighborhood = Neighborhood { max_neighbors: 20, radius: f64::INFINITY };
/// Ratio of the second largest to the largest variance below which the neighbours lie on a line and determine no plane.
const LINE_SHARE: f64 = 1e-3;
/// Neighbours clearly lie in a plane when their smallest variance is at most this share of the second largest: 20 points with
/// noise across a line have 0.3 to 1 of it, and a plane then has a normal to within 6 degrees (1 / (2 sqrt(20)) rad).
const MAX_CLEAR_THICKNESS: f64 = 0.25;
/// Largest kurtosis (fourth moment over squared variance) of the second direction in which neighbours of a clear plane spread. Where k of 20 lie off
/// the line of the others it is 18, 8.1, 4.9, 3.3 for k = 1, 2, 3, 4: at least three are asked for, by the middle of 8.1 and 4.9 (geometric mean). Two always lie in some plane with a line: those of a
/// ring's arc across the floor and the next beam's point on a wall in one that nothing stands in, and that moves with the sensor. Normally spread
/// neighbours have 3, evenly spread ones 1.8.
const MAX_CLEAR_KURTOSIS: f64 = 6.3;

/// The unit normal of every point of `tree`, which was built from `points` (m), towards `viewpoint` (m, same frame).
/// `None` for points that are not finite, have too few neighbours, or whose neighbours lie on a line.
pub fn estimate_normals(
    points: &[Vec3],
    tree: &KdTree<3>,
    neighborhood: Neighborhood,
    viewpoint: DVec3,
) -> Vec<Option<Vector3<f64>>> {
    normals(points, tree, 0..points.len(), neighborhood, viewpoint, Clarity::ANY)
}

/// As [`estimate_normals`], but of these points alone, and `None` where the neighbours do not clearly lie in a plane. Neighbours on one ring of a spinning
/// laser lie on a line as thick as the noise: every normal across it fits, and many such normals would bias a registration
/// towards no motion.
pub fn estimate_clear_normals(
    points: &[Vec3],
    tree: &KdTree<3>,
    chosen: &[usize],
    neighborhood: Neighborhood,
    viewpoint: DVec3,
) -> Vec<Option<Vector3<f64>>> {
    normals(points, tree, chosen.iter().copied(), neighborhood, viewpoint, Clarity::PLANE)
}

/// Bounds on the shape of a neighbourhood.
#[derive(Clone, Copy)]
struct Clarity {
    /// Largest ratio of the smallest spread to the second largest (variances).
    max_thickness: f64,
    /// Largest kurtosis of the second largest.
    max_kurtosis: f64,
}

impl Clarity {
    const ANY: Self = Self { max_thickness: f64::INFINITY, max_kurtosis: f64::INFINITY };
    const PLANE: Self = Self { max_thickness: MAX_CLEAR_THICKNESS, max_kurtosis: MAX_CLEAR_KURTOSIS };
}

fn normals(
    points: &[Vec3],
    tree: &KdTree<3>,
    chosen: impl Iterator<Item = usize>,
    neighborhood: Neighborhood,
    viewpoint: DVec3,
    clarity: Clarity,
) -> Vec<Option<Vector3<f64>>> {
    let mut neighbors = Vec::with_capacity(neighborhood.max_neighbors);
    let mut normal = |point: &Vec3| {
        find_neighbors(tree, *point, neighborhood, &mut neighbors);
        let normal = least_spread(points, *point, &neighbors, clarity)?;
        let towards = if normal.dot(viewpoint - point.as_dvec3()) < 0.0 { -normal } else { normal };
        Some(Vector3::new(towards.x, towards.y, towards.z))
    };
    chosen.map(|point| normal(&points[point])).collect()
}

/// Not part of the loop over the points: browsers begin optimised code at the next call of a function, and the loop is one.
#[inline(never)]
fn find_neighbors(
    tree: &KdTree<3>,
    point: Vec3,
    Neighborhood { max_neighbors, radius }: Neighborhood,
    neighbors: &mut Vec<Neighbor>,
) {
    tree.k_nearest(&point.to_array(), radius as f32, max_neighbors, neighbors);
}

/// The direction in which the neighbours spread least; a function of its own for the same reason.
#[inline(never)]
fn least_spread(points: &[Vec3], point: Vec3, neighbors: &[Neighbor], clarity: Clarity) -> Option<DVec3> {
    if neighbors.len() < MIN_SAMPLE {
        return None;
    }
    // Relative to the point, so that single precision is enough.
    let (mut sum, mut diagonal, mut others) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    for neighbor in neighbors {
        let d = points[neighbor.index as usize] - point;
        sum += d;
        diagonal += d * d;
        others += Vec3::new(d.x * d.y, d.x * d.z, d.y * d.z);
    }
    let share = 1.0 / neighbors.len() as f64;
    let mean = sum.as_dvec3() * share;
    let diagonal = diagonal.as_dvec3() * share - mean * mean;
    let others = others.as_dvec3() * share - DVec3::new(mean.x * mean.y, mean.x * mean.z, mean.y * mean.z);
    let spread = Spread::of(diagonal, others)?;
    if spread.thickness() > clarity.max_thickness {
        return None;
    }
    let normal = spread.eigenvector(spread.smallest)?;
    // Where the two larger spreads are equal, any direction in the plane is one of the second.
    let second =
        spread.eigenvector(spread.largest).map_or_else(|| normal.any_orthonormal_vector(), |d| normal.cross(d));
    let is_clear = clarity.max_kurtosis.is_infinite()
        || kurtosis(points, neighbors, point.as_dvec3() + mean, second) <= clarity.max_kurtosis;
    is_clear.then_some(normal)
}

/// Kurtosis of the neighbours along a direction: fourth moment about their mean over squared variance.
fn kurtosis(points: &[Vec3], neighbors: &[Neighbor], mean: DVec3, direction: DVec3) -> f64 {
    let along =
        neighbors.iter().map(|neighbor| (points[neighbor.index as usize].as_dvec3() - mean).dot(direction).powi(2));
    let (variance, fourth) =
        along.fold((0.0, 0.0), |(sum, fourth), squared| (sum + squared, fourth + squared * squared));
    fourth * neighbors.len() as f64 / (variance * variance)
}

/// A symmetric matrix less its mean eigenvalue, with the eigenvalues that are left.
///
/// Eigenvalues in closed form (Smith, "Eigenvalues of a symmetric 3 x 3 matrix", CACM 4 (1961)).
struct Spread {
    diagonal: DVec3,
    /// Entries (0, 1), (0, 2) and (1, 2).
    others: DVec3,
    mean: f64,
    smallest: f64,
    middle: f64,
    largest: f64,
}

impl Spread {
    /// `None` where the two smallest eigenvalues are both next to nothing.
    fn of(diagonal: DVec3, others: DVec3) -> Option<Self> {
        let mean = (diagonal.x + diagonal.y + diagonal.z) / 3.0;
        let d = diagonal - mean;
        let scale = ((d.length_squared() + 2.0 * others.length_squared()) / 6.0).sqrt();
        if !(scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let determinant = d.x * (d.y * d.z - others.z * others.z) - others.x * (others.x * d.z - others.z * others.y)
            + others.y * (others.x * others.z - d.y * others.y);
        let angle = (determinant / (2.0 * scale * scale * scale)).clamp(-1.0, 1.0).acos() / 3.0;
        let largest = 2.0 * scale * angle.cos();
        let smallest = 2.0 * scale * (angle + std::f64::consts::TAU / 3.0).cos();
        let middle = -largest - smallest;
        let is_line = middle + mean <= LINE_SHARE * (largest + mean);
        (!is_line).then_some(Self { diagonal: d, others, mean, smallest, middle, largest })
    }

    /// Ratio of the smallest to the second largest eigenvalue.
    fn thickness(&self) -> f64 {
        (self.smallest + self.mean) / (self.middle + self.mean)
    }

    /// The eigenvector of one of its eigenvalues: the rows of A - value are all perpendicular to it, and the longest of their products is the most
    /// accurate. `None` where another eigenvalue is the same.
    fn eigenvector(&self, value: f64) -> Option<DVec3> {
        let Self { diagonal: d, others, .. } = *self;
        let rows = [
            DVec3::new(d.x - value, others.x, others.y),
            DVec3::new(others.x, d.y - value, others.z),
            DVec3::new(others.y, others.z, d.z - value),
        ];
        let products = [rows[0].cross(rows[1]), rows[0].cross(rows[2]), rows[1].cross(rows[2])];
        let lengths = products.map(DVec3::length_squared);
        let longest =
            if lengths[0] >= lengths[1].max(lengths[2]) { 0 } else { 1 + usize::from(lengths[2] > lengths[1]) };
        products[longest].try_normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::scalar::wave;
    use nalgebra::Matrix3;

    fn normals(points: &[Vec3], neighborhood: Neighborhood, viewpoint: DVec3) -> Vec<Option<Vector3<f64>>> {
        estimate_normals(points, &KdTree::build(bytemuck::cast_slice(points)), neighborhood, viewpoint)
    }

    const TWENTY_NEAREST: Neighborhood = Neighborhood { max_neighbors: 20, radius: f64::INFINITY };

    #[test]
    fn eigenvectors_are_those_of_an_iterative_solver() {
        let spread =
            |C: &Matrix3<f64>| Spread::of(DVec3::new(C.m11, C.m22, C.m33), DVec3::new(C.m12, C.m13, C.m23)).unwrap();
        for i in 0..2000 {
            let A = Matrix3::from_fn(|row, column| wave(9 * i + 3 * row + column, 1.37));
            let scale = [1e-3, 0.1, 1.0, 30.0, 1e3][i % 5];
            let C = A * A.transpose() * scale;
            let (found, expected) = (spread(&C), C.symmetric_eigen());
            let eigenvalues = expected.eigenvalues;
            for (index, value) in [(eigenvalues.imin(), found.smallest), (eigenvalues.imax(), found.largest)] {
                let vector = found.eigenvector(value).unwrap();
                let cosine = expected.eigenvectors.column(index).dot(&Vector3::new(vector.x, vector.y, vector.z)).abs();
                let gap = |k: usize| (eigenvalues[k] - eigenvalues[index]).abs();
                if (0..3).filter(|&k| k != index).all(|k| gap(k) > 1e-3 * eigenvalues.max()) {
                    assert!(cosine > 1.0 - 1e-9, "{C}: {vector}");
                }
            }
        }
        let plane = spread(&Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 0.0)));
        assert!((plane.eigenvector(plane.smallest).unwrap().z.abs() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_noisy_plane_gives_its_normal_towards_the_viewpoint() {
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        let (u, v) = normal.any_orthonormal_pair();
        let points: Vec<Vec3> = (0..3000)
            .map(|i| (u * 2.0 * wave(i, 2.3) + v * wave(i, 3.1) + normal * (5.0 + 0.002 * wave(i, 7.7))).as_vec3())
            .collect();
        for (viewpoint, sign) in [(DVec3::ZERO, -1.0), (normal * 10.0, 1.0)] {
            for found in normals(&points, TWENTY_NEAREST, viewpoint).iter().flatten() {
                let cosine = sign * found.dot(&Vector3::new(normal.x, normal.y, normal.z));
                assert!(cosine > 0.95 && (found.norm() - 1.0).abs() < 1e-12, "{cosine}");
            }
        }
        let within = Neighborhood { max_neighbors: 20, radius: 1e-4 };
        assert!(normals(&points, within, DVec3::ZERO).iter().all(Option::is_none));
    }

    #[test]
    fn lines_and_points_that_are_not_finite_have_no_normal() {
        let line: Vec<Vec3> = (0..50).map(|i| Vec3::new(0.1, 0.2, 0.3) * i as f32).collect();
        assert!(normals(&line, TWENTY_NEAREST, DVec3::ZERO).iter().all(Option::is_none));
        assert!(normals(&[Vec3::ONE; 30], TWENTY_NEAREST, DVec3::ZERO).iter().all(Option::is_none));
        assert!(normals(&[Vec3::X, Vec3::Y, Vec3::Z], TWENTY_NEAREST, DVec3::ZERO).iter().all(Option::is_none));
        let mut points: Vec<Vec3> = (0..100).map(|i| Vec3::new((i / 10) as f32, (i % 10) as f32, 0.0)).collect();
        points[7].x = f32::NAN;
        let found = normals(&points, TWENTY_NEAREST, DVec3::Z);
        assert!(found[7].is_none() && found.iter().flatten().count() == 99);
        assert!(found.iter().flatten().all(|normal| (normal - Vector3::z()).norm() < 1e-6));
    }

    /// Three rings' arcs on a flat floor, or one arc and `num_off` points above it; 2 cm of noise towards the sensor, which is at the origin.
    fn arcs(num_arcs: usize, num_off: usize) -> Vec<Vec3> {
        let noise = |i: usize| 0.02 * wave(i, 7.7) as f32;
        let arc = |i: usize| Vec3::new(10.6 + 0.5 * (i / 24) as f32 + noise(i), 0.1 * (i % 24) as f32 - 1.2, -1.3);
        let off = |i: usize| Vec3::new(10.6 + noise(i), 0.7, 0.3 * i as f32 - 0.9);
        (0..24 * num_arcs).map(arc).chain((0..num_off).map(off)).collect()
    }

    #[test]
    fn a_line_and_one_or_two_points_beside_it_are_no_clear_plane() {
        let found = |points: &[Vec3]| {
            let tree = KdTree::build(bytemuck::cast_slice(points));
            let all: Vec<usize> = (0..points.len()).collect();
            let any = estimate_normals(points, &tree, TWENTY_NEAREST, DVec3::ZERO);
            let clear = estimate_clear_normals(points, &tree, &all, TWENTY_NEAREST, DVec3::ZERO);
            [any, clear].map(|normals| normals.into_iter().flatten().collect::<Vec<_>>())
        };
        for num_off in [1, 2] {
            let [any, clear] = found(&arcs(1, num_off));
            let along = |normals: &[Vector3<f64>]| normals.iter().filter(|normal| normal.x.abs() > 0.9).count();
            assert!(along(&any) > 10 && along(&clear) == 0, "{num_off}: {any:?}, {clear:?}");
        }
        let [any, clear] = found(&arcs(3, 0));
        assert!(any.len() == 72 && clear.len() == 72 && clear.iter().all(|normal| normal.z > 0.99), "{clear:?}");
    }
}
