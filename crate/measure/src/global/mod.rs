//! Ways to register without a guess that the engine does without.

pub mod cliques;
pub mod gnc;
