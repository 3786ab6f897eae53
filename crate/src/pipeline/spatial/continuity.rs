//! Whether the frames after a break in the sequence lie where the sensor can have come to.

use crate::geometry::Pose3;
use crate::geometry::quantile::MIN_SAMPLE;
use crate::odometry::assessment::{Assessment, Status};
use crate::odometry::depth::{SpatialEstimate, UnresolvedFrames};

/// Largest speed across frames that are not good, over that anywhere else.
const MAX_SPEED_RATIO: f64 = 3.0;

/// The largest motion between neighbouring frames.
#[derive(Debug, Clone, Copy)]
struct Step {
    translation: f64,
    rotation: f64,
}

impl Step {
    /// `good`: numbers of the good frames. `None` where too few of them are neighbours.
    fn largest(estimates: &[SpatialEstimate], good: &[usize]) -> Option<Self> {
        let neighbours = good.windows(2).filter(|pair| pair[1] == pair[0] + 1);
        let steps: Vec<Self> = neighbours.map(|pair| Self::between(estimates, pair[0], pair[1])).collect();
        let largest = |of: fn(&Self) -> f64| steps.iter().map(of).fold(0.0, f64::max);
        (steps.len() >= MIN_SAMPLE)
            .then(|| Self { translation: largest(|step| step.translation), rotation: largest(|step| step.rotation) })
    }

    fn between(estimates: &[SpatialEstimate], from: usize, to: usize) -> Self {
        let moved: Pose3 = estimates[from].T_world_sensor.inverse() * estimates[to].T_world_sensor;
        Self { translation: moved.translation.vector.norm(), rotation: moved.rotation.angle() }
    }

    fn is_within(&self, largest: &Self, num_steps: usize) -> bool {
        let most = MAX_SPEED_RATIO * num_steps as f64;
        self.translation <= most * largest.translation && self.rotation <= most * largest.rotation
    }

    fn reason(&self) -> String {
        format!(
            "after frames that did not fit, the sequence goes on {:.2} m and {:.0} degrees from where it was, farther than the \
             sensor moves elsewhere: this may be another place that looks alike",
            self.translation,
            self.rotation.to_degrees()
        )
    }
}

/// 95 % bound of the error of good frames after uncertain ones, as a multiple of the standard deviation that these leave: that of a
/// normal distribution; measured, 1.2 (`docs/measurements/depth_ablations.md`).
const ERROR_RATIO: f64 = 2.0;

/// What is said where neither the surfaces nor the sensor's other steps tell how far it moved.
const REPETITIVE: &str = "surfaces repeat here, and too few certain frames tell how far the sensor moves from one to the next: \
                          it may be off by a period";

/// The assessments of all frames. A frame that fits the map a long way off, after frames that did not, may have been found in
/// the wrong place, and what follows it extends the map there. Good frames after a break are doubtful where the sensor moves
/// too slowly elsewhere to have come there, and so are those that follow them, until one is back within reach. Where surfaces
/// repeat (`surfaces_repeat`) and too few frames tell how far the sensor moves, all but the first are doubtful.
pub(super) fn assessments(estimates: &[SpatialEstimate], surfaces_repeat: bool) -> Vec<Assessment> {
    let mut assessments: Vec<Assessment> = estimates.iter().map(|estimate| estimate.assessment.clone()).collect();
    let good: Vec<usize> = (0..estimates.len()).filter(|&frame| assessments[frame].status == Status::Good).collect();
    let Some(largest) = Step::largest(estimates, &good) else {
        if surfaces_repeat {
            assessments.iter_mut().skip(1).for_each(|assessment| assessment.doubt(REPETITIVE));
        }
        return assessments;
    };
    let reaches = |from: usize, to: usize| Step::between(estimates, from, to).is_within(&largest, to - from);
    let mut trusted = good[0];
    let mut leap: Option<String> = None;
    for pair in good.windows(2) {
        let (before, frame) = (pair[0], pair[1]);
        if frame > before + 1 && !reaches(before, frame) {
            leap = (!reaches(trusted, frame)).then(|| Step::between(estimates, trusted, frame).reason());
        }
        match &leap {
            Some(reason) => assessments[frame].doubt(reason),
            None => trusted = frame,
        }
    }
    assessments
}

