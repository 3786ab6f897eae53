//! The surfaces of a node, stored for the rest of the run in a third of the memory that registration needs.

use std::borrow::Cow;
use std::sync::Arc;

use super::submap::{FrameSurfaces, SubmapFrame};
use crate::camera::Pinhole;
use crate::registration::prepared_surfels::SurfelCloud;
use crate::registration::projective::{PackedSurfel, ProjectiveTarget};

/// A frame's surfaces. Every new frame is registered to the recent ones; older ones are only needed where the path returns.
pub(super) enum StoredSurfaces {
    Whole(Arc<FrameSurfaces>),
    Packed(PackedSurfaces),
}

/// Surfaces in single precision, accurate to a micrometre.
pub(super) struct PackedSurfaces {
    source: Vec<PackedSurfel>,
    camera: Pinhole,
    /// The surfels of the view, each with its cell.
    surfels: Arc<Vec<PackedSurfel>>,
}

impl StoredSurfaces {
    /// For registration to a submap.
    pub(super) fn surfaces(&self) -> Arc<FrameSurfaces> {
        match self {
            Self::Whole(surfaces) => Arc::clone(surfaces),
            Self::Packed(packed) => Arc::new(packed.unpacked()),
        }
    }

    /// As part of a submap.
    pub(super) fn as_submap_frame(&self) -> SubmapFrame<'_> {
        match self {
            Self::Whole(surfaces) => SubmapFrame { view: Cow::Borrowed(&surfaces.view), surfels: &surfaces.surfels },
            Self::Packed(packed) => SubmapFrame { view: Cow::Owned(packed.view()), surfels: &packed.surfels },
        }
    }

    pub(super) fn pack(&mut self) {
        if let Self::Whole(surfaces) = self {
            *self = Self::Packed(PackedSurfaces::new(surfaces));
        }
    }

    /// Memory of the packed surfaces (bytes).
    pub(super) fn num_packed_bytes(&self) -> usize {
        let Self::Packed(PackedSurfaces { source, surfels, .. }) = self else { return 0 };
        size_of::<PackedSurfel>() * (source.capacity() + surfels.capacity())
    }
}

impl PackedSurfaces {
    fn new(FrameSurfaces { source, view, surfels }: &FrameSurfaces) -> Self {
        let source = source.surfels().map(|surfel| PackedSurfel::new(&surfel, 0)).collect();
        Self { source, camera: *view.camera(), surfels: surfels.clone() }
    }

    fn view(&self) -> ProjectiveTarget {
        ProjectiveTarget::from_cells(&self.camera, &self.surfels)
    }

    fn unpacked(&self) -> FrameSurfaces {
        let source = SurfelCloud::of(self.source.iter().map(PackedSurfel::surfel));
        FrameSurfaces { source, view: self.view(), surfels: self.surfels.clone() }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::camera::surfel_image::cell_camera;
    use crate::camera::{Surfel, SurfelImage};
    use crate::odometry::depth::DepthOptions;
    use crate::registration::free_space::FreeSpaceTest;
    use crate::registration::prepared_surfels::PreparedSurfels;

    /// A wall with a bend two metres ahead, as a camera of 640 x 480 pixels sees it.
    pub(in super::super) fn wall() -> PreparedSurfels {
        let camera = Pinhole::new(640, 480, [500.0, 500.0, 319.5, 239.5]).unwrap();
        let (columns, rows) = (160, 120);
        let cells = cell_camera(&camera, 4);
        let surfel = |cell: usize| {
            let ray = cells.ray((cell % columns) as f64, (cell / columns) as f64);
            let normal = Vector3::new(if ray.x < 0.0 { 0.3 } else { -0.3 }, 0.1, -1.0).normalize();
            Some(Surfel { point: ray * (-2.0 / normal.dot(&ray)), normal, sigma: 0.01 })
        };
        let cells = (0..columns * rows).map(surfel).collect();
        let cells = std::sync::Arc::new(cells);
        let image = SurfelImage { camera, cell_size: 4, columns, rows, cells, brightness: None };
        DepthOptions::default().prepared(image)
    }

    #[test]
    fn packing_keeps_the_surfaces_to_a_micrometre() {
        let whole = FrameSurfaces::new(&wall());
        let packed = PackedSurfaces::new(&whole);
        let unpacked = packed.unpacked();
        assert_eq!(unpacked.view.len(), whole.view.len());
        for (before, after) in whole.view.surfels().zip(unpacked.view.surfels()) {
            assert!((before.point - after.point).norm() < 1e-6 && (before.normal - after.normal).norm() < 1e-6);
            let query = before.point * 0.999;
            let (a, b) = (whole.view.classify_leniently(&query, 0.02), unpacked.view.classify_leniently(&query, 0.02));
            assert!(
                matches!((a, b), (FreeSpaceTest::Agreeing(a), FreeSpaceTest::Agreeing(b)) if (a.point - b.point).norm() < 1e-6)
            );
        }
        let (before, after) = (&whole.source, &unpacked.source);
        assert_eq!(before.points.len(), after.points.len());
        assert!(before.points.iter().zip(&after.points).all(|(a, b)| (a - b).norm() < 1e-6));
        assert!(before.normals.iter().zip(&after.normals).all(|(a, b)| (a - b).norm() < 1e-6));
    }

    #[test]
    fn packed_surfaces_take_little_memory() {
        let mut stored = StoredSurfaces::Whole(Arc::new(FrameSurfaces::new(&wall())));
        stored.pack();
        let bytes = stored.num_packed_bytes();
        assert!((100_000..200_000).contains(&bytes), "{bytes} bytes");
    }
}
