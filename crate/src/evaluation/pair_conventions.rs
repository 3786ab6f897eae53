//! The conventions of two trajectories relative to each other, where their files do not tell: the order of the quaternions, the
//! directions of the sensor's axes, whether poses map sensor to world or world to sensor, and the handedness.
//!
//! Under the right conventions the motions between the poses of both are equal, up to the unit of length and the errors of the
//! estimate. Other conventions than the ones read are used only where the motions show it beyond chance; notes say so.

use nalgebra::{Matrix3, Vector3};

use super::convention::{MAX_MISFIT_RATIO, MISFIT_ROUNDING, QuaternionOrder, reordered};
use super::motion_ratio::FRAME_GAPS;
use super::pair_motions::{Motions, best_axes, mean_size, misfit, scale_between};
use super::path::Path;
use super::umeyama::best_fit;
use crate::geometry::rotation::nearest_rotation;
use crate::io::trajectory::Trajectory;

/// Largest share of the misfit as read that other conventions may leave, and of the motion itself that they may leave
/// unexplained. Measured on the estimates of freiburg1_xyz and of ten flights: with exchanged quaternions, a turned sensor or
/// mirrored poses the right conventions leave 0.11 at most. None of 100 pairs as they are, KITTI's among them, is converted.
const MAX_REMAINING: f64 = 0.3;
/// Smallest logarithm of the likelihood ratio for conventions other than the ones read. For errors with a Laplace distribution
/// of unknown scale it is the number of motions times the logarithm of the ratio of the mean misfits. There are 54 readings with
/// 24 directions of the axes, one of which is to be believed wrongly once in a thousand trajectories: ln(54 * 24 / 1e-3).
const MIN_LOG_LIKELIHOOD_RATIO: f64 = 14.1;

/// Two paths in common conventions, and what was changed, in whole sentences.
pub(super) struct Agreed {
    pub reference: Path,
    pub estimate: Path,
    pub notes: Vec<String>,
}

/// The paths through corresponding poses in common conventions; `None` where those read are. `files`: reference and estimate.
pub(super) fn agreed(reference: &Path, estimate: &Path, files: [&Trajectory; 2]) -> Option<Agreed> {
    if reference.rotations.is_some() && estimate.rotations.is_some() {
        by_motions(reference, estimate, files)
    } else {
        by_positions(reference, estimate)
    }
}

/// How the poses of a file are read, beside how they were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Reading {
    /// Another order of the quaternions.
    order: Option<QuaternionOrder>,
    /// Whether the poses map world to sensor.
    is_inverted: bool,
    /// The axis of the world and of the sensor that points the other way.
    mirrored_axis: Option<usize>,
}

impl Reading {
    fn num_changes(self) -> usize {
        usize::from(self.order.is_some()) + usize::from(self.is_inverted) + usize::from(self.mirrored_axis.is_some())
    }

    /// How much it changes of what the file says: the order of named columns is a claim as much as their use.
    fn cost(self, file: &Trajectory) -> usize {
        let is_named = file.quaternion_columns.is_some_and(|columns| columns.is_named);
        self.num_changes() + usize::from(is_named && self.order.is_some())
    }

    /// All of a file, mirrored as well or not.
    fn all(file: &Trajectory, may_be_mirrored: bool) -> Vec<Self> {
        let has_quaternions = file.rotation_matrices.is_none() && file.headings.is_none();
        let is_other = |order: &QuaternionOrder| file.quaternion_columns.is_none_or(|read| *order != read.order);
        let orders = [QuaternionOrder::RealPartFirst, QuaternionOrder::RealPartLast]
            .into_iter()
            .filter(|order| has_quaternions && is_other(order));
        let with_order = orders.map(|order| Self { order: Some(order), ..Self::default() });
        let mut readings: Vec<Self> = std::iter::once(Self::default()).chain(with_order).collect();
        let doubled = |readings: &[Self], change: fn(Self) -> Self| -> Vec<Self> {
            readings.iter().copied().chain(readings.iter().map(|reading| change(*reading))).collect()
        };
        readings = doubled(&readings, |reading| Self { is_inverted: true, ..reading });
        if may_be_mirrored {
            readings = doubled(&readings, |reading| Self { mirrored_axis: Some(1), ..reading });
        }
        readings
    }

