//! Parts of the planar engine that can be left out, to measure what each brings (`examples/laser_scores --without`).

/// What is left out; nothing by default.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "each part is left out alone")]
pub struct Ablation {
    /// Measured motion bounds the search only: it is not fused with registrations and is no factor where there is one.
    pub odometry: bool,
    /// No second place is looked for where a scan or a submap would fit about as well.
    pub second_basin: bool,
    /// Matches of submaps enter the graph whether they agree with each other or not.
    pub consistent_sets: bool,
    /// Factors count in full, however far off they are.
    pub robust_kernel: bool,
    /// A doubtful link makes the frames after it no other piece.
    pub doubt: bool,
}
