//! Prepared frames as bytes and back: a header in JSON, then flat arrays, each with its length before it.

use std::sync::Arc;

use bytemuck::{AnyBitPattern, NoUninit};
use glam::Vec3;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{FrameLabel, FrameNote, MapPoints, PreparedFrame, Surfaces, ValuesSeen, num_bytes};
use crate::camera::brightness::NUM_LEVELS;
use crate::camera::{Brightness, Pinhole, Surfel, SurfelImage};
use crate::error::{Error, Result};
use crate::geometry::{PointCloud, PointTimes};
use crate::io::limits::MAX_PIXELS;
use crate::pipeline::spatial_settings::Quantisation;
use crate::preprocess::color_registration::OutlineContrast;
use crate::preprocess::map_image::MapImage;
use crate::registration::photometric::TexturedPoint;
use crate::registration::prepared_surfels::{PickedCells, PreparedSurfels};
use crate::registration::projective::PackedSurfel;

#[derive(Serialize, Deserialize)]
struct Header {
    label: FrameLabel,
    notes: Vec<FrameNote>,
    values: ValuesSeen,
    gyro: Vec<[f64; 4]>,
    surfaces: SurfacesHeader,
    map_points: MapPointsHeader,
}

#[derive(Serialize, Deserialize)]
enum SurfacesHeader {
    Surfels { grids: Vec<Grid>, brightness: Option<[[usize; 2]; NUM_LEVELS]> },
    Cloud(CloudHeader),
}

#[derive(Serialize, Deserialize)]
enum MapPointsHeader {
    Image { quantisation: Quantisation, camera: Pinhole, unit: f32, has_colors: bool },
    Cloud(CloudHeader),
}

#[derive(Serialize, Deserialize)]
struct Grid {
    quantisation: Quantisation,
    camera: Pinhole,
    cell_size: usize,
    columns: usize,
    rows: usize,
    outline_contrast: OutlineContrast,
}

#[derive(Serialize, Deserialize)]
struct CloudHeader {
    has_normals: bool,
    has_colors: bool,
    /// The earliest of the points' times, where they have some (s).
    first_time: Option<f64>,
}

impl PreparedFrame {
    /// The frame as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let surfaces = match &self.surfaces {
            Surfaces::Surfels(images) => SurfacesHeader::Surfels {
                grids: images.iter().map(grid_of).collect(),
                brightness: brightness_of(images).map(sizes_of),
            },
            Surfaces::Cloud(cloud) => SurfacesHeader::Cloud(cloud_header(cloud)),
        };
        let map_points = match &self.map_points {
            MapPoints::Image(image, quantisation) => MapPointsHeader::Image {
                quantisation: *quantisation,
                camera: image.camera,
                unit: image.unit,
                has_colors: image.colors.is_some(),
            },
            MapPoints::Cloud(cloud) => MapPointsHeader::Cloud(cloud_header(cloud)),
        };
        let (label, notes) = (self.label.clone(), self.notes.clone());
        let gyro = self.gyro.clone();
        let header = Header { label, notes, values: self.values.clone(), gyro, surfaces, map_points };
        let mut bytes = Vec::with_capacity(self.most_bytes());
        put(&mut bytes, &serde_json::to_vec(&header).unwrap_or_default());
        match &self.surfaces {
            Surfaces::Surfels(images) => {
                for (_, image) in images {
                    put_prepared(&mut bytes, image);
                }
                for (_, _, values) in brightness_of(images).into_iter().flat_map(Brightness::levels) {
                    put(&mut bytes, values);
                }
            }
            Surfaces::Cloud(cloud) => put_cloud(&mut bytes, cloud),
        }
        match &self.map_points {
            MapPoints::Image(image, _) => {
                put(&mut bytes, &image.depths);
                put(&mut bytes, &image.normals);
                if let Some(colors) = &image.colors {
                    put(&mut bytes, colors);
                }
            }
            MapPoints::Cloud(cloud) => put_cloud(&mut bytes, cloud),
        }
        bytes
    }

    /// No fewer bytes than it takes, so that they are written in one place.
    fn most_bytes(&self) -> usize {
        let of_surfaces: usize = match &self.surfaces {
            Surfaces::Surfels(images) => {
                let brightness = brightness_of(images).map_or(0, Brightness::num_bytes);
                images.iter().map(|(_, prepared)| most_bytes_of(prepared)).sum::<usize>() + brightness
            }
            Surfaces::Cloud(cloud) => num_bytes(cloud),
        };
        let of_words: usize = self.notes.iter().map(|note| note.subject.len() + note.reason.len()).sum();
        of_surfaces + self.map_points.num_bytes() + 2 * of_words + HEADER_BYTES
    }

    /// The frame that [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// When the bytes are none of a frame.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut rest = bytes;
        let header: Header = serde_json::from_slice(&take::<u8>(&mut rest)?).map_err(|_| no_frame())?;
        let surfaces = match header.surfaces {
            SurfacesHeader::Surfels { grids, brightness } => {
                let images = grids.iter().map(|grid| Ok((grid.quantisation, take_prepared(grid, &mut rest)?)));
                let mut images: Vec<(Quantisation, PreparedSurfels)> = images.collect::<Result<_>>()?;
                if let Some(sizes) = brightness {
                    let brightness = Arc::new(take_brightness(sizes, &mut rest)?);
                    for (_, prepared) in &mut images {
                        prepared.image.brightness = Some(brightness.clone());
                    }
                }
                Surfaces::Surfels(images)
            }
            SurfacesHeader::Cloud(header) => Surfaces::Cloud(take_cloud(&header, &mut rest)?),
        };
        let map_points = match header.map_points {
            MapPointsHeader::Image { quantisation, camera, unit, has_colors } => {
                let (depths, normals) = (take::<u16>(&mut rest)?, take::<[i8; 3]>(&mut rest)?);
                let colors = if has_colors { Some(take::<[u8; 3]>(&mut rest)?) } else { None };
                let pixels = camera.width.saturating_mul(camera.height);
                let lengths = [depths.len(), normals.len(), colors.as_ref().map_or(pixels, Vec::len)];
                if lengths.iter().any(|&length| length != pixels) {
                    return Err(no_frame());
                }
                MapPoints::Image(MapImage { camera, unit, depths, normals, colors }, quantisation)
            }
            MapPointsHeader::Cloud(header) => MapPoints::Cloud(take_cloud(&header, &mut rest)?),
        };
        let Header { label, notes, values, gyro, .. } = header;
        Ok(Self { label, surfaces, map_points, gyro, notes, values })
    }
}