    /// The path under this reading.
    fn of(self, path: &Path) -> Path {
        let mut path = path.clone();
        let Some(rotations) = &mut path.rotations else { return path };
        for (R, p) in rotations.iter_mut().zip(&mut path.positions) {
            if let Some(order) = self.order {
                *R = nearest_rotation(R).map_or(*R, |q| reordered(&q, order.other()).to_rotation_matrix().into_inner());
            }
            if self.is_inverted {
                *R = R.transpose();
                *p = -(*R * *p);
            }
            if let Some(axis) = self.mirrored_axis {
                let S = mirror(axis);
                (*R, *p) = (S * *R * S, S * *p);
            }
        }
        path
    }

    fn words(self, whose: &str) -> Vec<String> {
        let order = self.order.map(|order| match order {
            QuaternionOrder::RealPartFirst => format!("The {whose}'s quaternions were read as qw qx qy qz."),
            QuaternionOrder::RealPartLast => format!("The {whose}'s quaternions were read as qx qy qz qw."),
        });
        let direction =
            self.is_inverted.then(|| format!("The {whose}'s poses map world to sensor, and were inverted."));
        let hand = self.mirrored_axis.map(|axis| {
            let axis = ["x", "y", "z"][axis];
            format!("One of the two is left-handed and the other right-handed: the {whose} was mirrored ({axis} to -{axis}).")
        });
        [order, direction, hand].into_iter().flatten().collect()
    }
}

fn mirror(axis: usize) -> Matrix3<f64> {
    let mut S = Matrix3::identity();
    S[(axis, axis)] = -1.0;
    S
}

/// Both files under a reading, and the rotation of the estimate's sensor axes into the reference's.
struct Hypothesis {
    readings: [Reading; 2],
    axes: Matrix3<f64>,
    /// Mean difference of the motions (m).
    misfit: f64,
}

fn by_motions(reference: &Path, estimate: &Path, files: [&Trajectory; 2]) -> Option<Agreed> {
    let motions = Motions::of(reference.len())?;
    let mut readings: Vec<[Reading; 2]> = Reading::all(files[0], false)
        .into_iter()
        .flat_map(|first| Reading::all(files[1], true).into_iter().map(move |second| [first, second]))
        // The inverses of both would also explain two sensors that are mounted on one body anyhow.
        .filter(|[first, second]| !(first.is_inverted && second.is_inverted))
        .collect();
    // The fewest changes first; a stable sort leaves the estimate's before the reference's.
    readings.sort_by_key(|pair| pair[0].cost(files[0]) + pair[1].cost(files[1]));
    let read = |path: &Path, reading: Reading| Motions::between(&reading.of(&motions.sampled(path)));
    let mut best: Option<Hypothesis> = None;
    let (mut as_read, mut size) = (0.0, 0.0);
    for pair in readings {
        let (of_reference, of_estimate) = (read(reference, pair[0]), read(estimate, pair[1]));
        let scale = scale_between(&of_reference, &of_estimate);
        if best.is_none() {
            as_read = misfit(&of_reference, &of_estimate, &Matrix3::identity(), scale);
            size = mean_size(&of_reference);
        }
        for axes in [Matrix3::identity(), best_axes(&of_reference, &of_estimate, scale)] {
            let misfit = misfit(&of_reference, &of_estimate, &axes, scale);
            let least = best.as_ref().map(|best| best.misfit);
            if least.is_none_or(|least| misfit + MISFIT_ROUNDING < MAX_MISFIT_RATIO * least) {
                best = Some(Hypothesis { readings: pair, axes, misfit });
            }
        }
    }
    let Hypothesis { readings: [first, second], axes, misfit } = best?;
    let is_as_read = first.num_changes() + second.num_changes() == 0 && axes == Matrix3::identity();
    if is_as_read || !is_beyond_chance(as_read, misfit, motions.num_independent) || misfit > MAX_REMAINING * size {
        return None;
    }
    let reference_read = first.of(reference);
    let second =
        Reading { mirrored_axis: second.mirrored_axis.map(|_| mirrored_axis(&reference_read, estimate)), ..second };
    let mut estimate_read = second.of(estimate);
    let (of_reference, of_estimate) = (read(reference, first), read(estimate, second));
    let axes = if second.mirrored_axis.is_some() {
        best_axes(&of_reference, &of_estimate, scale_between(&of_reference, &of_estimate))
    } else {
        axes
    };
    for R in estimate_read.rotations.iter_mut().flatten() {
        *R *= axes.transpose();
    }
    let mut notes = [first.words("reference"), second.words("estimate")].concat();
    notes.extend(axes_words(&axes));
    notes.push(format!(
        "As read, the motions of the two differ by {as_read:.2} m in the mean, a radian counting as 2 m; so by {misfit:.2} m."
    ));
    Some(Agreed { reference: reference_read, estimate: estimate_read, notes })
}

