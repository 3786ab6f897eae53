//! Bird's-eye view: the published numbers, a plain matrix evaluation, a sampled reference, and everything degenerate.

mod chance;
mod faults;
mod files;
mod pictures;
mod plain;
mod refinement;
mod regions;
mod transfer;
