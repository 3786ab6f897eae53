//! What cannot be evaluated.

use scanstitch::evaluation::alignment::Alignment;
use scanstitch::evaluation::evaluate::{Association, ErrorMetric, EvaluationOptions, evaluate};
use scanstitch::evaluation::metrics::PoseRelation;
use scanstitch::evaluation::pairs::DeltaUnit;
use scanstitch::io::trajectory::Trajectory;

use super::samples::winding;

#[test]
fn what_cannot_be_evaluated_is_refused_with_a_reason() {
    let full = winding(30);
    let positions = Trajectory { orientations: None, ..full.clone() };
    let one = Trajectory { stamps: Some(vec![100.0]), ..Trajectory::from_poses(&full.poses().unwrap()[..1]) };
    let untimed = Trajectory { stamps: None, ..full.clone() };
    let base = EvaluationOptions::default();
    let told = |reference: &Trajectory, estimate: &Trajectory, options: EvaluationOptions| {
        evaluate(reference, estimate, &options).map(|found| found.summary).unwrap_err().to_string()
    };
    let rotation = EvaluationOptions { relation: PoseRelation::RotationAngleDeg, ..base };
    let rpe = EvaluationOptions { metric: ErrorMetric::Rpe, ..base };
    for (message, expected) in [
        (told(&full, &positions, rotation), "The estimate has positions alone"),
        (
            told(&positions, &full, EvaluationOptions { alignment: Alignment::Origin, ..base }),
            "The reference has positions",
        ),
        (
            told(&full, &untimed, EvaluationOptions { association: Association::Time, ..base }),
            "The estimate has no times",
        ),
        (told(&full, &one, EvaluationOptions { alignment: Alignment::Se3, ..base }), "stays in one place"),
        (told(&full, &one, rpe), "No two of the 1 poses are 1 frames apart"),
        (
            told(&full, &full, EvaluationOptions { alignment: Alignment::Se3, align_first: 2, ..base }),
            "2 pairs of positions",
        ),
        (told(&full, &full, EvaluationOptions { delta: 1.5, ..rpe }), "delta is 1.5 frames"),
        (told(&full, &full, EvaluationOptions { delta: -1.0, ..rpe }), "delta is -1"),
        (
            told(&full, &full, EvaluationOptions { delta: 200.0, delta_unit: DeltaUnit::Degrees, ..rpe }),
            "180 deg at the most",
        ),
        (told(&full, &full, EvaluationOptions { delta: 1e4, delta_unit: DeltaUnit::Meters, ..rpe }), "10000 m apart"),
        (
            told(&untimed, &untimed, EvaluationOptions { delta_unit: DeltaUnit::Seconds, ..rpe }),
            "the poses have no times",
        ),
        (told(&full, &full, EvaluationOptions { max_diff: f64::NAN, ..base }), "max_diff is NaN"),
        (
            told(&full, &full, EvaluationOptions { relation: PoseRelation::PointDistanceErrorRatio, ..base }),
            "is a relative error",
        ),
    ] {
        assert!(message.contains(expected), "{message}");
    }
    // One pose alone has an error without alignment.
    let single = evaluate(&full, &one, &base).unwrap().summary;
    assert_eq!((single.num_matched, single.statistics.max), (1, 0.0));
    assert!(single.drift.is_none());
    // Unsorted and repeated times are compared, and a note tells.
    let mut stamps = full.stamps.clone().unwrap();
    stamps.swap(3, 4);
    stamps[9] = stamps[8];
    let unsorted = full.clone().with_stamps(stamps).unwrap();
    let summary = evaluate(&full, &unsorted, &base).unwrap().summary;
    assert_eq!(summary.notes[0], "In the estimate, times go back once, first at pose 5; 1 time is repeated.");
}
