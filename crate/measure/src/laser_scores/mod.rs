//! Scores the planar engine on whole logs, natively: the share of wrong relations, of wrong relations between good scans, and the
//! time per scan.
//!
//! `cargo measure laser_scores [--out FOLDER] [--data FOLDER] [--only NAME] [--mode odometry|alone]
//! [--damage all|NAME,... [--draw 0]] [--append NAME] [--worlds]
//! [--loops] [--campus [seed=1] [seeds=1] [campus_step=1] [campus_length=630]] [NAME=VALUE]...`
//!
//! `--damage` runs damaged logs (`damage.rs`; `--draw` puts the faults of `wheels_stop` elsewhere), `--append` logs with another log appended,
//! `--worlds` the generated worlds that look the same from several places.
//!
//! `--loops` prints what the search for loops compared and what came of it, by the poses in the log (`loops.rs`).
//!
//! A pair is wrong when its error against its relation exceeds 0.5 m or 5 degrees. `false` is the share of wrong pairs
//! among those whose frames are both good and of one piece.

mod campus;
mod damage;
mod loops;
mod worlds;

use std::fs;

use nalgebra::Rotation3;
use scanstitch::evaluation::relations::{WRONG_ROTATION_DEG, WRONG_TRANSLATION};
use scanstitch::geometry::{Pose2, Pose3, RigidMotion};
use scanstitch::io::laser_log;
use scanstitch::io::relations::{self, PoseKey, Relation};
use scanstitch::io::trajectory::{self, Trajectory};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::{FrameResult, PlanarPose, Stage};
use scanstitch::pipeline::settings::Settings;
use scanstitch::preprocess::clean::CleaningReport;

use self::damage::Input;
use crate::arguments::{arguments, flag};

/// Errors above which a pair is wrong (m, degrees).
const WRONG: (f64, f64) = (WRONG_TRANSLATION, WRONG_ROTATION_DEG);

type PlanarFrame = FrameResult<PlanarPose, CleaningReport>;

/// A log and the relations that it is scored by.
struct Case {
    name: &'static str,
    log: &'static str,
    odometry: Option<&'static str>,
    /// Relations by name; the first decides what is falsely good. A log without any runs only where it is named.
    relations: &'static [(&'static str, &'static str)],
}

const CASES: &[Case] = &[
    Case {
        name: "fr079",
        log: "fr079/fr079.log",
        odometry: Some("fr079/fr079.odometry.txt"),
        relations: &[("loops", "fr079/fr079.log")],
    },
    Case {
        name: "freiburg-101",
        log: "radish/freiburg-101.log",
        odometry: Some("radish/freiburg-101.odometry.txt"),
        relations: &[("places", "radish/freiburg-101.places.txt"), ("stretches", "radish/freiburg-101.stretches.txt")],
    },
    Case {
        name: "belgioioso",
        log: "radish/belgioioso.log",
        odometry: Some("radish/belgioioso.odometry.txt"),
        relations: &[("places", "radish/belgioioso.places.txt"), ("stretches", "radish/belgioioso.stretches.txt")],
    },
    Case {
        name: "edmonton",
        log: "radish/edmonton.log",
        odometry: Some("radish/edmonton.odometry.txt"),
        relations: &[("places", "radish/edmonton.places.txt"), ("stretches", "radish/edmonton.stretches.txt")],
    },
    Case {
        name: "infinite-corridor",
        log: "radish/infinite-corridor.log",
        odometry: Some("radish/infinite-corridor.odometry.txt"),
        relations: &[
            ("places", "radish/infinite-corridor.places.txt"),
            ("stretches", "radish/infinite-corridor.stretches.txt"),
        ],
    },
    Case { name: "aces", log: "radish/aces.clf", odometry: None, relations: &[("relations", "radish/aces.relations")] },
    Case { name: "fr-clinic", log: "radish/fr-clinic.clf", odometry: None, relations: &[] },
];

