//! Vertices as bytes. Records of one length, the usual case, are read column by column: the type of a property is looked
//! at once, not once a point.

use glam::{DVec3, Vec3};

use super::header::{Element, Kind, Property, Scalar};
use super::layout::{Column, Layout, Row, Rows, byte_colors, collect};
use crate::geometry::PointCloud;
use crate::io::cloud_parts::{origin_of, rounding_of, unit_normals, unless_zero};
use crate::io::text::shorten;
use crate::{Error, Result};

/// Reads the vertices of a binary file whose header ends at `start`; `BIG` is its byte order.
pub(super) fn read<const BIG: bool>(
    bytes: &[u8],
    start: usize,
    before: &[Element],
    vertex: &Element,
    layout: &Layout,
) -> Result<PointCloud> {
    let mut position = start;
    for element in before {
        position = skip_element::<BIG>(bytes, position, element)?;
    }
    let rest = &bytes[position..];
    if let Some(stride) = vertex.stride() {
        let fits = rest.len() / stride;
        if (fits as u64) < vertex.count {
            return Err(cut_off(bytes, vertex, fits as u64));
        }
        let records = Records::<BIG> { bytes: &rest[..vertex.count as usize * stride], stride };
        return Ok(records.cloud(layout));
    }
    let slots = layout.slots(vertex.properties.len());
    let rows = ListRows::<BIG> { bytes, position, vertex, slots: &slots, index: 0 };
    // Every property takes a byte at the least.
    collect(rows, vertex.count, rest.len() / vertex.properties.len(), layout)
}

fn cut_off(bytes: &[u8], element: &Element, index: u64) -> Error {
    let (name, count) = (element.shown_name(), element.count);
    let size = element.stride().map_or(String::new(), |stride| format!(", each of {stride} bytes"));
    let problem = format!("The file is cut off: it ends in {name} {} of the {count} announced{size}", index + 1);
    Error::byte(bytes.len(), problem, "Copy or export it again")
}

/// The position after all instances of `element`.
fn skip_element<const BIG: bool>(bytes: &[u8], mut position: usize, element: &Element) -> Result<usize> {
    let rest = (bytes.len() - position) as u64;
    if let Some(stride) = element.stride().map(|stride| stride as u64) {
        let length = element.count.checked_mul(stride).filter(|&length| length <= rest);
        return match length {
            Some(length) => Ok(position + length as usize),
            None => Err(cut_off(bytes, element, rest / stride)),
        };
    }
    for index in 0..element.count {
        for property in &element.properties {
            position =
                skip_property::<BIG>(bytes, position, property)?.ok_or_else(|| cut_off(bytes, element, index))?;
        }
    }
    Ok(position)
}

/// The position after one property, none if the file ends before it.
///
/// # Errors
/// A list of negative length.
fn skip_property<const BIG: bool>(bytes: &[u8], position: usize, property: &Property) -> Result<Option<usize>> {
    let rest = &bytes[position..];
    let length = match property.kind {
        Kind::Scalar(scalar) => scalar.size() as u64,
        Kind::List { count, item } => {
            let Some(start) = rest.get(..count.size()) else { return Ok(None) };
            let items = value::<BIG>(start, count);
            if items < 0.0 {
                let problem = format!("The list {} has a length of {items}", shorten(property.name.as_bytes()));
                return Err(Error::byte(position, problem, "Export the file again, with lengths of type uchar"));
            }
            // At most 2^32 items of 8 bytes.
            count.size() as u64 + items as u64 * item.size() as u64
        }
    };
    Ok((length <= rest.len() as u64).then(|| position + length as usize))
}

/// A number as a binary file has it.
trait Number: Copy {
    const SIZE: usize;
    /// The number at the start of `bytes`, which hold `SIZE` at the least.
    fn read<const BIG: bool>(bytes: &[u8]) -> Self;
    fn double(self) -> f64;
    fn single(self) -> f32;
}

macro_rules! numbers {
    ($($type:ty),*) => {$(
        impl Number for $type {
            const SIZE: usize = size_of::<$type>();
            #[inline]
            fn read<const BIG: bool>(bytes: &[u8]) -> Self {
                let bytes = bytes.first_chunk().copied().unwrap_or_default();
                if BIG { Self::from_be_bytes(bytes) } else { Self::from_le_bytes(bytes) }
            }
            #[inline]
            fn double(self) -> f64 {
                self as f64
            }
            #[inline]
            fn single(self) -> f32 {
                self as f32
            }
        }
    )*};
}
numbers!(i8, u8, i16, u16, i32, u32, f32, f64);

/// Calls a function that is generic over a [`Number`] with the type that `$scalar` names.
macro_rules! with_type {
    ($scalar:expr, $T:ident => $call:expr) => {
        with_type!(@one_of $scalar, $T, $call, Int8 i8, Uint8 u8, Int16 i16, Uint16 u16, Int32 i32, Uint32 u32, Float32 f32, Float64 f64)
    };
    (@one_of $scalar:expr, $T:ident, $call:expr, $($name:ident $type:ty),*) => {
        match $scalar {
            $(Scalar::$name => {
                type $T = $type;
                $call
            })*
        }
    };
}

