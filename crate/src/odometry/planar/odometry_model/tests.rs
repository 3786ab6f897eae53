use super::*;
use crate::odometry::assessment::{Assessment, Status};
use crate::odometry::planar::belief::ByOdometry;
use nalgebra::Vector2;

const NOISE: MotionNoise = MotionNoise { translation_scale: 1.0, rotation_scale: 1.0 };

/// The odometry of these steps.
fn measured(steps: &[Pose2]) -> OdometryModel {
    let known = |step: &Pose2| Some(MeasuredMotion { T_before_sensor: *step, covariance: NOISE.covariance(step) });
    OdometryModel {
        steps: steps.iter().map(known).collect(),
        bridged: vec![None; steps.len()],
        noise: NOISE,
        ..OdometryModel::default()
    }
}

fn unmeasured(count: usize) -> OdometryModel {
    OdometryModel { steps: vec![None; count], bridged: vec![None; count], noise: NOISE, ..OdometryModel::default() }
}

/// A chain of these steps, each registered to a centimetre.
fn chain(steps: &[Pose2]) -> Vec<FrameEstimate> {
    let mut T_world_sensor = Pose2::identity();
    let estimate = |(frame, step): (usize, &Pose2)| {
        T_world_sensor *= if frame == 0 { Pose2::identity() } else { *step };
        let adjoint = T_world_sensor.inverse().adjoint();
        FrameEstimate {
            T_world_sensor,
            registration: None,
            registered: Assessment::first(),
            by_odometry: ByOdometry::Nothing,
            findings: Vec::new(),
            link: Link::Registered,
            instead_of_odometry: None,
            information: adjoint.tr_mul(&(Matrix3::from_diagonal(&Vector3::repeat(1e4)) * adjoint)),
            references: Vec::new(),
        }
    };
    steps.iter().enumerate().map(estimate).collect()
}

fn along(lengths: &[f64]) -> Vec<Pose2> {
    lengths.iter().map(|&length| Pose2::translation(length, 0.0)).collect()
}

#[test]
fn steps_that_are_likely_one_by_one_and_short_together_are_doubted() {
    let mut lengths = vec![1.0; 20];
    lengths[8..13].copy_from_slice(&[0.885, 0.885, 0.875, 0.885, 0.885]);
    let (mut model, mut estimates) = (measured(&along(&[1.0; 20])), chain(&along(&lengths)));
    model.doubt_contradicted_steps(&mut estimates);
    let doubted: Vec<usize> = (0..20).filter(|&frame| estimates[frame].link == Link::Doubted).collect();
    assert_eq!(doubted, [10], "the step that is off most");
    assert_eq!(estimates[10].assessment().status, Status::Doubtful);
    let reason = estimates[10].assessment().reason;
    assert!(reason.contains("over 5 steps"), "{reason}");
    let sigma = |frame: usize| model.steps[frame].as_ref().unwrap().covariance[(1, 1)].sqrt();
    assert!(sigma(10) > 0.4 && sigma(9) < 0.1, "{} {}", sigma(10), sigma(9));

    let lengths: Vec<f64> = (0..40).map(|step| if step % 2 == 0 { 1.08 } else { 0.92 }).collect();
    let (mut model, mut estimates) = (measured(&along(&[1.0; 40])), chain(&along(&lengths)));
    model.doubt_contradicted_steps(&mut estimates);
    assert!(estimates.iter().all(|estimate| estimate.link == Link::Registered), "within the noise");
}

#[test]
fn a_step_that_comes_late_is_expected_to_be_as_its_neighbours() {
    let model = measured(&along(&[1.0, 1.0, 1.0, 0.1, 1.9, 1.0, 1.02, 1.0]));
    let expected: Vec<Option<f64>> =
        (0..8).map(|frame| model.as_neighbors(frame).map(|step| (100.0 * step.translation.x).round())).collect();
    assert_eq!(expected, [None, None, None, Some(100.0), Some(100.0), None, None, None]);
    let turning = measured(&[1.0, 1.0, 0.6, 0.2, 0.2].map(|length| Pose2::new([length, 0.0].into(), 1.0 - length)));
    assert!((0..5).all(|frame| turning.as_neighbors(frame).is_none()), "a robot that stops and turns");
}

