//! A depth frame prepared for registration: its surfels and the samples of them that each stage registers. They depend on
//! the frame alone, so any worker can prepare them ahead.

mod surfel_cloud;

use std::sync::Arc;

use self::surfel_cloud::NormalBins;
pub(crate) use self::surfel_cloud::SurfelCloud;
use crate::camera::surfel_image::{SurfelImage, cell_camera};
use crate::camera::{Brightness, Pinhole};
use crate::preprocess::color_registration::OutlineContrast;
use crate::registration::photometric::{TexturedPoint, textured_points};
use crate::registration::projective::{PackedSurfel, ProjectiveTarget};

/// The surfels of a frame with the samples that registration uses, as [`DepthOptions::prepared`] makes them.
///
/// [`DepthOptions::prepared`]: crate::odometry::depth::DepthOptions::prepared
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedSurfels {
    /// All surfels.
    pub image: SurfelImage,
    pub(crate) picked: PickedCells,
    /// The nearest surfel of each 2 x 2 cells, tagged with the cell of [`coarse_camera`](Self::coarse_camera).
    pub(crate) coarse: Arc<Vec<PackedSurfel>>,
    /// Points of high image gradient, where there is a colour image.
    pub(crate) textured: Vec<TexturedPoint>,
    /// Slopes of the brightness on the outlines of objects and beside them: whether the colours are registered to the depth.
    pub outline_contrast: OutlineContrast,
}

/// Sampled cells of the image, each list with its normals distributed evenly.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct PickedCells {
    pub(crate) sparse: Vec<u32>,
    pub(crate) middle: Vec<u32>,
    pub(crate) fine: Vec<u32>,
    pub(crate) for_submap: Vec<u32>,
}

impl PickedCells {
    /// All lists, in the order that [`from_lists`](Self::from_lists) takes them.
    pub(crate) fn lists(&self) -> [&[u32]; 4] {
        [&self.sparse, &self.middle, &self.fine, &self.for_submap]
    }

    pub(crate) fn from_lists([sparse, middle, fine, for_submap]: [Vec<u32>; 4]) -> Self {
        Self { sparse, middle, fine, for_submap }
    }
}

/// Points that score one of hundreds of pose hypotheses.
pub(crate) const SPARSE_POINTS: usize = 250;
/// Points that refine the best hypotheses.
const MIDDLE_POINTS: usize = 800;
/// Points that are matched with a submap for a loop.
pub(crate) const SUBMAP_POINTS: usize = 700;
/// Side (cells) of the squares that keep one surfel for submaps.
const COARSE_SIDE: usize = 2;

impl PreparedSurfels {
    /// Samples the surfels; `num_fine` of them are registered in the last stage.
    pub(crate) fn new(image: SurfelImage, num_fine: usize) -> Self {
        let filled = (0u32..).zip(image.cells.iter()).filter(|(_, surfel)| surfel.is_some());
        let filled: Vec<u32> = filled.map(|(cell, _)| cell).collect();
        let bins = NormalBins::of(image.surfels().map(|surfel| &surfel.normal));
        let pick = |most| bins.sample_evenly(most).into_iter().map(|index| filled[index]).collect();
        let picked = PickedCells {
            sparse: pick(SPARSE_POINTS),
            middle: pick(MIDDLE_POINTS),
            fine: pick(num_fine),
            for_submap: pick(SUBMAP_POINTS),
        };
        let coarse = Arc::new(ProjectiveTarget::of_frame(&image, COARSE_SIDE).packed_surfels());
        let textured = textured_points(&image);
        Self { image, picked, coarse, textured, outline_contrast: OutlineContrast::default() }
    }

    /// Memory of its surfels and its brightness, most of what it takes on the heap (bytes).
    pub(crate) fn num_bytes(&self) -> usize {
        let brightness = self.image.brightness.as_deref().map_or(0, Brightness::num_bytes);
        size_of_val(self.image.cells.as_slice()) + brightness
    }

    pub(crate) fn sparse(&self) -> SurfelCloud {
        self.cloud(&self.picked.sparse)
    }

    pub(crate) fn middle(&self) -> SurfelCloud {
        self.cloud(&self.picked.middle)
    }

    pub(crate) fn fine(&self) -> SurfelCloud {
        self.cloud(&self.picked.fine)
    }

    pub(crate) fn for_submap(&self) -> SurfelCloud {
        self.cloud(&self.picked.for_submap)
    }

    fn cloud(&self, cells: &[u32]) -> SurfelCloud {
        SurfelCloud::of(cells.iter().filter_map(|&cell| *self.image.cells.get(cell as usize)?))
    }

    /// The camera with one pixel per square of cells.
    fn coarse_camera(&self) -> Pinhole {
        cell_camera(&self.image.camera, COARSE_SIDE * self.image.cell_size)
    }

    /// The nearest surfel of each square of cells as a target, in the camera's frame.
    pub(crate) fn coarse_view(&self) -> ProjectiveTarget {
        ProjectiveTarget::from_cells(&self.coarse_camera(), &self.coarse)
    }
}
