//! A depth image as surfels, in the form that registration and mapping use.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{Brightness, Pinhole};

/// A surface element: a point, the normal, and the uncertainty along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel {
    /// A point of the surface (m).
    pub point: Vector3<f64>,
    /// Unit normal, facing the camera.
    pub normal: Vector3<f64>,
    /// Standard deviation of the surface along the normal (m).
    pub sigma: f64,
}

/// Surfels in a grid of square cells over an image, in the camera frame.
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
    /// The surfels of the cells, row by row; `None` where no plane fits. Most of a frame's memory, which copies share.
    pub cells: Arc<Vec<Option<Surfel>>>,
    /// Brightness of the image, where the frame has colours that are to be used.
    pub brightness: Option<Arc<Brightness>>,
}

impl SurfelImage {
    /// The camera whose pixels are the cells.
    pub fn cell_camera(&self) -> Pinhole {
        cell_camera(&self.camera, self.cell_size)
    }

    /// All surfels, row by row.
    pub fn surfels(&self) -> impl Iterator<Item = &Surfel> {
        self.cells.iter().flatten()
    }

    /// Mean of the squares of their depths (m^2); 0 without any.
    #[inline(never)]
    pub(crate) fn mean_square_depth(&self) -> f64 {
        let squares = self.surfels().map(|surfel| surfel.point.z * surfel.point.z);
        let (sum, count) = squares.fold((0.0, 0_u32), |(sum, count), square| (sum + square, count + 1));
        sum / f64::from(count.max(1))
    }
}

/// The camera whose pixels are the cells of `camera`'s image. Incomplete cells at the right and at the bottom are left out.
pub fn cell_camera(camera: &Pinhole, cell_size: usize) -> Pinhole {
    let size = cell_size as f64;
    // The centre of a cell is (size - 1) / 2 pixels from that of its first pixel.
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
