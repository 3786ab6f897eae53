//! What a comparison with a reference says of how frames are read: a setting that it bears out, or another value that would make the
//! estimate agree with it. The frames themselves may suggest one, too.

use serde::Serialize;

use super::assumptions::{ReadingSetting, SCALES_8, SCALES_16};
use crate::camera::Pinhole;
use crate::evaluation::motion_ratio::{motion_ratio, motions_agree};
use crate::evaluation::trajectory_error::TrajectoryError;
use crate::geometry::Pose3;
use crate::io::length_unit::{CENTIMETRE, LengthUnit, METRE, MILLIMETRE};

/// A setting of which a value is suggested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum SuggestedSetting {
    /// Raw values per metre.
    DepthScale,
    /// Focal length (pixels).
    Fx,
    /// Metres in a unit of the coordinates of clouds.
    CloudUnit,
    /// What the values of depth images are.
    DepthValues,
    /// The largest depth that is used (m).
    MaxRange,
}

/// A value of a setting that would make the estimate agree with the reference, or the frames with each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct Suggestion {
    /// What was found and what would change it, in a sentence.
    pub text: String,
    /// Which setting.
    pub setting: SuggestedSetting,
    /// Its value; null where there is none to offer.
    pub value: Option<f64>,
}

/// Steps of the estimate and of the reference that differ by less than this factor are equal: references of cameras are
/// themselves off by up to 3 %.
const MIN_FACTOR: f64 = 1.05;
/// Turns that differ by this factor are reported.
const MIN_ANGLE_FACTOR: f64 = 1.08;

/// How the frames of a run are read.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Reading<'a> {
    /// Depth images, by raw values per metre and a camera.
    Depth(f64, &'a Pinhole),
    /// Clouds, by the metres of a unit.
    Clouds(f64),
}

/// What would make the steps of the estimate as long as those of the reference; or that its turns are larger or smaller, for
/// which there is no value to offer: a wrong focal length makes turns larger where they are seen across the image, and
/// smaller where they are seen in the depth.
pub(crate) fn suggestion<P: Copy + Into<Pose3>>(
    poses: &[Option<Pose3>],
    comparison: &TrajectoryError<P>,
    reading: &Reading<'_>,
) -> Option<Suggestion> {
    let reference: Vec<Option<Pose3>> = comparison.reference.iter().map(|pose| pose.map(Into::into)).collect();
    let has_rotations = comparison.rotation_errors.iter().any(Option::is_some);
    let ratio = motion_ratio(poses, &reference);
    if let (Some(turn), Reading::Depth(_, camera), true) = (ratio.rotation, reading, has_rotations)
        && turn.ln().abs() > MIN_ANGLE_FACTOR.ln()
    {
        let fx = camera.fx.round();
        let text = format!(
            "The camera turns {turn:.2} times as far as in the ground truth, as with a wrong focal length: fx = {fx} may not be \
             this camera's"
        );
        return Some(Suggestion { text, setting: SuggestedSetting::Fx, value: None });
    }
    let length = ratio.translation.filter(|length| length.ln().abs() > MIN_FACTOR.ln())?;
    let (setting, name, usual, wanted) = match reading {
        Reading::Depth(scale, _) => {
            (SuggestedSetting::DepthScale, "depth_scale", usual_scale(scale * length), scale * length)
        }
        Reading::Clouds(unit) => (SuggestedSetting::CloudUnit, "cloud_unit", usual_unit(unit / length), unit / length),
    };
    let is = |unit: &&LengthUnit| (length / unit.metres).ln().abs() < MIN_FACTOR.ln();
    if let (None, Some(unit)) = (usual, [CENTIMETRE, MILLIMETRE].iter().find(is)) {
        let text = format!(
            "The path is {length:.4} times as long as the ground truth's, as where that is in {}: give it in metres",
            unit.name
        );
        return Some(Suggestion { text, setting, value: None });
    }
    let rounded = match reading {
        Reading::Depth(..) => wanted.round().max(1.0),
        Reading::Clouds(_) => format!("{wanted:.2e}").parse().unwrap_or(wanted),
    };
    let value = usual.unwrap_or(rounded);
    let text =
        format!("The path is {length:.2} times as long as the ground truth's: {name} {value} would make them equal");
    Some(Suggestion { text, setting, value: Some(value) })
}

/// How the reference bears out a setting, in words, if it does: a wrong scale changes the distances, a wrong focal length both
/// distances and angles. The estimate does not depend on it.
pub(crate) fn confirmation<P: Copy + Into<Pose3>>(
    poses: &[Option<Pose3>],
    comparison: &TrajectoryError<P>,
) -> impl Fn(ReadingSetting) -> Option<String> + use<P> {
    let reference: Vec<Option<Pose3>> = comparison.reference.iter().map(|pose| pose.map(Into::into)).collect();
    let has_rotations = comparison.rotation_errors.iter().any(Option::is_some);
    let agree = motions_agree(poses, &reference, MIN_FACTOR);
    let words =
        |what: &str| format!("the ground truth, whose {what} are the same within {:.0} %", 100.0 * (MIN_FACTOR - 1.0));
    move |setting| match setting {
        ReadingSetting::Fx => {
            (agree.translation && agree.rotation && has_rotations).then(|| words("distances and angles"))
        }
        ReadingSetting::DepthScale | ReadingSetting::CloudUnit => agree.translation.then(|| words("distances")),
    }
}