/// The frames that are doubted after a drive in `steps`.
fn doubted(steps: &[Pose2], model: &OdometryModel) -> Vec<usize> {
    let mut estimates = chain(steps);
    let poses: Vec<Pose2> = estimates.iter().map(|estimate| estimate.T_world_sensor).collect();
    model.doubt_contradicted_stretches(&poses, &mut estimates);
    (0..estimates.len()).filter(|&frame| estimates[frame].assessment().status == Status::Doubtful).collect()
}

/// A drive of 100 steps of a metre, with a bend.
fn drive() -> Vec<Pose2> {
    (0..100).map(|step| Pose2::exp(&Vector3::new(if step % 20 < 4 { 0.3 } else { 0.0 }, 1.0, 0.0))).collect()
}

fn scaled(steps: &[Pose2], range: std::ops::Range<usize>, scale: f64) -> Vec<Pose2> {
    let mut steps = steps.to_vec();
    for step in &mut steps[range] {
        step.translation.vector *= scale;
    }
    steps
}

#[test]
fn a_result_that_falls_behind_the_odometry_step_by_step_is_doubted_along_that_stretch() {
    let truth = drive();
    let mut model = measured(&truth);
    assert_eq!(doubted(&truth, &model), Vec::<usize>::new());
    // 0.25 m a step are 3.5 standard deviations each, 9 over seven steps.
    let short = doubted(&scaled(&truth, 50..57, 0.75), &model);
    assert!((50..57).all(|frame| short.contains(&frame)), "{short:?}");
    assert!(short.iter().all(|frame| (30..78).contains(frame)), "{short:?}");
    // Stretches with a gap are not compared.
    for gap in (2..100).step_by(4) {
        model.steps[gap] = None;
    }
    assert_eq!(doubted(&scaled(&truth, 50..57, 0.5), &model), Vec::<usize>::new());
}

#[test]
fn a_momentary_slip_and_errors_that_add_up_all_along_the_path_are_the_odometry_s_own() {
    let truth = drive();
    assert_eq!(doubted(&truth, &measured(&scaled(&truth, 50..51, 1.4))), Vec::<usize>::new());
    let longer = measured(&scaled(&truth, 0..100, 1.5));
    assert_eq!(doubted(&truth, &longer), Vec::<usize>::new());
    let few = OdometryModel { steps: longer.steps[..15].to_vec(), ..longer };
    assert!(!doubted(&truth[..15], &few).is_empty(), "ten stretches do not tell what is usual");
}

#[test]
fn the_covariance_of_a_stretch_is_that_of_its_steps_one_after_the_other() {
    let model = measured(&drive());
    let stretch = MeasuredPath::new(&model.steps).stretch(3, 23.9, &vec![Pose2::identity(); 100]).unwrap();
    assert_eq!((stretch.first, stretch.last), (3, 27));
    let sum = model.between(3, 27).unwrap();
    assert!((stretch.measured.inverse() * sum.T_before_sensor).log().norm() < 1e-12);
    let expected = mahalanobis::squared(&stretch.measured.log(), &sum.covariance);
    assert!((stretch.sq_distance / expected - 1.0).abs() < 1e-9, "{} {expected}", stretch.sq_distance);
}

#[test]
fn for_a_refuted_step_the_expected_motion_is_taken() {
    let mut estimates = chain(&drive());
    let expected = measured(&drive()).steps[6];
    estimates[7].instead_of_odometry = expected;
    let mut model = measured(&scaled(&drive(), 7..8, 3.0));
    let of_graph = model.compare_with_chain(&mut estimates);
    assert_eq!(of_graph.steps[7], expected);
    assert!(estimates.iter().all(|estimate| estimate.findings.is_empty()));
    let poses: Vec<Pose2> = estimates.iter().map(|estimate| estimate.T_world_sensor).collect();
    model.doubt_contradicted_stretches(&poses, &mut estimates);
    assert!(estimates.iter().all(|estimate| estimate.findings.is_empty()), "it contradicts no stretch either");
}

