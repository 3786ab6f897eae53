//! Assessment of a frame's pose: the one place that turns evidence into good, doubtful or lost, with the reason.
//!
//! Every odometry measures the same `Evidence` and sets its own `Limits`; `Assessment::of` compares them in the same
//! order and gives reasons in the same words.

use serde::Serialize;

/// How far a frame's pose is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Status {
    /// Registered, and no evidence contradicts it.
    Good,
    /// Registered or placed by measured motion, but the pose may be wrong: evidence contradicts it or does not suffice.
    Doubtful,
    /// Not registered: the pose is a prediction or the last known one, and the frame is no part of the map.
    Lost,
}

/// A status with its reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// How far the pose is to be trusted.
    pub status: Status,
    /// In plain English; empty when good.
    pub reason: String,
    /// Share of what is visible from both sides that agrees with what the other saw, 0..=1; 1 where that is not tested.
    pub agreement: f64,
}

/// The evidence for and against the pose of a registered frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Evidence {
    /// Pairs that counted in the registration.
    pub num_pairs: usize,
    /// Share of the frame that lies on what it was registered to, 0..=1.
    pub overlap: f64,
    /// Share of what is visible from both sides that agrees, 0..=1; `None` where free space is not tested.
    pub agreement: Option<f64>,
    /// The motion that the surfaces in view do not constrain, if there is one.
    pub degenerate: Option<Unconstrained>,
    /// Root mean square of the pairs' residuals (m).
    pub residual: f64,
    /// The iterations after which the registration was still moving; `None` where it came to rest.
    pub moving_after: Option<usize>,
}

/// A motion that the view does not constrain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unconstrained {
    /// Turning about the upright axis.
    Heading,
    /// Sliding along a direction.
    Position,
    /// Turning about any other axis.
    Turn,
}

/// Thresholds of the evidence for one kind of sensor. Shares are in 0..=1; 0 sets no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// With fewer pairs a frame is lost.
    pub min_pairs: usize,
    /// Below this overlap a frame is lost, ...
    pub lost_overlap: f64,
    /// ... and below this it is doubtful.
    pub doubtful_overlap: f64,
    /// Below this agreement a frame is lost, ...
    pub lost_agreement: f64,
    /// ... and below this it is doubtful.
    pub doubtful_agreement: f64,
    /// Above this root mean square residual (m) a frame is doubtful.
    pub doubtful_residual: f64,
}

impl Limits {
    /// No limit is set.
    pub(crate) const NONE: Self = Self {
        min_pairs: 0,
        lost_overlap: 0.0,
        doubtful_overlap: 0.0,
        lost_agreement: 0.0,
        doubtful_agreement: 0.0,
        doubtful_residual: f64::INFINITY,
    };
}

impl Assessment {
    /// The first frame defines the world frame and is good by definition.
    pub fn first() -> Self {
        Self { status: Status::Good, reason: String::new(), agreement: 1.0 }
    }

    /// A frame without a pose of its own.
    pub fn lost(reason: String) -> Self {
        Self { status: Status::Lost, reason, agreement: 0.0 }
    }

    /// A frame with too few points to be registered.
    pub(crate) fn too_few_points(num_points: usize) -> Self {
        Self::lost(format!("it has {num_points} usable points, too few to register it"))
    }

    /// Compares evidence with its limits: first what makes a frame lost, then what makes it doubtful.
    pub(crate) fn of(evidence: &Evidence, limits: &Limits) -> Self {
        let agreement = evidence.agreement.unwrap_or(1.0);
        if let Some(reason) = Self::reason_lost(evidence, limits) {
            return Self { status: Status::Lost, reason, agreement };
        }
        if let Some(reason) = Self::reason_doubtful(evidence, limits) {
            return Self { status: Status::Doubtful, reason, agreement };
        }
        Self { status: Status::Good, reason: String::new(), agreement }
    }

    fn reason_lost(evidence: &Evidence, limits: &Limits) -> Option<String> {
        let Evidence { num_pairs, overlap, agreement, .. } = *evidence;
        if num_pairs < limits.min_pairs {
            Some(format!("only {num_pairs} pairs were found: too little overlap, or a motion larger than the search"))
        } else if overlap < limits.lost_overlap {
            Some(format!(
                "only {} of it lies on the map: too little overlap, or a motion larger than the search",
                percent(overlap)
            ))
        } else {
            agreement.filter(|agreement| *agreement < limits.lost_agreement).map(|agreement| {
                format!(
                    "{} of the visible surface contradicts space already seen as free: it shows another place, or the \
                     motion is larger than the search",
                    percent(1.0 - agreement)
                )
            })
        }
    }

    fn reason_doubtful(evidence: &Evidence, limits: &Limits) -> Option<String> {
        let Evidence { overlap, agreement, degenerate, residual, moving_after, .. } = *evidence;
        if let Some(agreement) = agreement.filter(|agreement| *agreement < limits.doubtful_agreement) {
            let against = percent(1.0 - agreement);
            return Some(format!("{against} of the visible surface contradicts space already seen as free"));
        }
        if overlap < limits.doubtful_overlap {
            return Some(format!("only {} of it lies on the map", percent(overlap)));
        }
        if let Some(motion) = degenerate {
            let motion = match motion {
                Unconstrained::Heading => "the heading",
                Unconstrained::Position => "the position along one direction",
                Unconstrained::Turn => "the rotation about one axis",
            };
            return Some(format!("the view does not constrain {motion} (degenerate geometry)"));
        }
        if residual > limits.doubtful_residual {
            return Some(format!("its points lie {residual:.3} m off the surfaces of the map (root mean square)"));
        }
        moving_after.map(|iterations| format!("the registration was still moving after {iterations} iterations"))
    }

