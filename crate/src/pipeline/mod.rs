//! Complete reconstructions: recorded frames and settings in; trajectory, map, assessments and errors out, in bounded steps.
//!
//! [`planar`] reconstructs from laser scans, [`spatial`] from depth images or clouds, [`strategies`] compares settings of
//! voxel odometry on one recording.
//!
//! Read [`planar`] first.
//!
//! Laser scans of the samples:
//!
//! ```
//! use scanstitch::io::ply;
//! use scanstitch::pipeline::{Reconstruction, Settings, Stage};
//!
//! let mut reconstruction = Reconstruction::new(Settings::default())?;
//! for index in 0..5 {
//!     let name = format!("www/samples/corridor/{index}.ply");
//!     reconstruction.add_scan(&name, ply::read(&std::fs::read(&name)?)?)?;
//! }
//! while reconstruction.step().stage != Stage::Done {}
//! assert!(reconstruction.result().frames.iter().all(|frame| frame.reason.is_empty()));
//! let (poses, map) = (reconstruction.poses(), reconstruction.map());
//! assert!(poses.len() == 5 && map.points.len() > 500);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Depth images. Frames may be prepared on any thread; they are registered in order:
//!
//! ```
//! use scanstitch::pipeline::{FrameLabel, PreparedFrame, SpatialReconstruction, SpatialSettings, Stage};
//!
//! let mut reconstruction = SpatialReconstruction::new(SpatialSettings::default())?;
//! for index in 0..3 {
//!     let name = format!("www/samples/apartment/depth/{}.png", index + 1);
//!     let bytes = std::fs::read(&name)?;
//!     let decode_config = reconstruction.begin(&name, &bytes)?;
//!     let label = FrameLabel { name, index, time: None };
//!     let frame = PreparedFrame::from_depth(decode_config, label, &bytes, None)?;
//!     reconstruction.add(frame)?;
//!     while reconstruction.step().stage != Stage::Done {}
//! }
//! reconstruction.finish();
//! while reconstruction.step().stage != Stage::Done {}
//! assert_eq!(reconstruction.poses().len(), 3);
//! assert!(reconstruction.map().len() > 1000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod assumptions;
pub mod depth_consistency;
pub mod odometry_check;
pub mod planar;
pub mod prepared_frame;
pub mod recorded_scan;
mod reference;
pub mod report;
pub mod settings;
pub mod spatial;
pub(crate) mod spatial_report;
pub mod spatial_settings;
pub mod strategies;
pub mod suggestion;
pub mod surface;

pub use assumptions::{Assumption, ReadingSetting, UsualValue};
pub use planar::Reconstruction;
pub use prepared_frame::{FrameLabel, PreparedFrame};
pub use report::Stage;
pub use settings::Settings;
pub use spatial::SpatialReconstruction;
pub use spatial_report::{MapSize, SpatialResult};
pub use spatial_settings::SpatialSettings;
pub use suggestion::Suggestion;
