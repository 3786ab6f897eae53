//! Parts of the planar engine that can be left out, to measure what each brings (`cargo measure laser_scores --without`).

/// What is left out; nothing by default.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "each part is left out alone")]
pub struct Ablation {
    /// Measured motion only bounds the search: it is not fused with registrations, and is a factor of the graph only where there is
    /// no registration.
    pub odometry: bool,
    /// No second place is looked for where a scan or a submap would fit about as well.
    pub second_basin: bool,
    /// Matches of submaps enter the graph whether they agree with each other or not.
    pub consistent_sets: bool,
    /// Factors count in full, however far off they are.
    pub robust_kernel: bool,
    /// Doubtful links do not divide the frames into pieces.
    pub doubt: bool,
}