/// Of positions alone the handedness: whether mirrored ones fit decisively better.
fn by_positions(reference: &Path, estimate: &Path) -> Option<Agreed> {
    let axis = mirrored_axis(reference, estimate);
    let mirrored: Vec<_> = estimate.positions.iter().map(|p| mirror(axis) * p).collect();
    let misfit = |positions: &[Vector3<f64>]| {
        let fit = best_fit(positions, &reference.positions, true).ok()?.similarity;
        let off =
            |(p, q): (&Vector3<f64>, &Vector3<f64>)| (fit.scale * (fit.rotation * p) + fit.translation - q).norm();
        Some(positions.iter().zip(&reference.positions).map(off).sum::<f64>() / positions.len() as f64)
    };
    let (as_read, other) = (misfit(&estimate.positions)?, misfit(&mirrored)?);
    let num_independent = estimate.len() / FRAME_GAPS[FRAME_GAPS.len() - 1];
    is_beyond_chance(as_read, other, num_independent).then(|| {
        let reading = Reading { mirrored_axis: Some(axis), ..Reading::default() };
        let estimate = Path { positions: mirrored, rotations: None, stamps: estimate.stamps.clone() };
        Agreed { reference: reference.clone(), estimate, notes: reading.words("estimate") }
    })
}

/// Whether another reading leaves so much smaller a misfit than the one as read that chance does not explain it.
pub(super) fn is_beyond_chance(as_read: f64, other: f64, num_independent: usize) -> bool {
    let ratio = (as_read + MISFIT_ROUNDING) / (other + MISFIT_ROUNDING);
    ratio * MAX_REMAINING >= 1.0 && num_independent as f64 * ratio.ln() >= MIN_LOG_LIKELIHOOD_RATIO
}

/// The axis whose reversal brings the estimate's positions nearest to the reference's; the directions of the sensor's axes make
/// up for the choice in everything but a comparison without alignment.
fn mirrored_axis(reference: &Path, estimate: &Path) -> usize {
    let distance = |axis: usize| -> f64 {
        let S = mirror(axis);
        reference.positions.iter().zip(&estimate.positions).map(|(p, q)| (p - S * q).norm()).sum()
    };
    (0..3).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(1)
}

