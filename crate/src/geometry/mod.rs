//! Points and rigid motions, the types that all other modules use.
//!
//! [`PointCloud`] holds positions in single precision; [`Pose2`] and [`Pose3`] are rigid motions in double precision, with
//! exponential, logarithm and adjoint behind [`RigidMotion`]. Read `pose` first.

pub(crate) mod algebra;
pub(crate) mod connected_parts;
pub(crate) mod hypotheses;
pub(crate) mod jacobi;
pub(crate) mod mahalanobis;
pub(crate) mod point_cloud;
pub(crate) mod point_times;
pub(crate) mod pose;
pub(crate) mod pose_distance;
pub(crate) mod quantile;
pub mod random;
pub(crate) mod robust_ratio;
pub(crate) mod rotation;
pub(crate) mod scalar;
pub(crate) mod triangle_mesh;

pub use algebra::{Jacobian, SquareMatrix, Vector};
pub use point_cloud::PointCloud;
pub use point_times::PointTimes;
pub use pose::{Embedding, Pose2, Pose3, RigidMotion};
pub use triangle_mesh::TriangleMesh;
