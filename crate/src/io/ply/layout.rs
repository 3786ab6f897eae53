//! Which of a vertex's properties mean something to a point cloud, and the cloud made from their values.

use glam::DVec3;

use super::header::{Element, Kind, Scalar};
use crate::geometry::PointCloud;
use crate::io::cloud_parts::{origin_of, rounding_of, unit_normals, unless_zero};
use crate::{Error, Result};

/// A scalar property of the vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Column {
    pub(super) scalar: Scalar,
    /// Its index among the vertex's properties.
    pub(super) property: usize,
    /// Bytes before it in a binary vertex. Meaningless after a list.
    pub(super) offset: usize,
}

/// Where the nine values of a point are found: x y z, nx ny nz, red green blue. Absent where the file has none.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    /// x and y are there; z is absent in a scan in the plane.
    pub(super) position: [Option<Column>; 3],
    /// In a scan in the plane z may be absent.
    pub(super) normal: Option<[Option<Column>; 3]>,
    pub(super) color: Option<[Column; 3]>,
}

/// The spellings of a colour's three properties, the first found wins.
const COLOR_NAMES: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];

impl Layout {
    /// Looks the properties up by name.
    ///
    /// # Errors
    /// No x or y, or one of the nine twice.
    pub(super) fn of(vertex: &Element) -> Result<Self> {
        let find = |name| find(vertex, name);
        let coordinate = |name| {
            find(name)?.ok_or_else(|| {
                let problem = if vertex.properties.is_empty() {
                    "The header declares no properties of the vertices".to_owned()
                } else {
                    format!("The vertices have no number called {name}, only {}", vertex.property_names())
                };
                Error::line(vertex.line, problem, "Points need x, y and z, or x and y for a scan in the plane")
            })
        };
        let position = [Some(coordinate("x")?), Some(coordinate("y")?), find("z")?];
        let normal = [find("nx")?, find("ny")?, find("nz")?];
        let has_normal = normal[0].is_some() && normal[1].is_some() && (normal[2].is_some() || position[2].is_none());
        let mut color = None;
        for [red, green, blue] in COLOR_NAMES {
            if let (Some(red), Some(green), Some(blue)) = (find(red)?, find(green)?, find(blue)?) {
                color = color.or(Some([red, green, blue]));
            }
        }
        Ok(Self { position, normal: has_normal.then_some(normal), color })
    }

    /// Whether a coordinate has more digits than single precision holds.
    pub(super) fn holds_doubles(&self) -> bool {
        let is_long = |scalar| matches!(scalar, Scalar::Float64 | Scalar::Int32 | Scalar::Uint32);
        self.position.iter().flatten().any(|column| is_long(column.scalar))
    }

    /// The place of each of the vertex's properties in a [`Row`], where it has one.
    pub(super) fn slots(&self, num_properties: usize) -> Vec<Option<usize>> {
        let mut slots = vec![None; num_properties];
        let normal = self.normal.unwrap_or_default();
        let color = self.color.map_or([None; 3], |color| color.map(Some));
        for (slot, column) in [self.position, normal, color].into_iter().flatten().enumerate() {
            if let Some(column) = column {
                slots[column.property] = Some(slot);
            }
        }
        slots
    }
}

fn find(vertex: &Element, name: &str) -> Result<Option<Column>> {
    let mut found = None;
    let mut offset = 0;
    for (index, property) in vertex.properties.iter().enumerate() {
        let Kind::Scalar(scalar) = property.kind else { continue };
        if property.name == name {
            if found.is_some() {
                let problem = format!("This is a second property called {name}");
                return Err(Error::line(property.line, problem, "Remove or rename one of the two"));
            }
            found = Some(Column { scalar, property: index, offset });
        }
        offset += scalar.size();
    }
    Ok(found)
}

/// The nine values of one vertex in the order of [`Layout`], zero where the file has none.
pub(super) type Row = [f64; 9];

/// Reads one vertex after the other. Cloned to look ahead.
pub(super) trait Rows: Clone {
    fn next_row(&mut self) -> Result<Row>;
}

/// The cloud of the next `count` rows. `most` is an upper bound of how many there can be, from the bytes that are there.
pub(super) fn collect(mut rows: impl Rows, count: u64, most: usize, layout: &Layout) -> Result<PointCloud> {
    let mut ahead = rows.clone();
    let head = (0..count).map_while(|_| ahead.next_row().ok()).map(|row| DVec3::new(row[0], row[1], row[2]));
    let origin = origin_of(head);

    let capacity = count.min(most as u64) as usize;
    let mut positions = Vec::with_capacity(capacity);
    let mut rest = Vec::new();
    let mut normals = Vec::with_capacity(if layout.normal.is_some() { capacity } else { 0 });
    let mut colors = Vec::with_capacity(if layout.color.is_some() { capacity } else { 0 });
    for _ in 0..count {
        let [x, y, z, nx, ny, nz, red, green, blue] = rows.next_row()?;
        let position = DVec3::new(x, y, z) - origin;
        positions.push(position.as_vec3());
        if layout.holds_doubles() {
            rest.push(rounding_of(position));
        }
        if layout.normal.is_some() {
            normals.push(DVec3::new(nx, ny, nz).as_vec3());
        }
        if layout.color.is_some() {
            colors.push([red as f32, green as f32, blue as f32]);
        }
    }
    let normals = layout.normal.and_then(|_| unit_normals(normals));
    let colors = layout.color.map(|columns| byte_colors(&colors, &columns));
    Ok(PointCloud { positions, normals, colors, origin, rounded_off: unless_zero(rest), times: None })
}

/// Colours as bytes. Full intensity is defined in the [module's documentation](super).
pub(super) fn byte_colors(colors: &[[f32; 3]], columns: &[Column; 3]) -> Vec<[u8; 3]> {
    let is = |scalars: &[Scalar]| columns.iter().all(|column| scalars.contains(&column.scalar));
    let candidates: &[f32] = if is(&[Scalar::Int8, Scalar::Uint8]) {
        &[255.0]
    } else if columns.iter().all(|column| column.scalar.integer_range().is_some()) {
        &[255.0, 65_535.0]
    } else {
        &[1.0, 255.0, 65_535.0]
    };
    let largest = colors.as_flattened().iter().copied().fold(0.0, f32::max);
    let full = candidates.iter().copied().find(|&full| largest <= full).unwrap_or(largest);
    // A cast saturates: negative values and NaN become 0.
    colors.iter().map(|color| color.map(|value| (value / full * 255.0).round() as u8)).collect()
}
