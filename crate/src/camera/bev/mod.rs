//! Bird's-eye view: a pixel of a top view is mapped to a front view by way of the ground plane.
//!
//! Given are two pinhole cameras and a plane. The ray of a pixel intersects the plane, and the intersection is projected into
//! the other camera. The cameras may have any orientation, and the plane may be tilted.
//!
//! # The derivation
//!
//! Camera frames are x right, y down, z forward; pixel (0, 0) is the middle of the upper left pixel, so an image of
//! `width` pixels reaches from -1/2 to `width` - 1/2. `R` and `C` are rotation and position of `T_world_camera`.
//!
//! **The focal length.** The middle of the image and its right edge see directions half a field of view `h` apart, so
//! half the width is `f tan(h / 2)`:
//!
//! > (1)  `f = (width / 2) / tan(h / 2)`
//!
//! The optical axis is put at `cx = width / 2`, `cy = height / 2`: half a pixel right of and below the middle of the image.
//!
//! Pixels are square, so the same `f` holds down the columns, and the two fields of view are tied through their
//! tangents. (Scaling the angle itself, `v = h height / width`, is right for square images only.)
//!
//! > (2)  `tan(v / 2) = (height / width) tan(h / 2)`
//!
//! **The ray.** The pixel `p = (u, v, 1)` sees the points `d z` in front of the camera, z being the depth (m); in the
//! world they lie on a line that begins at `C`:
//!
//! > (3)  `d = K^-1 p = ((u - cx) / fx, (v - cy) / fy, 1)`, `r = R d`, `X(t) = C + t r`
//!
//! **The ground.** The plane holds the points with `n . X = delta`. Putting (3) in gives the depth of the point that is
//! seen; with `t <= 0` it lies behind the camera, or, where `n . r = 0`, nowhere: such a pixel sees no ground.
//!
//! > (4)  `t = (delta - n . C) / (n . r)`
//!
//! **The other camera,** marked with a dash. The point moves into its frame and is projected; with `z' <= 0` it lies
//! behind that camera and has no pixel, although the division would give one.
//!
//! > (5)  `X' = R'^T (X - C')`
//! >
//! > (6)  `u' = fx' x' / z' + cx'`, `v' = fy' y' / z' + cy'`
//!
//! **All at once.** Dividing (3) to (6) by t makes them linear in p. One row gives the inverse depth, and one matrix, the
//! plane's homography, gives the other pixel up to scale:
//!
//! > (7)  `1 / t = a p`, `a = n^T R K^-1 / (delta - n . C)`
//! >
//! > (8)  `H = K' R'^T (R K^-1 + (C - C') a)`, `H p = (z' / t) (u', v', 1)`
//!
//! The scale carries the signs: a pixel sees ground where `a p > 0`, and the other camera has that ground before it where,
//! besides, `(H p)_3 > 0`.
//!
//! **Clipping.** By (7) and (8) every condition for being visible is a half-plane of the marked image: `a p >= 0` (below
//! the horizon), `(H p)_3 - near a p >= 0` (before the other camera's near plane), and one for each side of the other
//! image, such as `(H p)_1 - left (H p)_3 >= 0`. A region is cut by one after the other (Sutherland and Hodgman,
//! "Reentrant polygon clipping", CACM 17, 1974), and only what is left is projected. Projecting its corners first is a
//! well-known fault: a corner behind the camera lands mirrored, at a place that means nothing.
//!
//! **Refinement.** Pairs of pixels known to show the same point determine a camera's actual pose: [`refine()`] adjusts its pitch,
//! height and offset by Gauss-Newton until the projections fall on the marks.

pub mod axes;
pub(crate) mod clip;
pub mod directions;
pub mod points;
pub mod presets;
pub mod refine;
pub(crate) mod region;
pub mod scene;
pub(crate) mod transfer;
pub mod warp;

pub use axes::{BevAxes, EulerOrder};
pub use directions::{BevParameter, BevRefinementOptions, BevRole};
pub use points::{BevPoint, BevStatus, WholePixels};
pub use presets::{BevPreset, presets};
pub use refine::{BevPair, BevRefinement, refine};
pub use region::{BevPolygon, BevSegment};
pub use scene::{BevCamera, BevIntrinsics, BevPlane, BevPose, BevPoseKind, BevScene, BevSide};
pub use transfer::{BevLayout, BevLayoutCamera, Plane, PlaneTransfer, PosedCamera};

/// What is smaller is the rounding of a computation with metres, pixels and directions in double precision, and counts as zero.
const ROUNDING: f64 = 1e-9;
