//! Registration of clouds with normals in space, with the metric chosen at run time.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::factors::{PlaneToPlane, PointToPlane};
use super::icp::{IcpOptions, Registration, Source, register_with};
use super::solver::Solver;
use super::target::SurfaceTarget;
use crate::geometry::Pose3;

/// A registration in space.
pub type SpatialRegistration = Registration<Pose3>;

/// The distance that a correspondence between clouds with normals measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum SpatialMetric {
    /// Distance to the plane through the nearest point.
    #[default]
    PointToPlane,
    /// Distance of the two planes through both points: generalised ICP.
    Gicp,
}

/// Registers `source` to `target` in stages from coarse to fine, each starting from the result of the one before. The history is
/// that of all stages, the rest of the result that of the last.
pub fn register_in_space<T: SurfaceTarget<Point = Vector3<f64>>>(
    metric: SpatialMetric,
    source: Source<'_, Vector3<f64>>,
    target: &T,
    init_T_target_source: Pose3,
    (first, finer): (&IcpOptions, &[IcpOptions]),
    solver: &Solver<Pose3>,
) -> SpatialRegistration {
    let register = |init, options| match metric {
        SpatialMetric::PointToPlane => register_with(source, target, init, &PointToPlane, options, solver),
        SpatialMetric::Gicp => register_with(source, target, init, &PlaneToPlane, options, solver),
    };
    let mut registration = register(init_T_target_source, first);
    for options in finer {
        let mut history = registration.history;
        registration = register(registration.T_target_source, options);
        history.append(&mut registration.history);
        registration.history = history;
    }
    registration
}
