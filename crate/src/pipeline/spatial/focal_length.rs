//! Whether the frames of a run fit each other with the focal length that was assumed for them.

use crate::geometry::Pose3;
use crate::geometry::quantile::THREE_SIGMA;
use crate::odometry::assessment::{Assessment, Status};
use crate::odometry::depth::{SpatialEstimate, fine_options, middle_options};
use crate::pipeline::assumptions::{Assumption, ReadingSetting};
use crate::pipeline::prepared_frame::DecodeConfig;
use crate::pipeline::suggestion::{SuggestedSetting, Suggestion};
use crate::registration::focal_length::{FocalLengthFit, fit_focal_length};
use crate::registration::prepared_surfels::PreparedSurfels;

/// Views that are compared: fifteen pairs tell the focal length to 0.1 % (rendered images) or 0.5 % (a RealSense), and cost about as
/// much as fifteen frames.
const MAX_VIEWS: usize = 8;
/// Turn between compared views (rad): a sixth of the field of view of a usual depth camera.
const MIN_TURN: f64 = 0.17;
/// Earlier views that each is compared with.
const PARTNERS: usize = 2;
/// Pairs of views that must tell: the scatter of one is unknown.
const MIN_PAIRS: usize = 2;
/// Focal lengths whose logarithms differ by less are one camera's, whose lens is no pinhole: the frames of a Kinect fit each other best
/// with one that is 1 to 5 % too short (`docs/measurements/conventions.md`).
const MIN_DIFFERENCE: f64 = 0.05;

/// The focal length by which frames of different views fit each other best.
#[derive(Default)]
pub(super) struct FocalLength {
    /// The one that was assumed (pixels), where there was one.
    assumed: Option<f64>,
    views: Vec<(PreparedSurfels, Pose3)>,
    /// Views whose fits to earlier ones are known.
    num_compared: usize,
    fits: Vec<FocalLengthFit>,
}

impl FocalLength {
    /// Where the spacing of the depth values tells the sensor, it tells more of the focal length than frames do through a lens that
    /// is no pinhole: a RealSense's fit each other best with one that is 3 to 6 % too short.
    pub(super) fn new(config: &DecodeConfig) -> Self {
        let is_focal = |assumption: &&Assumption| assumption.setting == ReadingSetting::Fx;
        let is_guess = config.depth.as_ref().is_some_and(|depth| depth.disparity_step.is_none());
        let assumed =
            config.assumptions().iter().find(is_focal).filter(|_| is_guess).map(|assumption| assumption.value);
        Self { assumed, ..Self::default() }
    }

    /// Takes a good frame in, if it is a new view.
    pub(super) fn record(&mut self, surfels: &PreparedSurfels, estimate: &SpatialEstimate) {
        let is_used = estimate.assessment.status == Status::Good && estimate.is_in_map;
        if self.assumed.is_none() || !is_used || self.views.len() == MAX_VIEWS {
            return;
        }
        let pose = estimate.T_world_sensor;
        if self.views.iter().all(|view| view.1.rotation.angle_to(&pose.rotation) >= MIN_TURN) {
            self.views.push((surfels.clone(), pose));
        }
    }

    /// Compares each new view with the earlier ones that are turned least from it.
    #[inline(never)]
    pub(super) fn compare(&mut self) {
        let options = [&middle_options(), &fine_options()];
        for index in self.num_compared..self.views.len() {
            let (surfels, pose) = &self.views[index];
            let turn = |view: &(PreparedSurfels, Pose3)| view.1.rotation.angle_to(&pose.rotation);
            let mut views: Vec<_> = self.views[..index].iter().collect();
            views.sort_by(|a, b| turn(a).total_cmp(&turn(b)));
            let fit = |(view, T_world_view): &(PreparedSurfels, Pose3)| {
                fit_focal_length(surfels, view, T_world_view.inverse() * pose, options)
            };
            self.fits.extend(views.into_iter().take(PARTNERS).filter_map(fit));
        }
        self.num_compared = self.views.len();
    }

    /// The mean of all pairs of views, by their weights; None where too few tell.
    fn mean(&self) -> Option<FocalLengthFit> {
        let weight: f64 = self.fits.iter().map(|fit| 1.0 / fit.variance).sum();
        let log_ratio = self.fits.iter().map(|fit| fit.log_ratio / fit.variance).sum::<f64>() / weight;
        let scatter = self.fits.iter().map(|fit| (fit.log_ratio - log_ratio).powi(2) / fit.variance).sum::<f64>();
        let scatter = (scatter / (self.fits.len() as f64 - 1.0)).max(1.0);
        (self.fits.len() >= MIN_PAIRS).then_some(FocalLengthFit { log_ratio, variance: scatter / weight })
    }

    /// The focal length that fits better than the one that was assumed, and the latter (pixels, rounded).
    fn better(&self) -> Option<(f64, f64)> {
        let (FocalLengthFit { log_ratio, variance }, assumed) = (self.mean()?, self.assumed?);
        let is_other = log_ratio.abs() > MIN_DIFFERENCE.max(THREE_SIGMA * variance.sqrt());
        is_other.then(|| ((assumed * log_ratio.exp()).round(), (10.0 * assumed).round() / 10.0))
    }

    /// What would make the frames fit each other, where another focal length does.
    pub(super) fn suggestion(&self) -> Option<Suggestion> {
        let (better, assumed) = self.better()?;
        let text = format!(
            "The frames fit each other best with a focal length of about {better} pixels, not with the {assumed} that were \
             assumed: set fx={better}, or give the camera"
        );
        Some(Suggestion { text, setting: SuggestedSetting::Fx, value: Some(better) })
    }

    /// Makes all frames but the first doubtful where they fit each other better with another focal length.
    pub(super) fn doubt(&self, assessments: &mut [Assessment]) {
        let Some((better, assumed)) = self.better() else { return };
        let reason = format!("the frames fit each other better with fx = {better} than with the assumed {assumed}");
        assessments.iter_mut().skip(1).for_each(|assessment| assessment.doubt(&reason));
    }
}
