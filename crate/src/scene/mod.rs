//! The synthetic world that the samples are rendered from.
