//! A depth frame made ready for registration: its surfaces, and what is picked of them whatever they are held against.
//! That follows from the frame alone, so it is done ahead, in any worker.

mod surfel_cloud;

use self::surfel_cloud::Directions;
pub(crate) use self::surfel_cloud::SurfelCloud;
use crate::camera::Pinhole;
use crate::camera::surfel_image::{SurfelImage, cell_camera};
use crate::registration::photometric::{TexturedPoint, textured_points};
use crate::registration::projective::{PackedSurfel, ProjectiveTarget};

/// A frame's surfaces with what registration picks of them, as [`DepthOptions::prepared`] makes it.
///
/// [`DepthOptions::prepared`]: crate::odometry::depth::DepthOptions::prepared
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedSurfels {
    /// All of them.
    pub image: SurfelImage,
    pub(crate) picked: PickedCells,
    /// Of four neighbouring pieces the nearest, by the cells of [`coarse_camera`](Self::coarse_camera) which are their tags.
    pub(crate) coarse: Vec<PackedSurfel>,
    /// What stands out of the picture, where there is one.
    pub(crate) textured: Vec<TexturedPoint>,
}

/// Cells of the image, each list of them evenly over the directions that surfaces face.
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

/// Points that score a guess: hundreds of guesses are looked at.
const SPARSE_POINTS: usize = 250;
/// Points that refine the best guesses.
const MIDDLE_POINTS: usize = 800;
/// Points that look for partners in a place seen before.
pub(crate) const SUBMAP_POINTS: usize = 700;
/// Side of the squares of cells of which one piece is enough for places seen before.
const COARSE_SIDE: usize = 2;

impl PreparedSurfels {
    /// Picks what registration needs; `num_fine` points are registered in the end.
    pub(crate) fn new(image: SurfelImage, num_fine: usize) -> Self {
        let filled = (0u32..).zip(&image.cells).filter(|(_, surfel)| surfel.is_some());
        let filled: Vec<u32> = filled.map(|(cell, _)| cell).collect();
        let directions = Directions::of(image.surfels().map(|surfel| &surfel.normal));
        let pick = |most| directions.evenly(most).into_iter().map(|index| filled[index]).collect();
        let picked = PickedCells {
            sparse: pick(SPARSE_POINTS),
            middle: pick(MIDDLE_POINTS),
            fine: pick(num_fine),
            for_submap: pick(SUBMAP_POINTS),
        };
        let coarse = ProjectiveTarget::of_frame(&image, COARSE_SIDE).packed_surfels();
        let textured = textured_points(&image);
        Self { image, picked, coarse, textured }
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

    /// The camera whose pixels are squares of cells.
    fn coarse_camera(&self) -> Pinhole {
        cell_camera(&self.image.camera, COARSE_SIDE * self.image.cell_size)
    }

    /// What the camera sees, of four neighbouring pieces the nearest, in its own frame.
    pub(crate) fn coarse_view(&self) -> ProjectiveTarget {
        ProjectiveTarget::from_cells(&self.coarse_camera(), &self.coarse)
    }
}