#[test]
fn a_missing_pose_is_bridged_as_well_as_steps_are_equal_and_a_long_gap_is_not() {
    let mut pose = Pose2::identity();
    let mut poses: Vec<Option<Pose2>> = Vec::new();
    for step in drive() {
        poses.push(Some(pose));
        pose *= step;
    }
    poses[40] = None;
    poses[60..90].fill(None);
    let steps: Vec<Option<Pose2>> =
        (0..poses.len()).map(|frame| Some(poses[frame.checked_sub(1)?]?.inverse() * poses[frame]?)).collect();
    let model = OdometryModel::new(&steps, &[]).bridged(&poses, |_| false);
    let across = model.between(39, 41).unwrap().T_before_sensor;
    assert!((across.inverse() * (poses[39].unwrap().inverse() * poses[41].unwrap())).log().norm() < 1e-9);
    let heading = |frame: usize| model.steps[frame].unwrap().covariance[(0, 0)].sqrt();
    assert!(heading(40) > heading(20), "it may turn in one half alone: {} {}", heading(40), heading(20));
    assert!(model.steps[60..=90].iter().all(Option::is_none));
}

fn implausible(model: &OdometryModel, estimates: &mut [FrameEstimate]) -> Vec<usize> {
    model.doubt_long_steps(estimates);
    (0..estimates.len()).filter(|&frame| estimates[frame].link == Link::Implausible).collect()
}

/// Steps of a metre, a turn on the spot, and two steps elsewhere under another heading (m): the second is 30 scans later.
fn detour(num_before: usize, elsewhere: [f64; 2]) -> Vec<Pose2> {
    let step = |count: usize| vec![Pose2::translation(1.0, 0.0); count];
    let jump = |distance: f64| vec![Pose2::new(Vector2::new(0.0, distance), 1.7)];
    let turn = vec![Pose2::new(Vector2::new(0.02, 0.0), -0.5); 3];
    [step(num_before), turn, jump(elsewhere[0]), step(30), jump(elsewhere[1]), step(2)].concat()
}

#[test]
fn a_step_that_would_continue_no_sure_motion_is_implausible() {
    let mut estimates = chain(&detour(30, [1.75, 2.9]));
    let model = unmeasured(estimates.len());
    let found = implausible(&model, &mut estimates);
    assert_eq!(found, [64], "0.3 m and half of the metre more than a metre may follow one");
    let Assessment { status, reason, .. } = estimates[64].assessment();
    assert_eq!(status, Status::Doubtful);
    assert!(reason.contains("2.9 m from the scan before") && reason.contains("sure is 1.0 m"), "{reason}");
}

#[test]
fn steps_later_in_the_log_count_and_doubted_ones_do_not() {
    let mut estimates = chain(&detour(3, [2.9, 2.9]));
    estimates[37].link = Link::Doubted;
    estimates[37].findings.push(Finding::StrayBefore);
    let model = unmeasured(estimates.len());
    assert_eq!(implausible(&model, &mut estimates), [6, 37]);
    let reason = estimates[37].assessment().reason;
    assert!(reason.starts_with("the previous scan"), "what was found first: {reason}");
}

#[test]
fn a_few_sure_steps_bound_nothing_and_measured_motion_is_not_bounded() {
    let mut few = chain(&[along(&[1.0; 20]), detour(0, [2.9, 0.0])[..4].to_vec()].concat());
    assert!(implausible(&unmeasured(few.len()), &mut few).is_empty(), "17 sure steps, 2 sure turns");
    let steps = detour(30, [2.9, 2.9]);
    assert!(implausible(&measured(&steps), &mut chain(&steps)).is_empty());
}
