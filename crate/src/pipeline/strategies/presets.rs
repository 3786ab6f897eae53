//! The strategies of the default comparison.

use crate::odometry::voxel::{
    AddedPoints, KeptPoint, MapKind, ThresholdKind, VoxelOdometryMotion, VoxelOdometrySettings,
};
use crate::pipeline::settings::Preset;

/// The strategies of the default comparison: the simplest one, two voxel sizes, then single changes to the map of 0.1 m, and
/// finally all changes together.
pub fn strategy_presets() -> Vec<Preset<VoxelOdometrySettings>> {
    let voxels = VoxelOdometrySettings::default();
    vec![
        Preset {
            name: "plain",
            label: "Plain",
            explanation: "The simplest strategy: every point of every frame stays in the map, all points of a frame are matched, and the \
                          search index is built anew each time. It grows slower and larger with every frame.",
            settings: VoxelOdometrySettings { map: MapKind::Whole, source_voxel_size: 0.0, ..voxels.clone() },
        },
        Preset {
            name: "voxels_0.1",
            label: "Voxels 0.1 m",
            explanation: "The map keeps one point per cube of 10 cm, the first one seen. Each frame is thinned in the same way before it is matched.",
            settings: voxels.clone(),
        },
        Preset {
            name: "voxels_0.3",
            label: "Voxels 0.3 m",
            explanation: "The same with cubes of 30 cm, which keep a ninth of the points on a wall.",
            settings: VoxelOdometrySettings { map_voxel_size: 0.3, source_voxel_size: 0.3, ..voxels.clone() },
        },
        Preset {
            name: "planar",
            label: "Planar motion",
            explanation: "Voxels of 10 cm. The sensor stays level and at its height, so each frame has three unknowns instead of six.",
            settings: VoxelOdometrySettings { motion: VoxelOdometryMotion::Planar, ..voxels.clone() },
        },
        Preset {
            name: "golden_data",
            label: "Golden data",
            explanation: "Voxels of 10 cm. Only points without a partner in the map are added to it, that is, what is new.",
            settings: VoxelOdometrySettings { added: AddedPoints::Unmatched, ..voxels.clone() },
        },
        Preset {
            name: "adaptive",
            label: "Adaptive threshold",
            explanation: "Voxels of 10 cm. The largest distance of a pair follows from how far predicted poses were off so far, as in KISS-ICP.",
            settings: VoxelOdometrySettings { threshold: ThresholdKind::Adaptive, ..voxels.clone() },
        },
        Preset {
            name: "together",
            label: "All together",
            explanation: "Voxels of 10 cm, planar motion, golden data and the adaptive threshold.",
            settings: VoxelOdometrySettings {
                motion: VoxelOdometryMotion::Planar,
                added: AddedPoints::Unmatched,
                threshold: ThresholdKind::Adaptive,
                kept: KeptPoint::First,
                ..voxels
            },
        },
    ]
}