fn grid_of((quantisation, PreparedSurfels { image, outline_contrast, .. }): &(Quantisation, PreparedSurfels)) -> Grid {
    Grid {
        quantisation: *quantisation,
        camera: image.camera,
        cell_size: image.cell_size,
        columns: image.columns,
        rows: image.rows,
        outline_contrast: *outline_contrast,
    }
}

/// All readings of one image are of the same brightness.
fn brightness_of(images: &[(Quantisation, PreparedSurfels)]) -> Option<&Brightness> {
    images.first()?.1.image.brightness.as_deref()
}

/// Columns and rows of its levels.
fn sizes_of(brightness: &Brightness) -> [[usize; 2]; NUM_LEVELS] {
    brightness.levels().map(|(width, height, _)| [width, height])
}

fn take_brightness(sizes: [[usize; 2]; NUM_LEVELS], rest: &mut &[u8]) -> Result<Brightness> {
    let mut levels = sizes.map(|[width, height]| (width, height, Vec::new()));
    for (_, _, values) in &mut levels {
        *values = take::<u16>(rest)?;
    }
    Brightness::from_levels(levels).ok_or_else(no_frame)
}

fn put_prepared(bytes: &mut Vec<u8>, PreparedSurfels { image, picked, coarse, textured, .. }: &PreparedSurfels) {
    put_surfels(bytes, image);
    for cells in picked.lists() {
        put(bytes, cells);
    }
    put_all(bytes, coarse.iter().map(|packed| packed.to_bits()));
    put_all(bytes, textured.iter().map(|point| point.patch));
    put_all(
        bytes,
        textured.iter().map(|TexturedPoint { point: p, values: [a, b, c], .. }| [p.x, p.y, p.z, *a, *b, *c]),
    );
}

fn take_prepared(grid: &Grid, rest: &mut &[u8]) -> Result<PreparedSurfels> {
    let image = take_surfels(grid, rest)?;
    let picked = PickedCells::from_lists([take(rest)?, take(rest)?, take(rest)?, take(rest)?]);
    let coarse = Arc::new(take::<[u32; 8]>(rest)?.into_iter().map(PackedSurfel::from_bits).collect());
    let (patches, numbers) = (take::<u32>(rest)?, take::<[f64; 6]>(rest)?);
    if patches.len() != numbers.len() || patches.iter().any(|&patch| patch as usize >= image.cells.len()) {
        return Err(no_frame());
    }
    let textured = numbers.into_iter().zip(patches).map(|([x, y, z, values @ ..], patch)| {
        let point = Vector3::new(x, y, z);
        TexturedPoint { point, patch, values }
    });
    let textured = textured.collect();
    Ok(PreparedSurfels { image, picked, coarse, textured, outline_contrast: grid.outline_contrast })
}

fn most_bytes_of(PreparedSurfels { image, picked, coarse, textured, .. }: &PreparedSurfels) -> usize {
    let num_picked: usize = picked.lists().iter().map(|cells| cells.len()).sum();
    image.cells.len() * SURFEL_BYTES
        + num_picked * size_of::<u32>()
        + coarse.len() * size_of::<PackedSurfel>()
        + textured.len() * size_of::<TexturedPoint>()
}

