//! Prepared frames as bytes and back: a header in JSON, then flat arrays, each with its length before it.

use bytemuck::{AnyBitPattern, NoUninit};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{FrameLabel, PreparedFrame};
use crate::camera::{Pinhole, Surfel, SurfelImage};
use crate::error::{Error, Result};
use crate::preprocess::map_image::MapImage;
use crate::spatial_settings::Quantisation;

#[derive(Serialize, Deserialize)]
struct Header {
    label: FrameLabel,
    notes: Vec<String>,
    grids: Vec<Grid>,
    map_camera: Pinhole,
    map_unit: f32,
    has_colors: bool,
}

#[derive(Serialize, Deserialize)]
struct Grid {
    quantisation: Quantisation,
    camera: Pinhole,
    cell_size: usize,
    columns: usize,
    rows: usize,
}

impl PreparedFrame {
    /// The frame as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let grid = |(quantisation, image): &(Quantisation, SurfelImage)| Grid {
            quantisation: *quantisation,
            camera: image.camera,
            cell_size: image.cell_size,
            columns: image.columns,
            rows: image.rows,
        };
        let header = Header {
            label: self.label.clone(),
            notes: self.notes.clone(),
            grids: self.surfels.iter().map(grid).collect(),
            map_camera: self.map_image.camera,
            map_unit: self.map_image.unit,
            has_colors: self.map_image.colors.is_some(),
        };
        let mut bytes = Vec::new();
        put(&mut bytes, &serde_json::to_vec(&header).unwrap_or_default());
        for (_, image) in &self.surfels {
            let filled = || image.cells.iter().enumerate().filter_map(|(cell, surfel)| Some((cell, surfel.as_ref()?)));
            put(&mut bytes, &filled().map(|(cell, _)| cell as u32).collect::<Vec<_>>());
            put(&mut bytes, &filled().map(|(_, surfel)| numbers_of(surfel)).collect::<Vec<_>>());
        }
        put(&mut bytes, &self.map_image.depths);
        put(&mut bytes, &self.map_image.normals);
        if let Some(colors) = &self.map_image.colors {
            put(&mut bytes, colors);
        }
        bytes
    }

    /// The frame that [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// When the bytes are none of a frame.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut rest = bytes;
        let header: Header = serde_json::from_slice(&take::<u8>(&mut rest)?).map_err(|_| no_frame())?;
        let surfels = header.grids.iter().map(|grid| Ok((grid.quantisation, surfel_image(grid, &mut rest)?)));
        let surfels = surfels.collect::<Result<_>>()?;
        let (depths, normals) = (take::<u16>(&mut rest)?, take::<[i8; 3]>(&mut rest)?);
        let colors = if header.has_colors { Some(take::<[u8; 3]>(&mut rest)?) } else { None };
        let pixels = header.map_camera.width.saturating_mul(header.map_camera.height);
        let lengths = [depths.len(), normals.len(), colors.as_ref().map_or(pixels, Vec::len)];
        if lengths.iter().any(|&length| length != pixels) {
            return Err(no_frame());
        }
        let map_image = MapImage { camera: header.map_camera, unit: header.map_unit, depths, normals, colors };
        Ok(Self { label: header.label, surfels, map_image, notes: header.notes })
    }
}

fn numbers_of(surfel: &Surfel) -> [f64; 7] {
    let (p, n) = (surfel.point, surfel.normal);
    [p.x, p.y, p.z, n.x, n.y, n.z, surfel.deviation]
}

fn surfel_image(grid: &Grid, rest: &mut &[u8]) -> Result<SurfelImage> {
    let (filled, numbers) = (take::<u32>(rest)?, take::<[f64; 7]>(rest)?);
    let num_cells = grid.columns.checked_mul(grid.rows).filter(|&cells| cells <= MAX_CELLS).ok_or_else(no_frame)?;
    let mut cells = vec![None; num_cells];
    for (&cell, &[x, y, z, nx, ny, nz, deviation]) in filled.iter().zip(&numbers) {
        let surfel = Surfel { point: Vector3::new(x, y, z), normal: Vector3::new(nx, ny, nz), deviation };
        *cells.get_mut(cell as usize).ok_or_else(no_frame)? = Some(surfel);
    }
    Ok(SurfelImage { camera: grid.camera, cell_size: grid.cell_size, columns: grid.columns, rows: grid.rows, cells })
}

/// No image that can be read has more cells.
const MAX_CELLS: usize = 1 << 24;

fn put<T: NoUninit>(bytes: &mut Vec<u8>, values: &[T]) {
    bytes.extend((values.len() as u64).to_le_bytes());
    bytes.extend_from_slice(bytemuck::cast_slice(values));
}

fn take<T: NoUninit + AnyBitPattern>(rest: &mut &[u8]) -> Result<Vec<T>> {
    let (length, after) = rest.split_first_chunk::<8>().ok_or_else(no_frame)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| no_frame())?;
    let size = length.checked_mul(size_of::<T>()).filter(|&size| size <= after.len()).ok_or_else(no_frame)?;
    let (values, after) = after.split_at(size);
    *rest = after;
    Ok(bytemuck::allocation::pod_collect_to_vec(values))
}

fn no_frame() -> Error {
    Error::whole("These bytes are no prepared frame of this version", "Prepare and register with the same version")
}
