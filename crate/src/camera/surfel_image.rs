//! A depth image as small pieces of surface: what registration and mapping work with.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{Brightness, Pinhole};

/// A piece of surface: a point on it, where it faces and how well that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel {
    /// A point of the surface (m).
    pub point: Vector3<f64>,
    /// Unit normal, towards the side it was seen from.
    pub normal: Vector3<f64>,
    /// Standard deviation of the surface along the normal (m).
    pub sigma: f64,
}

/// Pieces of surface in a grid of square cells over an image, in the camera's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfelImage {
    /// The camera of the whole image.
    pub camera: Pinhole,
    /// Side of a cell (pixels).
    pub cell_size: usize,
    /// Cells in a row.
    pub columns: usize,
    /// Rows of cells.
    pub rows: usize,
    /// Row by row; `None` where no surface could be told.
    pub cells: Vec<Option<Surfel>>,
    /// How bright the image is, where the frame has colours that are to be used.
    pub brightness: Option<Arc<Brightness>>,
}

impl SurfelImage {
    /// The camera whose pixels are the cells.
    pub fn cell_camera(&self) -> Pinhole {
        cell_camera(&self.camera, self.cell_size)
    }

    /// All pieces there are, row by row.
    pub fn surfels(&self) -> impl Iterator<Item = &Surfel> {
        self.cells.iter().flatten()
    }
}

/// The camera that sees the cells of `camera`'s image as pixels. What is left over at the right and at the bottom is
/// no cell.
pub fn cell_camera(camera: &Pinhole, cell_size: usize) -> Pinhole {
    let size = cell_size as f64;
    // A cell's middle lies (size - 1) / 2 pixels from its first pixel's.
    let middle = (size - 1.0) / 2.0;
    Pinhole {
        width: camera.width / cell_size,
        height: camera.height / cell_size,
        fx: camera.fx / size,
        fy: camera.fy / size,
        cx: (camera.cx - middle) / size,
        cy: (camera.cy - middle) / size,
    }
}