/// The filled cells, each with its piece of surface.
#[inline(never)]
fn put_surfels(bytes: &mut Vec<u8>, image: &SurfelImage) {
    bytes.extend((image.surfels().count() as u64).to_le_bytes());
    for (cell, surfel) in (0u32..).zip(image.cells.iter()) {
        if let Some(surfel) = surfel {
            bytes.extend_from_slice(bytemuck::bytes_of(&cell));
            bytes.extend_from_slice(bytemuck::bytes_of(&numbers_of(surfel)));
        }
    }
}

fn cloud_header(cloud: &PointCloud) -> CloudHeader {
    CloudHeader {
        has_normals: cloud.normals.is_some(),
        has_colors: cloud.colors.is_some(),
        first_time: cloud.times.as_ref().map(|times| times.origin),
    }
}

fn put_cloud(bytes: &mut Vec<u8>, cloud: &PointCloud) {
    put(bytes, &cloud.positions);
    if let Some(normals) = &cloud.normals {
        put(bytes, normals);
    }
    if let Some(colors) = &cloud.colors {
        put(bytes, colors);
    }
    if let Some(times) = &cloud.times {
        put(bytes, &times.offsets);
    }
}

fn take_cloud(header: &CloudHeader, rest: &mut &[u8]) -> Result<PointCloud> {
    let positions = take::<Vec3>(rest)?;
    let normals = if header.has_normals { Some(take::<Vec3>(rest)?) } else { None };
    let colors = if header.has_colors { Some(take::<[u8; 3]>(rest)?) } else { None };
    let times = match header.first_time {
        Some(origin) => Some(PointTimes { origin, offsets: take::<f32>(rest)? }),
        None => None,
    };
    let fits = |length: Option<usize>| length.is_none_or(|length| length == positions.len());
    let lengths = [
        normals.as_ref().map(Vec::len),
        colors.as_ref().map(Vec::len),
        times.as_ref().map(|times| times.offsets.len()),
    ];
    if !lengths.into_iter().all(fits) {
        return Err(no_frame());
    }
    Ok(PointCloud { positions, normals, colors, times, ..PointCloud::default() })
}

fn numbers_of(surfel: &Surfel) -> [f64; 7] {
    let (p, n) = (surfel.point, surfel.normal);
    [p.x, p.y, p.z, n.x, n.y, n.z, surfel.sigma]
}

fn take_surfels(grid: &Grid, rest: &mut &[u8]) -> Result<SurfelImage> {
    let filled = take_bytes(rest, SURFEL_BYTES)?;
    let num_cells =
        grid.columns.checked_mul(grid.rows).filter(|&cells| cells as u64 <= MAX_PIXELS).ok_or_else(no_frame)?;
    let mut cells = vec![None; num_cells];
    for filled in filled.chunks_exact(SURFEL_BYTES) {
        let (cell, numbers) = filled.split_at(size_of::<u32>());
        let [x, y, z, nx, ny, nz, sigma]: [f64; 7] = bytemuck::pod_read_unaligned(numbers);
        let surfel = Surfel { point: Vector3::new(x, y, z), normal: Vector3::new(nx, ny, nz), sigma };
        let cell: u32 = bytemuck::pod_read_unaligned(cell);
        *cells.get_mut(cell as usize).ok_or_else(no_frame)? = Some(surfel);
    }
    let Grid { camera, cell_size, columns, rows, .. } = *grid;
    Ok(SurfelImage { camera, cell_size, columns, rows, cells: Arc::new(cells), brightness: None })
}

/// Number of a cell, and the numbers of its piece of surface.
const SURFEL_BYTES: usize = size_of::<u32>() + size_of::<[f64; 7]>();
/// Far more than all that is no list takes.
const HEADER_BYTES: usize = 4096;

fn put<T: NoUninit>(bytes: &mut Vec<u8>, values: &[T]) {
    bytes.extend((values.len() as u64).to_le_bytes());
    bytes.extend_from_slice(bytemuck::cast_slice(values));
}

/// The same, without a list of them.
#[inline(never)]
fn put_all<T: NoUninit>(bytes: &mut Vec<u8>, values: impl ExactSizeIterator<Item = T>) {
    bytes.extend((values.len() as u64).to_le_bytes());
    for value in values {
        bytes.extend_from_slice(bytemuck::bytes_of(&value));
    }
}

fn take<T: NoUninit + AnyBitPattern>(rest: &mut &[u8]) -> Result<Vec<T>> {
    Ok(bytemuck::allocation::pod_collect_to_vec(take_bytes(rest, size_of::<T>())?))
}

/// A list's entries of `size` bytes each, as they lie.
fn take_bytes<'a>(rest: &mut &'a [u8], size: usize) -> Result<&'a [u8]> {
    let (length, after) = rest.split_first_chunk::<8>().ok_or_else(no_frame)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| no_frame())?;
    let size = length.checked_mul(size).filter(|&size| size <= after.len()).ok_or_else(no_frame)?;
    let (entries, after) = after.split_at(size);
    *rest = after;
    Ok(entries)
}

fn no_frame() -> Error {
    Error::whole("These bytes are not a prepared frame of this version", "Prepare and register with the same version")
}