pub fn main() {
    let arguments = arguments();
    let option = |name: &str| arguments.iter().position(|a| a == name).and_then(|at| arguments.get(at + 1)).cloned();
    let data = option("--data").unwrap_or_else(|| "../shared/data/laser".to_owned());
    let mut settings = serde_json::to_value(Settings::default()).expect("settings are plain data");
    for pair in &arguments {
        if let Some((name, value)) = pair.split_once('=').filter(|(name, _)| !campus::OPTIONS.contains(name)) {
            settings[name] = serde_json::from_str(value).unwrap_or_else(|_| value.into());
        }
    }
    if arguments.iter().any(|argument| argument == "--worlds") {
        worlds::print_table(&settings);
        return;
    }
    if arguments.iter().any(|argument| argument == "--campus") {
        campus::print_table(&settings, option("--out").as_deref());
        return;
    }
    let read = |name: &str| {
        let case = CASES.iter().find(|case| case.name == name).expect("a name of a log");
        let log = laser_log::read(&fs::read(format!("{data}/{}", case.log)).expect("the log can be read"))
            .expect("the log is sound");
        let odometry = case.odometry.map(|file| {
            trajectory::read(&fs::read(format!("{data}/{file}")).expect("odometry can be read")).expect("it is sound")
        });
        Input::new(&log, odometry.as_ref())
    };
    let only = option("--only");
    let mode = option("--mode");
    let damages: Vec<String> = match option("--damage").as_deref() {
        None => vec![String::new()],
        Some("all") => damage::ALL.iter().map(|&name| name.to_owned()).collect(),
        Some(list) => list.split(',').map(str::to_owned).collect(),
    };
    for case in CASES.iter().filter(|case| {
        only.as_deref().map_or(!case.relations.is_empty(), |only| only.split(',').any(|o| o == case.name))
    }) {
        for damage in &damages {
            let mut input = read(case.name);
            input.draw = option("--draw").map_or(0, |draw| draw.parse().expect("the number of a draw"));
            if !damage.is_empty() {
                input.damage(damage);
            }
            if let Some(other) = option("--append") {
                input.append(&read(&other));
            }
            for with_odometry in [true, false] {
                let name = if with_odometry { "odometry" } else { "alone" };
                if mode.as_deref().is_some_and(|mode| mode != name) {
                    continue;
                }
                let mut settings = settings.clone();
                if !with_odometry {
                    settings["odometry"] = "none".into();
                }
                let settings = serde_json::from_value(settings).expect("the settings are right");
                let is_own = case.odometry.is_none() && damage.is_empty();
                let odometry = input.trajectory().filter(|_| with_odometry && !is_own);
                let label = format!("{damage} {name}");
                score(case, label.trim(), &input, odometry, settings, &data, option("--out").as_deref());
            }
        }
    }
}

fn score(
    case: &Case,
    mode: &str,
    input: &Input,
    odometry: Option<Trajectory>,
    settings: Settings,
    data: &str,
    out: Option<&str>,
) {
    let mut reconstruction = Reconstruction::new(settings).expect("the settings are right");
    reconstruction.add_log("log", &input.log);
    if let Some(odometry) = odometry {
        reconstruction.set_odometry("odometry", odometry).expect("odometry has headings");
    }
    let started = processor_seconds();
    let (mut stage, mut since, mut times) = (Stage::Register, processor_seconds(), Vec::new());
    while stage != Stage::Done {
        let next = reconstruction.step().stage;
        if next != stage {
            times.push(format!("{stage:?} {:.2}", processor_seconds() - since));
            (stage, since) = (next, processor_seconds());
        }
    }
    let seconds = processor_seconds() - started;
    let result = reconstruction.result();
    let poses = reconstruction.poses();
    let count = |status| result.frames.iter().filter(|frame| frame.status == status).count();
    println!(
        "{:18} {mode:22} {} scans, {:.2} ms each ({}), good {} doubtful {} lost {}, {} pieces {:?}",
        case.name,
        poses.len(),
        1e3 * seconds / poses.len() as f64,
        times.join(" "),
        count(Status::Good),
        count(Status::Doubtful),
        count(Status::Lost),
        num_pieces(&result.frames),
        pieces(&result.frames)
    );
    for (name, file) in case.relations {
        let list = relations::read(&fs::read(format!("{data}/{file}")).expect("relations can be read"))
            .expect("they are sound");
        let list: Vec<Relation> = list.into_iter().filter(|relation| !relation.is_step()).collect();
        println!("    {name:10} {}", summary(&list, input, &poses, &result.frames));
    }
    println!("    {}", steps(input, &poses, &result.frames));
    println!("    {}", small_pieces(|scan| input.log.scans[scan].reference, &poses, &result.frames));
    let reference = |scan: usize| input.log.scans[scan].reference;
    if let Some(calibration) = case.odometry.and_then(|_| calibration(reference, &reconstruction)) {
        println!("    {calibration}");
    }
    if flag("--loops") {
        loops::print_table(input, &reconstruction.loop_trials());
    }
    for note in result.notes.iter().filter(|_| option_notes()) {
        println!("    note: {note}");
    }
    if let Some(out) = out {
        fs::create_dir_all(out).expect("the folder can be made");
        let grid = reconstruction.occupancy_grid(0.1);
        fs::write(format!("{out}/{}.{}.pgm", case.name, mode.replace(' ', "_")), grid.pgm())
            .expect("the map can be written");
        let rows: Vec<String> = poses
            .iter()
            .zip(&result.frames)
            .enumerate()
            .map(|(index, (pose, frame))| {
                format!(
                    "{index} {:.4} {:.4} {:.5} {:?} piece {} agreement {:.3} overlap {:.3} {}\n",
                    pose.translation.x,
                    pose.translation.y,
                    pose.rotation.angle(),
                    frame.status,
                    frame.piece,
                    frame.agreement,
                    frame.overlap,
                    frame.reason
                )
            })
            .collect();
        fs::write(format!("{out}/{}.{}.txt", case.name, mode.replace(' ', "_")), rows.concat())
            .expect("the poses can be written");
    }
}

