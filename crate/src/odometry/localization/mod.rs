//! Where in a map the scans of a recording were taken: a map and scans with the motion between them in, a pose with its covariance and
//! its rivals out.
//!
//! Read `localizer` first, then `belief`, `places` (what makes a place certain) and `search` (how all places are found). `likelihood` says how well
//! beams fit the map that `field` prepares; `window` joins the last scans; `refine` registers beams to walls, `slide` says how far
//! such a pose may slide along a bare corridor. `particles` is Monte Carlo localisation, for comparison alone.

mod belief;
mod field;
mod likelihood;
mod localizer;
mod location;
mod nearest_cells;
mod particles;
mod places;
mod pooled;
mod refine;
mod search;
mod slide;
mod stretches;
mod window;

pub use field::MapField;
pub use likelihood::{Beam, BeamModel, Fit};
pub use localizer::Localizer;
pub use location::{Location, Place, Verdict};
pub use particles::{MAX_PARTICLES, Particle, ParticleFilter, ParticleOptions};
pub use stretches::StretchSearch;
pub use window::LONGEST_STRETCH;