    /// Makes a good frame doubtful for a reason outside its registration; others keep their status and reason.
    pub fn doubt(&mut self, reason: &str) {
        if self.status == Status::Good {
            self.status = Status::Doubtful;
            reason.clone_into(&mut self.reason);
        }
    }

    /// Makes a good frame doubtful because it fits about as well at another position, at this distance (m).
    pub(crate) fn doubt_position(&mut self, distance: f64) {
        self.doubt(&format!(
            "it fits the map about as well {distance:.1} m away: surfaces repeat, and its motion is not known well enough to tell"
        ));
    }

    /// Makes a frame lost because a larger set of frames agrees without it.
    pub fn mark_outnumbered(&mut self) {
        (self.status, self.agreement) = (Status::Lost, 0.0);
        "more frames fit each other without this one: it shows another place".clone_into(&mut self.reason);
    }

    /// Makes a good frame doubtful because another chain of frames has replaced its own, which began near it.
    pub fn mark_replaced(&mut self) {
        self.doubt("a larger set of frames fits together without it, and its position near them is known only roughly");
    }

    /// Makes a good frame doubtful because more frames are certain relative to each other than to it.
    pub fn mark_outside_majority(&mut self) {
        self.doubt(
            "most frames are certain relative to each other but not to it: a frame between them has an uncertain pose",
        );
    }

    /// Makes a frame doubtful that hardly fits the map but follows the frame before it. `overlap` is the share of it that lies on
    /// the map (0..=1).
    pub fn mark_tracked(&mut self, overlap: f64) {
        self.status = Status::Doubtful;
        self.reason = format!(
            "it follows the frame before it, but hardly fits the map: {} of it lies there, and {} of the visible surface \
             contradicts space already seen as free",
            percent(overlap),
            percent(1.0 - self.agreement)
        );
    }

    /// Makes a good frame doubtful because the pose of the frames it was registered to is uncertain.
    pub fn mark_dependent_on_uncertain_pose(&mut self) {
        self.doubt(
            "it fits the frames before it, but their own position is uncertain, and it overlaps too little with what is known \
             for certain",
        );
    }
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        min_pairs: 10,
        lost_overlap: 0.2,
        doubtful_overlap: 0.4,
        lost_agreement: 0.85,
        doubtful_agreement: 0.95,
        doubtful_residual: 0.1,
    };
    const GOOD: Evidence = Evidence {
        num_pairs: 500,
        overlap: 0.8,
        agreement: Some(0.99),
        degenerate: None,
        residual: 0.01,
        moving_after: None,
    };

    #[test]
    fn each_kind_of_evidence_alone_tips_the_assessment_and_is_named() {
        let of = |evidence: Evidence| {
            let Assessment { status, reason, .. } = Assessment::of(&evidence, &LIMITS);
            (status, reason)
        };
        assert_eq!(of(GOOD), (Status::Good, String::new()));
        assert_eq!(of(Evidence { agreement: None, ..GOOD }), (Status::Good, String::new()));
        for (evidence, status, word) in [
            (Evidence { num_pairs: 9, ..GOOD }, Status::Lost, "only 9 pairs"),
            (Evidence { overlap: 0.19, ..GOOD }, Status::Lost, "only 19 %"),
            (Evidence { agreement: Some(0.8), ..GOOD }, Status::Lost, "20 % of the visible surface"),
            (Evidence { agreement: Some(0.9), ..GOOD }, Status::Doubtful, "10 % of the visible surface"),
            (Evidence { overlap: 0.39, ..GOOD }, Status::Doubtful, "only 39 %"),
            (Evidence { degenerate: Some(Unconstrained::Heading), ..GOOD }, Status::Doubtful, "the heading"),
            (Evidence { degenerate: Some(Unconstrained::Position), ..GOOD }, Status::Doubtful, "the position along"),
            (Evidence { degenerate: Some(Unconstrained::Turn), ..GOOD }, Status::Doubtful, "the rotation about"),
            (Evidence { residual: 0.11, ..GOOD }, Status::Doubtful, "0.110 m"),
            (Evidence { moving_after: Some(40), ..GOOD }, Status::Doubtful, "after 40 iterations"),
        ] {
            let (found, reason) = of(evidence);
            assert_eq!(found, status, "{evidence:?}");
            assert!(reason.contains(word), "{reason} does not say {word}");
        }
    }

    #[test]
    fn what_loses_a_frame_is_said_before_what_makes_it_doubtful() {
        let evidence = Evidence { agreement: Some(0.5), overlap: 0.3, moving_after: Some(3), ..GOOD };
        assert!(Assessment::of(&evidence, &LIMITS).reason.contains("50 %"));
        assert_eq!(
            Assessment::of(&evidence, &Limits::NONE).status,
            Status::Doubtful,
            "not converging is doubtful without any limit"
        );
        let mut lost = Assessment::lost("no surface".to_owned());
        lost.doubt("something else");
        assert_eq!((lost.status, lost.reason.as_str()), (Status::Lost, "no surface"));
    }
}
