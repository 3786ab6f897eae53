//! Free space: what a sensor saw through must be empty. [`beams`] tests points against a planar scan, [`sphere`] against a
//! cloud seen from its sensor; against a depth image it is [`super::projective`].

pub mod beams;
pub mod sphere;
