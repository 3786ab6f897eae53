//! Assessment of a planar scan's registration, by what the registration says of itself and by free space.

use crate::map::local::PlanarRegistration;
use crate::odometry::assessment::{Assessment, Evidence, Limits, Unconstrained};
use crate::registration::free_space::FreeSpaceTally;

/// Smallest number of points of a usable planar scan.
pub(crate) const MIN_POINTS: usize = 10;
/// A registration is good from this share of agreeing returns on. In each of six logs half of the good frames agree by at least 0.975,
/// and 95 % by at least 0.896 to 0.962, depending on the log; registrations that are wrong by half a metre or more mostly agree by less than 0.8. With 0.86 in place of
/// 0.9, wrong pairs of one log are assessed as good.
pub(crate) const GOOD_AGREEMENT: f64 = 0.9;
/// It may be right from this share on, where something else speaks for it.
pub(crate) const PLAUSIBLE_AGREEMENT: f64 = 0.8;
/// A registration or a match of submaps of which a smaller share of the returns has a partner says nothing.
pub(crate) const MIN_OVERLAP: f64 = 0.25;
/// Share of the returns of a scan from which on it is most of them. For a scan that has to lie on the map, 0.7 and 1.4 times as much:
/// `docs/measurements/laser.md`, thresholds.
pub(crate) const MOST: f64 = 0.5;
/// Limits of planar scans.
const PLANAR_LIMITS: Limits = Limits {
    min_pairs: MIN_POINTS,
    lost_overlap: MIN_OVERLAP,
    lost_agreement: 0.6,
    doubtful_agreement: GOOD_AGREEMENT,
    ..Limits::NONE
};

/// Assesses the registration of a planar scan by its evidence and by what the sensors saw.
pub(crate) fn assess(registration: &PlanarRegistration, seen: FreeSpaceTally) -> Assessment {
    let last = &registration.last;
    let weakest = &registration.observability;
    // What the larger part of the direction, which has length 1, is.
    let motion =
        if weakest.weakest_direction[0].powi(2) > MOST { Unconstrained::Heading } else { Unconstrained::Position };
    let evidence = Evidence {
        num_pairs: last.num_inliers,
        overlap: registration.fitness,
        agreement: Some(seen.agreement()),
        degenerate: weakest.is_undetermined().then_some(motion),
        residual: last.inlier_rmse,
        // One that still moves is judged by where it is: where it slides, the walls leave a direction open.
        moving_after: None,
    };
    Assessment::of(&evidence, &PLANAR_LIMITS)
}