/// Processor time of this process (s), which other programs do not affect; 0 where the system does not report it.
fn processor_seconds() -> f64 {
    let Ok(stat) = fs::read_to_string("/proc/self/stat") else { return 0.0 };
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks: Option<f64> = after_name.split_whitespace().nth(11).and_then(|word| word.parse().ok());
    ticks.unwrap_or(0.0) / 100.0
}

fn option_notes() -> bool {
    !flag("--damage")
}

fn num_pieces(frames: &[PlanarFrame]) -> usize {
    frames.iter().map(|frame| frame.piece + 1).max().unwrap_or(0)
}

/// Sizes of the largest pieces.
fn pieces(frames: &[PlanarFrame]) -> Vec<usize> {
    let mut sizes = vec![0; num_pieces(frames)];
    for frame in frames {
        sizes[frame.piece] += 1;
    }
    sizes.sort_by_key(|&size| std::cmp::Reverse(size));
    sizes.truncate(6);
    sizes
}

/// Steps between good frames of a piece that are wrong by the poses in the log, where a program corrected these.
fn steps(input: &Input, poses: &[Pose2], frames: &[PlanarFrame]) -> String {
    let mut wrong = Vec::new();
    for later in 1..poses.len() {
        let (a, b) = (&input.log.scans[later - 1], &input.log.scans[later]);
        let is_good = |frame: usize| frames[frame].status == Status::Good;
        let (true, Some(from), Some(to)) = (is_good(later - 1) && is_good(later), a.reference, b.reference) else {
            continue;
        };
        let off = (from.inverse() * to).inverse() * (poses[later - 1].inverse() * poses[later]);
        let same = frames[later].piece == frames[later - 1].piece;
        if same && (off.translation_norm() > WRONG.0 || off.rotation_angle() > WRONG.1.to_radians()) {
            wrong.push(later);
        }
    }
    wrong.truncate(30);
    format!("good steps that are wrong: {wrong:?}")
}

/// Pairs of good frames of pieces with fewer frames than the pairs of the stretches are apart: how many, and how many are wrong by
/// these poses, those in the log where a program corrected them.
fn small_pieces(reference: impl Fn(usize) -> Option<Pose2>, poses: &[Pose2], frames: &[PlanarFrame]) -> String {
    let (mut count, mut wrong) = (0, 0);
    for piece in 1..num_pieces(frames) {
        let of: Vec<usize> = (0..frames.len()).filter(|&frame| frames[frame].piece == piece).collect();
        let good: Vec<usize> = of.iter().copied().filter(|&frame| frames[frame].status == Status::Good).collect();
        let pairs = good.iter().flat_map(|&a| good.iter().map(move |&b| (a, b))).filter(|(a, b)| a < b);
        for (a, b) in pairs.filter(|_| of.len() < 20) {
            let (Some(from), Some(to)) = (reference(a), reference(b)) else { continue };
            let off = (from.inverse() * to).inverse() * (poses[a].inverse() * poses[b]);
            count += 1;
            wrong += usize::from(off.translation_norm() > WRONG.0 || off.rotation_angle() > WRONG.1.to_radians());
        }
    }
    format!("small pieces {count} pairs of good frames, wrong {wrong}")
}

/// Ways of this length (m) tell how far predicted errors are right.
const CALIBRATED: std::ops::Range<f64> = 10.0..25.0;
/// The median and the 90 % quantile of errors of unit deviation: of a heading (normal), of a position in the plane (Rayleigh, by
/// the root of both variances).
const UNIT_ERRORS: [(f64, f64); 2] = [(0.674, 1.645), (0.833, 1.517)];

