//! Maps mended by hand: wrong loops taken out, right ones put in, pieces joined.

use std::fs;
use std::ops::Range;

use nalgebra::Vector2;

use crate::common::shared_data;
use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::graph::optimize::optimize;
use scanstitch::io::laser_log::{self, LaserLog};
use scanstitch::io::pose_graph::{self, AnyPoseGraph};
use scanstitch::io::trajectory;
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::{Edit, Reconstruction};
use scanstitch::pipeline::report::{PlanarPose, Stage};
use scanstitch::pipeline::settings::Settings;

fn radish_log(name: &str) -> Option<LaserLog> {
    let folder = shared_data("laser/radish")?;
    Some(laser_log::read(&fs::read(folder.join(name)).unwrap()).unwrap())
}

fn finished(mut reconstruction: Reconstruction) -> Reconstruction {
    while reconstruction.step().stage != Stage::Done {}
    reconstruction
}

/// The map after these steps, and the reasons for those that were not taken.
fn mended(reconstruction: Reconstruction, edits: &[Edit]) -> (Reconstruction, Vec<String>) {
    let mut reconstruction = reconstruction;
    let refused = reconstruction.set_edits(edits).unwrap();
    (finished(reconstruction), refused.into_iter().map(|refused| refused.reason).collect())
}

/// A loop as if two scans had been taken at one place.
fn same_pose(target: usize, source: usize, unchecked: bool) -> Edit {
    Edit::AddLoop { target, source, T_target_source: PlanarPose { x: 0.0, y: 0.0, theta: 0.0 }, unchecked }
}

fn num_good(reconstruction: &Reconstruction) -> usize {
    reconstruction.frames_from(0).iter().filter(|frame| frame.status == Status::Good).count()
}

/// The graph as a g2o file has its optimum at the poses that are in it.
fn assert_optimal_as_g2o(reconstruction: &Reconstruction) {
    let text = reconstruction.graph_g2o().unwrap();
    let Ok(AnyPoseGraph::Plane(mut graph)) = pose_graph::read(text.as_bytes()) else { panic!("no graph in the plane") };
    assert!(graph.edges.len() > graph.ids.len(), "a chain with loops");
    let before = graph.poses.clone();
    optimize(&mut graph, 100);
    let moved = before.iter().zip(&graph.poses).map(|(before, after)| (before.inverse() * *after).translation_norm());
    let furthest = moved.fold(0.0, f64::max);
    assert!(furthest < 0.005, "a keyframe moves by {furthest} m");
}

#[test]
fn a_wrong_loop_is_found_by_its_chi_squared_and_taken_out_without_a_trace() {
    let Some(log) = radish_log("belgioioso.log") else { return };
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log("belgioioso.log", &log);
    assert_eq!(reconstruction.graph_g2o(), None);
    let mut reconstruction = finished(reconstruction);
    assert_optimal_as_g2o(&reconstruction);
    let (poses, report, right) =
        (reconstruction.poses(), reconstruction.result(), reconstruction.graph_loops().unwrap());
    assert!(right.loops.len() > 20 && right.loops.iter().all(|right| right.chi_squared < 25.9), "{:?}", right.loops);
    let (target, source) = (20, 370);
    let wrong = same_pose(target, source, true);
    let refusal = reconstruction.preview_edit(&[same_pose(target, source, false)]).unwrap().refusal;
    assert!(refusal.unwrap().starts_with("the scans do not match there"));

    reconstruction = mended(reconstruction, std::slice::from_ref(&wrong)).0;
    let apart = |poses: &[Pose2]| (poses[target].inverse() * poses[source]).translation_norm();
    assert!(apart(&poses) > 5.0 && apart(&reconstruction.poses()) < 3.0);
    assert_eq!(num_good(&reconstruction), 0);
    let note = "The map was mended by hand: loops put in 1, taken out 0.";
    assert!(reconstruction.result().notes.iter().any(|told| told == note));
    let loops = reconstruction.graph_loops().unwrap();
    assert!(!loops.left_out.is_empty());
    let worst = loops.loops.iter().max_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared)).unwrap();
    assert!(worst.is_unchecked && worst.is_added && worst.chi_squared > 1000.0, "{worst:?}");

    let remove = Edit::RemoveLoop { target: worst.target, source: worst.source };
    let consequence = reconstruction.preview_edit(&[wrong.clone(), remove.clone()]).unwrap();
    assert!(consequence.refusal.is_none() && consequence.furthest_moves > 5.0, "{consequence:?}");
    assert!(consequence.chi_squared[1] < 0.1 * consequence.chi_squared[0], "{consequence:?}");
    assert_eq!(consequence.num_becoming_good, report.frames.iter().filter(|f| f.status == Status::Good).count());
    reconstruction = mended(reconstruction, &[wrong, remove]).0;
    assert!(reconstruction.poses() == poses && reconstruction.result() == report);
    assert_eq!(reconstruction.graph_loops().unwrap(), right);
}

#[test]
fn a_wrong_loop_that_tears_one_scan_off_the_chain_is_the_most_contradicted_one() {
    let Some(log) = radish_log("belgioioso.log") else { return };
    let wheels = shared_data("laser/radish").unwrap().join("belgioioso.odometry.txt");
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log("belgioioso.log", &log);
    reconstruction.set_odometry("wheels.txt", trajectory::read(&fs::read(wheels).unwrap()).unwrap()).unwrap();
    let mut reconstruction = finished(reconstruction);
    let right = reconstruction.graph_loops().unwrap();
    // With odometry every link of the chain may be switched off: the graph as the loop leaves it agrees with the loop.
    for (target, source) in [(60, 300), (20, 370), (10, 120), (100, 200)] {
        let wrong = same_pose(target, source, true);
        reconstruction = mended(reconstruction, std::slice::from_ref(&wrong)).0;
        let loops = reconstruction.graph_loops().unwrap().loops;
        let worst = loops.iter().max_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared)).unwrap();
        assert!(worst.is_unchecked && worst.chi_squared > 1000.0, "{target} to {source}: {worst:?}");
        let remove = Edit::RemoveLoop { target: worst.target, source: worst.source };
        reconstruction = mended(reconstruction, &[wrong, remove]).0;
        assert_eq!(reconstruction.graph_loops().unwrap(), right);
    }
}

