//! A surface of triangles.

use glam::Vec3;

use super::connected_parts::connected_parts;

/// Triangles over shared vertices, with what is known of each vertex. All vectors of vertices are of one length, but `colors`
/// and `filled`, which may be empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TriangleMesh {
    /// Vertices (m).
    pub positions: Vec<Vec3>,
    /// Unit normals, on the side that was seen.
    pub normals: Vec<Vec3>,
    /// Red, green and blue.
    pub colors: Vec<[u8; 3]>,
    /// Standard deviation of each vertex along its normal (m).
    pub deviations: Vec<f32>,
    /// Whether a vertex fills a hole where nothing was measured; empty where none does. A triangle does where one of its vertices does.
    pub filled: Vec<bool>,
    /// Indices of the vertices, counter-clockwise where the surface is seen from the side that its normals point to.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Normals of the vertices from the triangles around them, weighted by their areas.
    pub(crate) fn set_normals(&mut self) {
        self.normals = vec![Vec3::ZERO; self.positions.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize]);
            let normal = (b - a).cross(c - a);
            for vertex in triangle {
                self.normals[*vertex as usize] += normal;
            }
        }
        for normal in &mut self.normals {
            *normal = normal.normalize_or_zero();
        }
    }

    /// Area of a triangle (m^2).
    pub fn area(&self, triangle: [u32; 3]) -> f32 {
        let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize]);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Number of triangles that fill holes.
    pub fn num_filled(&self) -> usize {
        let is_filled = |vertex: &u32| self.filled.get(*vertex as usize).is_some_and(|&is_filled| is_filled);
        self.triangles.iter().filter(|triangle| triangle.iter().any(is_filled)).count()
    }

    /// Without the parts, joined by shared vertices, whose triangles have less than this size together.
    #[must_use]
    pub fn without_islands(self, min_size: f32, size: impl Fn(&Self, [u32; 3]) -> f32) -> Self {
        let edges = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [a, c]].map(|edge| edge.map(|vertex| vertex as usize)));
        let parts = connected_parts(self.positions.len(), edges);
        let mut sizes = vec![0.0; self.positions.len()];
        for &triangle in &self.triangles {
            sizes[parts[triangle[0] as usize]] += size(&self, triangle);
        }
        let is_kept: Vec<bool> = parts.iter().map(|&part| sizes[part] >= min_size).collect();
        self.selected(&is_kept)
    }

    /// With these triangles over its vertices, fewer of them: vertices that none uses are left out.
    #[must_use]
    pub fn with_triangles(self, triangles: Vec<[u32; 3]>) -> Self {
        let mut is_used = vec![false; self.positions.len()];
        triangles.iter().flatten().for_each(|&vertex| is_used[vertex as usize] = true);
        Self { triangles, ..self }.selected(&is_used)
    }

    /// The vertices that are kept, and the triangles between them.
    fn selected(mut self, is_kept: &[bool]) -> Self {
        let mut numbers = vec![u32::MAX; is_kept.len()];
        let kept = numbers.iter_mut().zip(is_kept).filter(|(_, is_kept)| **is_kept);
        kept.zip(0..).for_each(|((number, _), place)| *number = place);
        retain(&mut self.positions, is_kept);
        retain(&mut self.normals, is_kept);
        retain(&mut self.colors, is_kept);
        retain(&mut self.deviations, is_kept);
        retain(&mut self.filled, is_kept);
        self.triangles.retain_mut(|triangle| {
            *triangle = triangle.map(|vertex| numbers[vertex as usize]);
            !triangle.contains(&u32::MAX)
        });
        self
    }
}

/// Keeps the entries of the vertices that are kept; there may be none.
fn retain<T>(all: &mut Vec<T>, is_kept: &[bool]) {
    let mut kept = is_kept.iter();
    all.retain(|_| kept.next().is_none_or(|&is_kept| is_kept));
}
