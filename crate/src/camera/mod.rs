//! Cameras and their images: pinhole model, depth and colour images, brightness pyramids, surfel images, bird's-eye views.
//!
//! Camera frames: x right, y down, z forward. Pixel (0, 0) is the centre of the upper left pixel. Read `pinhole` first.

pub mod bev;
pub(crate) mod brightness;
pub(crate) mod color_image;
pub(crate) mod depth_image;
pub(crate) mod depth_levels;
pub(crate) mod depth_scale;
pub(crate) mod pinhole;
pub(crate) mod raw_depth;
pub mod surfel_image;

pub use brightness::Brightness;
pub use color_image::ColorImage;
pub use depth_image::{DepthImage, DepthPicture, DepthValues};
pub use depth_scale::{DepthScale, DepthSensor, ScaleBasis};
pub use pinhole::Pinhole;
pub use raw_depth::{Curvatures, NoDepth, holds_kinect_raw};
pub use surfel_image::{Surfel, SurfelImage};