/// Errors by these poses, those in the log where a program corrected them, as multiples of those that the graph predicts: median and
/// 90 % quantile, each by that of unit errors.
fn calibration(reference: impl Fn(usize) -> Option<Pose2>, reconstruction: &Reconstruction) -> Option<String> {
    let (poses, mut ratios) = (reconstruction.poses(), [Vec::new(), Vec::new()]);
    let (frames, mut sigmas) = (reconstruction.frames_from(0), [Vec::new(), Vec::new()]);
    for known in reconstruction.uncertainties() {
        let (i, j) = (known.from, known.to);
        let (from, to) = (reference(i)?, reference(j)?);
        let motion = from.inverse() * to;
        let is_good = |frame: usize| frames[frame].status == Status::Good && frames[frame].piece == frames[i].piece;
        if CALIBRATED.contains(&motion.translation_norm()) && is_good(i) && is_good(j) {
            let off = motion.inverse() * (poses[i].inverse() * poses[j]);
            ratios[0].push(off.rotation_angle() / known.heading);
            ratios[1].push(off.translation_norm() / known.position);
            sigmas[0].push(known.heading.to_degrees());
            sigmas[1].push(known.position);
        }
    }
    let quantile = |values: &mut Vec<f64>, share: f64| {
        values.sort_by(f64::total_cmp);
        values.get((share * values.len() as f64) as usize).copied().unwrap_or(f64::NAN)
    };
    let of = |values: &mut Vec<f64>, unit: (f64, f64)| (quantile(values, 0.5) / unit.0, quantile(values, 0.9) / unit.1);
    let (heading, position) = (of(&mut ratios[0], UNIT_ERRORS[0]), of(&mut ratios[1], UNIT_ERRORS[1]));
    let known = sigmas.map(|mut sigmas| quantile(&mut sigmas, 0.5));
    Some(format!(
        "{} ways of 10 to 25 m, predicted {:.2} deg {:.2} m, errors over predicted: heading {:.2} {:.2}, position {:.2} {:.2}",
        ratios[0].len(),
        known[0],
        known[1],
        heading.0,
        heading.1,
        position.0,
        position.1
    ))
}

fn index_of(key: PoseKey, Input { log, numbers, .. }: &Input) -> Option<usize> {
    match key {
        PoseKey::Index(index) => numbers.iter().position(|&number| number == index),
        PoseKey::Time(time) => {
            let off = |index: usize| log.scans[index].time.map_or(f64::INFINITY, |t| (t - time).abs());
            let nearest = (0..log.scans.len()).min_by(|&a, &b| off(a).total_cmp(&off(b)))?;
            (off(nearest) < 0.05).then_some(nearest)
        }
    }
}

fn planar(pose: &Pose3) -> Pose2 {
    let (_, _, heading) = Rotation3::from(pose.rotation).euler_angles();
    Pose2::new(pose.translation.vector.xy(), heading)
}

fn summary(list: &[Relation], input: &Input, poses: &[Pose2], frames: &[PlanarFrame]) -> String {
    let (mut translations, mut rotations) = (Vec::new(), Vec::new());
    let (mut wrong, mut believed, mut falsely) = (0, 0, 0);
    let mut accused = vec![(0usize, 0usize); frames.len()];
    for relation in list {
        let (Some(i), Some(j)) = (index_of(relation.from, input), index_of(relation.to, input)) else { continue };
        let off = planar(&relation.motion).inverse() * (poses[i].inverse() * poses[j]);
        let (t, r) = (off.translation_norm(), off.rotation_angle().to_degrees());
        translations.push(t);
        rotations.push(r);
        let is_wrong = t > WRONG.0 || r > WRONG.1;
        wrong += usize::from(is_wrong);
        let is_good = |frame: usize| frames[frame].status == Status::Good;
        if is_good(i) && is_good(j) && piece(&frames[i]) == piece(&frames[j]) {
            believed += 1;
            falsely += usize::from(is_wrong);
            for frame in [i, j] {
                accused[frame].0 += usize::from(is_wrong);
                accused[frame].1 += 1;
            }
        }
    }
    let judged = accused.iter().filter(|(_, all)| *all > 0).count();
    let guilty = accused.iter().filter(|(wrong, all)| *all > 0 && 2 * wrong > *all).count();
    let share = |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let std = |values: &[f64]| {
        (values.iter().map(|v| (v - mean(values)).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
    };
    let (mt, mr, st, sr) = (mean(&translations), mean(&rotations), std(&translations), std(&rotations));
    translations.sort_by(f64::total_cmp);
    format!(
        "{} pairs, wrong {:5.1} %, median {:.3} max {:.2}, mean {mt:.4} +- {st:.4} m {mr:.3} +- {sr:.3} deg; good pairs {believed}, false {:.2} %, frames {guilty} of {judged}",
        translations.len(),
        share(wrong, translations.len()),
        translations.get(translations.len() / 2).copied().unwrap_or(f64::NAN),
        translations.last().copied().unwrap_or(f64::NAN),
        share(falsely, believed),
    )
}

/// The certain piece of the map that a frame belongs to.
fn piece(frame: &PlanarFrame) -> usize {
    frame.piece
}