fn axes_words(axes: &Matrix3<f64>) -> Option<String> {
    let name = |column: usize| {
        let row = axes.column(column).iamax();
        format!("{}{}", if axes[(row, column)] < 0.0 { "-" } else { "" }, ["x", "y", "z"][row])
    };
    (*axes != Matrix3::identity()).then(|| {
        let [x, y, z] = [0, 1, 2].map(name);
        format!(
            "The sensor's axes differ: x, y, z of the estimate are {x}, {y}, {z} of the reference, and its orientations were \
             turned accordingly."
        )
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Quaternion, Rotation3, UnitQuaternion};

    use super::super::pair_motions::distance;
    use super::*;
    use crate::geometry::{Pose3, RigidMotion};

    /// A walk in space of a sensor with noise of 1 % of its motion.
    fn walk(count: u32, seed: f64) -> Vec<Pose3> {
        let mut pose = Pose3::identity();
        let step = |i: u32| {
            let i = f64::from(i);
            let noise = |k: f64| 2e-3 * (i * (12.9898 + seed) + k).sin();
            let motion = [
                0.02 * i.sin(),
                0.15,
                0.03 * (0.3 * i).cos(),
                0.1 + 0.05 * (0.2 * i).sin(),
                0.02,
                0.25 + 0.1 * (0.1 * i).cos(),
            ];
            pose *=
                <Pose3 as RigidMotion>::exp(&std::array::from_fn::<f64, 6, _>(|k| motion[k] + noise(k as f64)).into());
            pose
        };
        (0..count).map(step).collect()
    }

    fn path(file: &Trajectory) -> Path {
        Path::of(file, 0..file.len())
    }

    fn compared(reference: &[Pose3], estimate: &[Pose3]) -> Option<Agreed> {
        let [reference, estimate] = [reference, estimate].map(Trajectory::from_poses);
        agreed(&path(&reference), &path(&estimate), [&reference, &estimate])
    }

    /// Largest difference of the motions of two paths.
    fn difference(a: &Path, b: &Path) -> f64 {
        let motions = Motions::of(a.len()).unwrap();
        let [a, b] = [a, b].map(|path| Motions::between(&motions.sampled(path)));
        a.iter().zip(&b).map(|(a, b)| distance(a, b)).fold(0.0, f64::max)
    }

    #[test]
    fn every_convention_of_either_side_is_found() {
        let truth = walk(60, 0.0);
        let world = Isometry3::new(Vector3::new(4.0, -3.0, 1.0), Vector3::new(0.3, -0.8, 1.1));
        let mine: Vec<Pose3> = walk(60, 1.0).into_iter().map(|pose| world * pose).collect();
        let swapped = |pose: &Pose3| {
            let q = pose.rotation;
            let q = UnitQuaternion::from_quaternion(Quaternion::new(q.k, q.w, q.i, q.j));
            Isometry3::from_parts(pose.translation, q)
        };
        let turned = |pose: &Pose3| pose * Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
        let mirrored = |pose: &Pose3| {
            let S = mirror(1);
            let R = S * pose.rotation.to_rotation_matrix().into_inner() * S;
            let R = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(R));
            Isometry3::from_parts((S * pose.translation.vector).into(), R)
        };
        let all = |poses: &[Pose3], change: &dyn Fn(&Pose3) -> Pose3| poses.iter().map(change).collect::<Vec<_>>();
        let before = difference(&path(&Trajectory::from_poses(&truth)), &path(&Trajectory::from_poses(&mine)));
        for (reference, estimate, words) in [
            (truth.clone(), mine.clone(), vec![]),
            (truth.clone(), all(&mine, &swapped), vec!["The estimate's quaternions"]),
            (all(&mine, &swapped), truth.clone(), vec!["The reference's quaternions"]),
            (all(&truth, &swapped), all(&mine, &swapped), vec!["The reference's quat", "The estimate's quat"]),
            (truth.clone(), all(&mine, &turned), vec!["x, y, z of the estimate are x, -y, -z of the reference"]),
            (all(&truth, &Pose3::inverse), mine.clone(), vec!["The reference's poses map world to sensor"]),
            (truth.clone(), all(&mine, &Pose3::inverse), vec!["The estimate's poses map world to sensor"]),
            (truth.clone(), all(&mine, &mirrored), vec!["left-handed"]),
            (all(&truth, &mirrored), all(&mine, &turned), vec!["left-handed"]),
        ] {
            let found = compared(&reference, &estimate);
            assert_eq!(found.is_none(), words.is_empty(), "{words:?}");
            let Some(found) = found else { continue };
            let told = found.notes.join(" ");
            assert!(words.iter().all(|word| told.contains(word)), "{told} {words:?}");
            let after = difference(&found.reference, &found.estimate);
            assert!(after < before + 1e-9, "{told}: {after} m, {before} m");
        }
    }

    #[test]
    fn what_motions_cannot_tell_is_left_as_it_was_read() {
        let truth = walk(60, 0.0);
        let other = (0..60).scan(Pose3::identity(), |pose, i: u32| {
            let angle = |k: f64| (1.7 * f64::from(i) + k).sin();
            *pose *= Isometry3::new(
                0.15 * Vector3::new(angle(0.0), angle(2.0), angle(4.0)),
                0.2 * Vector3::new(angle(1.0), angle(3.0), 0.0),
            );
            Some(*pose)
        });
        let other: Vec<Pose3> = other.collect();
        assert!(compared(&truth, &other).is_none(), "another recording");
        let still = vec![Pose3::identity(); 60];
        assert!(compared(&truth, &still).is_none() && compared(&still, &still).is_none());
        let straight: Vec<Pose3> = (0..60).map(|i| Pose3::translation(0.1 * f64::from(i), 0.0, 0.0)).collect();
        assert!(compared(&straight, &straight).is_none());
        assert!(compared(&truth[..1], &truth[..1]).is_none());
        let turned: Vec<Pose3> = truth[..3].iter().map(|pose| pose * Isometry3::rotation(Vector3::x() * 3.0)).collect();
        let few = compared(&truth[..3], &turned).map(|found| found.notes);
        assert_eq!(few, None, "two motions are too few");
    }

    #[test]
    fn mirrored_positions_without_orientations_are_found() {
        let mut file = Trajectory::from_poses(&walk(400, 0.0));
        file.orientations = None;
        let mut mirrored = Trajectory::from_poses(&walk(400, 1.0));
        mirrored.orientations = None;
        assert!(agreed(&path(&file), &path(&mirrored), [&file, &mirrored]).is_none());
        for p in &mut mirrored.positions {
            p.z = -p.z;
        }
        let found = agreed(&path(&file), &path(&mirrored), [&file, &mirrored]).unwrap();
        assert!(found.notes[0].contains("left-handed"), "{:?}", found.notes);
    }
}