#[test]
fn a_right_loop_is_put_in_again_from_a_rough_guess_and_is_refused_a_second_time() {
    let Some(log) = radish_log("belgioioso.log") else { return };
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log("belgioioso.log", &log);
    let mut reconstruction = finished(reconstruction);
    let loops = reconstruction.graph_loops().unwrap().loops;
    let off = Pose2::new(Vector2::new(0.4, -0.3), 0.1);
    let mut num_taken = 0;
    let tried: Vec<_> = loops.iter().step_by(3).collect();
    for right in &tried {
        let (target, source) = (right.target, right.source);
        let guess = (off * Pose2::from(right.T_target_source)).into();
        let add = Edit::AddLoop { target, source, T_target_source: guess, unchecked: false };
        let again = reconstruction.preview_edit(&[Edit::RemoveLoop { target, source }, add.clone()]).unwrap();
        num_taken += usize::from(again.refusal.is_none());
        let twice = reconstruction.preview_edit(&[add]).unwrap();
        assert_eq!(twice.refusal.unwrap(), "there is a loop between these places already: take it out first");
    }
    assert!(tried.len() > 5 && 10 * num_taken > 8 * tried.len(), "{num_taken} of {}", tried.len());
}

/// A part of a log that keeps no times: nothing says that it goes on with another.
fn part(log: &LaserLog, numbers: Range<usize>) -> LaserLog {
    let mut log = LaserLog { scans: log.scans[numbers].to_vec(), ..log.clone() };
    log.scans.iter_mut().for_each(|scan| scan.time = None);
    log
}

#[test]
fn pieces_of_a_corridor_are_joined_by_hand_and_come_apart_when_that_is_undone() {
    let Some(log) = radish_log("infinite-corridor.log") else { return };
    let wheels = shared_data("laser/radish").unwrap().join("infinite-corridor.odometry.txt");
    let mut reconstruction = Reconstruction::without_joining(Settings::default()).unwrap();
    reconstruction.add_log("first.log", &part(&log, 0..300));
    reconstruction.add_log("second.log", &part(&log, 500..800));
    reconstruction.set_odometry("wheels.txt", trajectory::read(&fs::read(wheels).unwrap()).unwrap()).unwrap();
    let mut reconstruction = finished(reconstruction);
    let (poses, report) = (reconstruction.poses(), reconstruction.result());
    let truth = |scan: usize| log.scans[if scan < 300 { scan } else { scan + 200 }].reference.unwrap();
    let off_by = |poses: &[Pose2], (a, b): (usize, usize)| {
        let (T, known) = (poses[a].inverse() * poses[b], truth(a).inverse() * truth(b));
        (known.inverse() * T).translation_norm()
    };
    // Where the two ways cross. A guess by eye is half a metre and six degrees off.
    let (target, source) = (150, 590);
    let guess = Pose2::new(Vector2::new(0.4, -0.3), 0.1) * truth(target).inverse() * truth(source);
    let join = Edit::AddLoop { target, source, T_target_source: guess.into(), unchecked: false };
    let consequence = reconstruction.preview_edit(std::slice::from_ref(&join)).unwrap();
    assert!(consequence.refusal.is_none(), "{consequence:?}");
    assert_eq!(consequence.num_pieces[1] + 1, consequence.num_pieces[0]);
    let (mut reconstruction, refused) = mended(reconstruction, std::slice::from_ref(&join));
    assert!(refused.is_empty());
    let pieces: Vec<usize> = reconstruction.frames_from(0).iter().map(|frame| frame.piece).collect();
    assert_eq!(pieces[target], pieces[source]);
    // One guess by hand may be wrong by a period of the corridor: it is believed when a second one agrees.
    let num_before = report.frames.iter().filter(|frame| frame.status == Status::Good).count();
    assert!(num_good(&reconstruction) < num_before - 200, "{} of {num_before}", num_good(&reconstruction));
    assert!(reconstruction.frames_from(0).iter().any(|frame| frame.reason.contains("a second one, elsewhere")));
    let (target, source) = (65, 580);
    let guess = Pose2::new(Vector2::new(-0.3, 0.4), -0.1) * truth(target).inverse() * truth(source);
    let confirm = Edit::AddLoop { target, source, T_target_source: guess.into(), unchecked: false };
    let consequence = reconstruction.preview_edit(&[join.clone(), confirm.clone()]).unwrap();
    assert!(consequence.refusal.is_none() && consequence.num_becoming_good > 0, "{consequence:?}");
    let (mut reconstruction, refused) = mended(reconstruction, &[join.clone(), confirm]);
    assert!(refused.is_empty());
    assert!(num_good(&reconstruction) >= num_before, "{} of {num_before}", num_good(&reconstruction));
    let near = (145, 585);
    assert!(off_by(&poses, near) > 5.0 && off_by(&reconstruction.poses(), near) < 0.3);

    // Nothing more than the right place is taken.
    let elsewhere = Edit::AddLoop { target: 20, source: 400, T_target_source: guess.into(), unchecked: false };
    assert!(reconstruction.preview_edit(&[join, elsewhere]).unwrap().refusal.is_some());
    let reconstruction = mended(reconstruction, &[]).0;
    assert!(reconstruction.poses() == poses && reconstruction.result() == report);
}
