//! The parts of an evaluation one by one: association, alignment, drift, relations, map quality, and what they say of
//! input that makes no sense.

mod alignment;
mod association;
mod map_crispness;
mod refusals;
mod relative;
mod samples;