/// The unit of length that is this one (m), about.
fn usual_unit(wanted: f64) -> Option<f64> {
    let units = [METRE, CENTIMETRE, MILLIMETRE].map(|unit| unit.metres);
    units.into_iter().find(|unit| (unit / wanted).ln().abs() < MIN_FACTOR.ln())
}

/// The scale in use that is this one, about.
fn usual_scale(wanted: f64) -> Option<f64> {
    let off = |usual: f64| (usual / wanted).ln().abs();
    let usual =
        SCALES_16.iter().chain(&SCALES_8).map(|(usual, _)| *usual).filter(|usual| off(*usual) < MIN_FACTOR.ln());
    usual.min_by(|a, b| off(*a).total_cmp(&off(*b)))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

    use super::*;
    use crate::pipeline::assumptions::Assumption;
    use crate::pipeline::assumptions::tests::{KINECT, of, ramp};
    use crate::pipeline::spatial_settings::SpatialSettings;

    /// Steps ahead with turns; `scale` and `turn` times as large.
    fn path(scale: f64, turn: f64) -> Vec<Option<Pose3>> {
        let mut pose = Isometry3::identity();
        let motion = Isometry3::from_parts(
            Translation3::new(0.01 * scale, 0.0, 0.2 * scale),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.1 * turn),
        );
        let step = |_| {
            let before = pose;
            pose *= motion;
            Some(before)
        };
        (0..20).map(step).collect()
    }

    /// A comparison with a path of the right size.
    fn compared() -> TrajectoryError<Pose3> {
        let reference = path(1.0, 1.0);
        let count = reference.len();
        TrajectoryError {
            name: "gt.txt".into(),
            num_matched: count,
            mean: 0.0,
            rmse: 0.0,
            max: 0.0,
            aligned: None,
            hint: None,
            errors: vec![Some(0.0); count],
            rotation_errors: vec![Some(0.0); count],
            reference,
            convention: String::new(),
        }
    }

    fn suggested(estimate: &[Option<Pose3>], reading: Reading<'_>) -> Option<Suggestion> {
        suggestion(estimate, &compared(), &reading)
    }

    #[test]
    fn an_assumption_is_confirmed_by_the_steps_of_a_sensor_or_by_the_ground_truth_alone() {
        let confirmed = |all: Vec<Assumption>| all.into_iter().map(|one| one.confirmed_by).collect::<Vec<_>>();
        let of_kinect = of(&SpatialSettings::default(), &ramp(KINECT));
        let [Some(steps), None] = &confirmed(of_kinect.clone())[..] else { panic!("{of_kinect:?}") };
        assert!(steps.contains("disparity steps of a Kinect"), "{steps}");
        let smooth = of(&SpatialSettings::default(), &ramp(None));
        assert_eq!(confirmed(smooth.clone()), [None, None]);

        let by_reference = |scale, turn| {
            let by = confirmation(&path(scale, turn), &compared());
            smooth.iter().map(|one| one.clone().or_confirmed(&by).confirmed_by.is_some()).collect::<Vec<_>>()
        };
        assert_eq!(by_reference(1.01, 1.01), [true, true]);
        assert_eq!(by_reference(1.0, 0.9), [true, false], "turns of another size are another focal length's");
        assert_eq!(by_reference(6.5, 1.0), [false, false]);
        let reference = confirmation(&path(1.0, 1.0), &compared());
        let by = confirmed(of_kinect.into_iter().map(|one| one.or_confirmed(&reference)).collect());
        assert_eq!(by[0].as_ref(), Some(steps), "what confirms it already stays");
        assert!(by[1].as_ref().unwrap().contains("distances and angles"), "{by:?}");
    }

    #[test]
    fn a_path_of_another_size_suggests_a_scale_and_other_turns_are_told() {
        let camera = Pinhole::new(640, 480, [525.0, 525.0, 320.0, 240.0]).unwrap();
        let reading = Reading::Depth(1000.0, &camera);
        assert_eq!(suggested(&path(1.02, 1.0), reading), None);
        let six = suggested(&path(6.5, 1.0), reading).unwrap();
        assert_eq!((six.setting, six.value), (SuggestedSetting::DepthScale, Some(6553.5)));
        assert!(six.text.contains("6.50 times") && six.text.contains("depth_scale 6553.5"), "{}", six.text);
        assert_eq!(suggested(&path(0.3, 1.0), reading).unwrap().value, Some(300.0));
        let centimetres = suggested(&path(0.01, 1.0), reading).unwrap();
        assert_eq!(centimetres.value, None);
        assert!(centimetres.text.contains("as where that is in centimetres"), "{}", centimetres.text);
        let clouds = suggested(&path(1000.0, 1.0), Reading::Clouds(1.0)).unwrap();
        assert_eq!((clouds.setting, clouds.value), (SuggestedSetting::CloudUnit, Some(1e-3)));
        let wide = suggested(&path(1.0, 0.73), reading).unwrap();
        assert_eq!((wide.setting, wide.value), (SuggestedSetting::Fx, None));
        assert!(wide.text.contains("turns 0.73 times") && wide.text.contains("fx = 525"), "{}", wide.text);
    }
}
