//! Aligning a source with a target.