/// The number of type `scalar` at the start of `bytes`.
fn value<const BIG: bool>(bytes: &[u8], scalar: Scalar) -> f64 {
    with_type!(scalar, T => T::read::<BIG>(bytes).double())
}

/// Vertices without lists: records of one length, whole.
#[derive(Clone, Copy)]
struct Records<'a, const BIG: bool> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a, const BIG: bool> Records<'a, BIG> {
    fn iter(self) -> std::slice::ChunksExact<'a, u8> {
        self.bytes.chunks_exact(self.stride)
    }

    fn cloud(self, layout: &Layout) -> PointCloud {
        let coordinate = |record: &[u8], column: Option<Column>| {
            column.map_or(0.0, |column| value::<BIG>(&record[column.offset..], column.scalar))
        };
        let points = || self.iter().map(|record| DVec3::from(layout.position.map(|column| coordinate(record, column))));
        let origin = origin_of(points());
        let rest = || points().map(|point| rounding_of(point - origin)).collect();
        PointCloud {
            positions: self.vectors(&layout.position, origin),
            normals: layout.normal.and_then(|normal| unit_normals(self.vectors(&normal, DVec3::ZERO))),
            colors: layout.color.map(|color| self.colors(&color)),
            origin,
            rounded_off: layout.holds_doubles().then(rest).and_then(unless_zero),
            times: None,
        }
    }

    /// Three columns less `origin`; a column that is absent is zero.
    fn vectors(self, columns: &[Option<Column>; 3], origin: DVec3) -> Vec<Vec3> {
        if let [Some(x), Some(y), Some(z)] = *columns
            && [y.scalar, z.scalar] == [x.scalar; 2]
            && [y.offset, z.offset] == [x.offset + x.scalar.size(), x.offset + 2 * x.scalar.size()]
        {
            return with_type!(x.scalar, T => self.adjacent::<T>(x.offset, origin));
        }
        let mut vectors = vec![Vec3::ZERO; self.bytes.len() / self.stride];
        for (axis, column) in columns.iter().enumerate() {
            if let Some(column) = column {
                let origin = origin[axis];
                with_type!(column.scalar, T => {
                    for (vector, value) in vectors.iter_mut().zip(self.column::<T>(column.offset)) {
                        vector[axis] = (value.double() - origin) as f32;
                    }
                });
            }
        }
        vectors
    }

    fn column<T: Number>(self, offset: usize) -> impl Iterator<Item = T> {
        self.iter().map(move |record| T::read::<BIG>(&record[offset..]))
    }

    /// Three numbers of one type side by side, as nearly every file has them.
    fn adjacent<T: Number>(self, offset: usize, origin: DVec3) -> Vec<Vec3> {
        let numbers = |record: &[u8]| {
            let record = &record[offset..offset + 3 * T::SIZE];
            [0, T::SIZE, 2 * T::SIZE].map(|at| T::read::<BIG>(&record[at..]))
        };
        if origin == DVec3::ZERO {
            self.iter().map(|record| Vec3::from(numbers(record).map(T::single))).collect()
        } else {
            self.iter().map(|record| (DVec3::from(numbers(record).map(T::double)) - origin).as_vec3()).collect()
        }
    }

    fn colors(self, columns: &[Column; 3]) -> Vec<[u8; 3]> {
        if columns.iter().all(|column| column.scalar == Scalar::Uint8) {
            let offsets = columns.map(|column| column.offset);
            return self.iter().map(|record| offsets.map(|offset| record[offset])).collect();
        }
        let mut colors = vec![[0.0; 3]; self.bytes.len() / self.stride];
        for (channel, column) in columns.iter().enumerate() {
            with_type!(column.scalar, T => {
                for (color, value) in colors.iter_mut().zip(self.column::<T>(column.offset)) {
                    color[channel] = value.single();
                }
            });
        }
        byte_colors(&colors, columns)
    }
}

/// Vertices with lists, whose lengths differ.
#[derive(Clone)]
struct ListRows<'a, const BIG: bool> {
    bytes: &'a [u8],
    position: usize,
    vertex: &'a Element<'a>,
    /// For each property its place in a row.
    slots: &'a [Option<usize>],
    /// How many vertices came before.
    index: u64,
}

impl<const BIG: bool> Rows for ListRows<'_, BIG> {
    fn next_row(&mut self) -> Result<Row> {
        let mut row = [0.0; 9];
        for (property, slot) in self.vertex.properties.iter().zip(self.slots) {
            let next = skip_property::<BIG>(self.bytes, self.position, property)?
                .ok_or_else(|| cut_off(self.bytes, self.vertex, self.index))?;
            if let (Kind::Scalar(scalar), Some(slot)) = (property.kind, *slot) {
                row[slot] = value::<BIG>(&self.bytes[self.position..next], scalar);
            }
            self.position = next;
        }
        self.index += 1;
        Ok(row)
    }
}
