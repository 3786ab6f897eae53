//! Cameras and what they deliver: depth images, and the rays that their pixels look along.
//!
//! Camera frames: x right, y down, z forward. Pixel (0, 0) is the middle of the upper left pixel.

pub mod bev;
pub mod brightness;
pub mod color_image;
pub mod depth_image;
pub mod depth_scale;
pub mod pinhole;
pub mod surfel_image;

pub use brightness::Brightness;
pub use color_image::ColorImage;
pub use depth_image::{DepthImage, DepthPicture};
pub use depth_scale::{DepthScale, DepthSensor};
pub use pinhole::Pinhole;
pub use surfel_image::{Surfel, SurfelImage};