/// A note on the good frames after the first unresolved one, called `name`; `None` without such frames. They fit each other and
/// the map, which was continued from an uncertain frame.
pub(super) fn unresolved_note(open: &UnresolvedFrames, name: &str, assessments: &[Assessment]) -> Option<String> {
    let is_good = |frame: &usize| assessments[*frame].status == Status::Good;
    let last_good = (0..assessments.len()).rfind(is_good)?;
    let before: Vec<_> = open.frames.iter().take_while(|frame| (frame.number as usize) < last_good).collect();
    let (first, last) = (before.first()?.number as usize, before.last()?);
    let num_good = (first + 1..assessments.len()).filter(is_good).count();
    let others = match before.len() - 1 {
        0 => "is uncertain, and no later frame settles it".to_owned(),
        1 => "and one more frame are uncertain, and no later frame settles them".to_owned(),
        count => format!("and {count} more frames are uncertain, and no later frame settles them"),
    };
    let distance = last.sigma.map_or_else(
        || "by an unknown distance".to_owned(),
        |sigma| format!("by up to {:.0} mm (95 % bound)", 1000.0 * ERROR_RATIO * sigma),
    );
    Some(format!(
        "The position of {name} {others}: the {num_good} good frames after it fit each other, but may all be off from the frames \
         before it {distance}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::odometry::depth::UnresolvedFrame;

    /// Frames at these positions along x (m); `None` is lost.
    fn estimates(positions: &[Option<f64>]) -> Vec<SpatialEstimate> {
        let estimate = |position: &Option<f64>| SpatialEstimate {
            T_world_sensor: Pose3::translation(position.unwrap_or(0.0), 0.0, 0.0),
            registration: None,
            overlap: 1.0,
            assessment: position.map_or_else(|| Assessment::lost("no overlap".to_owned()), |_| Assessment::first()),
            covariance: None,
            is_in_map: position.is_some(),
        };
        positions.iter().map(estimate).collect()
    }

    fn doubtful(positions: &[Option<f64>]) -> Vec<usize> {
        let assessments = assessments(&estimates(positions), false);
        (0..positions.len()).filter(|&frame| assessments[frame].status == Status::Doubtful).collect()
    }

    /// Steps of 0.1 m.
    fn walk(from: f64, count: usize) -> Vec<Option<f64>> {
        (0..count).map(|step| Some(from + 0.1 * step as f64)).collect()
    }

    #[test]
    fn good_frames_after_uncertain_ones_say_by_how_much_they_may_be_off() {
        let assessments = assessments(&estimates(&walk(0.0, 6)), false);
        let note = |numbers: &[u32], sigma| {
            let frames = numbers.iter().map(|&number| UnresolvedFrame { number, sigma }).collect();
            unresolved_note(&UnresolvedFrames { frames }, "b.png", &assessments)
        };
        let two = note(&[1, 2], Some(0.18)).unwrap();
        assert!(two.contains("b.png and one more frame") && two.contains("the 4 good frames"), "{two}");
        assert!(two.contains(&format!("{:.0} mm", 180.0 * ERROR_RATIO)), "{two}");
        assert!(note(&[1], None).unwrap().contains("unknown distance"));
        assert_eq!(
            (note(&[5], Some(0.1)), note(&[], Some(0.0))),
            (None, None),
            "nothing follows, or nothing is uncertain"
        );
    }

    #[test]
    fn frames_within_reach_after_a_break_stay_good() {
        let sequence = [walk(0.0, 8), vec![None; 3], walk(1.8, 6)].concat();
        assert!(doubtful(&sequence).is_empty());
    }

    #[test]
    fn a_leap_after_a_break_is_doubtful_until_the_sequence_is_back() {
        let sequence = [walk(0.0, 8), vec![None; 3], walk(5.0, 6), vec![None; 2], walk(1.0, 4)].concat();
        assert_eq!(doubtful(&sequence), (11..17).collect::<Vec<_>>());
    }

    #[test]
    fn without_a_break_a_long_step_says_nothing() {
        assert!(doubtful(&[walk(0.0, 8), walk(5.0, 6)].concat()).is_empty());
    }

    #[test]
    fn a_few_frames_do_not_tell_how_fast_the_sensor_moves() {
        assert!(doubtful(&[walk(0.0, 3), vec![None], walk(5.0, 2)].concat()).is_empty());
    }

    #[test]
    fn where_surfaces_repeat_a_few_frames_are_all_doubtful_but_the_first() {
        let num_good = |count: usize| {
            let assessments = assessments(&estimates(&walk(0.0, count)), true);
            assessments.iter().filter(|assessment| assessment.status == Status::Good).count()
        };
        assert_eq!((num_good(MIN_SAMPLE), num_good(MIN_SAMPLE + 1)), (1, MIN_SAMPLE + 1));
    }
}
