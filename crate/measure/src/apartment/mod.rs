//! Recordings of the synthetic flat.

pub mod recording;
pub mod registering;
