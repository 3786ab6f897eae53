//! Compares ways to register two depth frames without a guess: `cargo measure global_pairs [--pairs N]
//! [--flats N] [--first SEED] [--seed N] [--cache FOLDER] [--each]`. Frames of the flats in ../shared/data/rgbd and of
//! generated ones are paired at random where they overlap by more than 40 % at their ground-truth poses, which serve for nothing
//! else. Prints a Markdown table.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use scanstitch::camera::SurfelImage;
use scanstitch::geometry::{PointCloud, Pose3};
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::depth::{DepthOptions, PairRegistration, Search};
use scanstitch::pipeline::prepared_frame::{DecodeConfig, FrameLabel, PreparedFrame, Surfaces};
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch::preprocess::voxel_downsample::voxel_downsample;
use scanstitch::registration::free_space::FreeSpaceTest;
use scanstitch::registration::global::consistency::consistent_motion;
use scanstitch::registration::global::fpfh::fpfh;
use scanstitch::registration::global::matching::{FeatureIndex, mutual_matches};
use scanstitch::registration::global::ransac::{RansacOptions, ransac};
use scanstitch::registration::prepared_surfels::PreparedSurfels;
use scanstitch::registration::projective::ProjectiveTarget;
use scanstitch::search::{KdTree, Neighborhood};
use scanstitch_scene::apartment::Tour;
use scanstitch_scene::random::Random;

use crate::arguments::{argument, flag};
use crate::depth::processor_time::timed;
use crate::depth::recordings::{self, Recording, Walk, Way};
use crate::global::{cliques, gnc};

pub fn main() {
    let number = |name: &str, default: usize| argument(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let cache = argument("--cache").map(PathBuf::from);
    let (mut floors, mut flats) = (Vec::new(), Vec::new());
    if Path::new(recordings::DATA).is_dir() {
        floors.extend(["first", "second"].map(recordings::floor));
    } else {
        eprintln!("skipped the recorded floors: ../shared/data is absent");
    }
    let first = number("--first", 31) as u64;
    for seed in first..first + number("--flats", 3) as u64 {
        for bits in [8, 16] {
            let way = Way::Flat(Tour::AllRooms);
            let walk =
                Walk { way, step: 0.25, turn: 10.0, bits, noise: 0.0, frames: 100, focal: 1.0, has_color: false };
            let recording = walk.recording(seed, cache.as_deref());
            flats.push(Recording { name: format!("flat of {}, {bits} bit", recording.name), ..recording });
        }
    }
    let only = argument("--only").unwrap_or_default();
    let methods: Vec<Method> =
        METHODS.iter().copied().filter(|m| only.split('|').any(|w| m.name().contains(w))).collect();
    let voxel_size = argument("--voxel").and_then(|text| text.parse().ok()).unwrap_or(0.1);
    let each = flag("--each");
    let mut tallies = vec![[Tally::default(), Tally::default()]; methods.len()];
    let recordings = [floors, flats].into_iter().enumerate();
    for (kind, recording) in
        recordings.flat_map(|(kind, group)| group.into_iter().map(move |recording| (kind, recording)))
    {
        let frames = prepared(&recording);
        let mut random = Random::new(number("--seed", 1) as u64);
        let pairs = overlapping_pairs(&frames, &recording.truth, number("--pairs", 40), &mut random);
        let mut describing = 0.0;
        let described: Vec<Option<Described>> = (0..frames.len())
            .map(|index| {
                pairs.iter().any(|(a, b)| *a == index || *b == index).then(|| {
                    let (seconds, described) = timed(|| Described::new(&frames[index].image, voxel_size));
                    describing += seconds;
                    described
                })
            })
            .collect();
        eprintln!(
            "{}: {} pairs, a description {:.1} ms, {} points",
            recording.name,
            pairs.len(),
            1e3 * describing / described.iter().flatten().count().max(1) as f64,
            described.iter().flatten().map(|d| d.points.len()).max().unwrap_or(0)
        );
        for &(source, target) in &pairs {
            let truth = recording.truth[target].inverse() * recording.truth[source];
            let lone = PairRegistration::new(&frames[target]);
            let (Some(a), Some(b)) = (&described[source], &described[target]) else { continue };
            let (matching, matches) = timed(|| a.matched_with(b));
            for (method, tally) in methods.iter().zip(&mut tallies) {
                let input =
                    Input { lone: &lone, frame: &frames[source], source: a, target: b, pairs: &matches, voxel_size };
                let (seconds, found) = timed(|| method.register(&input));
                let seconds = seconds + if method.uses_matches() { matching } else { 0.0 };
                let line = tally[kind].add(&input, found, &truth, seconds);
                if each {
                    println!(
                        "{} {source} to {target}, {} matches, {}: {line}",
                        recording.name,
                        matches.len(),
                        method.name()
                    );
                }
            }
        }
    }
    println!(
        "| voxels of {voxel_size} m | floors: found | refined | wrong | time | flats: found | refined | wrong | time |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    for (method, [floors, flats]) in methods.iter().zip(&tallies) {
        println!("| {} | {} | {} |", method.name(), floors.cells(), flats.cells());
    }
}

fn prepared(recording: &Recording) -> Vec<PreparedSurfels> {
    let [fx, fy, cx, cy] = recording.intrinsics.unwrap_or_default();
    let settings = SpatialSettings { fx, fy, cx, cy, ..SpatialSettings::default() };
    let decode_config = DecodeConfig::new(&settings, "0", &recording.depth[0]).expect("a depth image");
    let frame = |(index, bytes): (usize, &Vec<u8>)| {
        let label = FrameLabel { name: index.to_string(), index, time: None };
        let frame = PreparedFrame::from_depth(&decode_config, label, bytes, None).expect("a depth image");
        let Surfaces::Surfels(surfels) = frame.surfaces else { panic!("depth images are surfels") };
        surfels.into_iter().next().expect("a way to read the depth").1
    };
    recording.depth.iter().enumerate().map(frame).collect()
}

/// Share of a frame's surface that another frame saw as well, at their ground-truth poses.
fn overlap(source: &SurfelImage, target: &SurfelImage, T_target_source: &Pose3) -> f64 {
    let view = ProjectiveTarget::draw(target.surfels(), &target.cell_camera(), &Pose3::identity());
    let is_seen = |surfel: &&scanstitch::camera::surfel_image::Surfel| {
        let point = (T_target_source * Point3::from(surfel.point)).coords;
        matches!(view.classify_leniently(&point, 0.1), FreeSpaceTest::Agreeing(seen) if seen.normal.dot(&(T_target_source.rotation * surfel.normal)) > 0.8)
    };
    let num_seen = source.surfels().step_by(7).filter(is_seen).count();
    num_seen as f64 / source.surfels().step_by(7).count().max(1) as f64
}

fn overlapping_pairs(
    frames: &[PreparedSurfels],
    truth: &[Pose3],
    most: usize,
    random: &mut Random,
) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    let any = |random: &mut Random| (random.uniform(0.0, frames.len() as f64) as usize).min(frames.len() - 1);
    for _ in 0..200 * most {
        let (source, target) = (any(random), any(random));
        if source == target || pairs.contains(&(source, target)) {
            continue;
        }
        let T = truth[target].inverse() * truth[source];
        if T.translation.vector.norm() < 8.0
            && overlap(&frames[source].image, &frames[target].image, &T) > 0.4
            && overlap(&frames[target].image, &frames[source].image, &T.inverse()) > 0.4
        {
            pairs.push((source, target));
            if pairs.len() == most {
                break;
            }
        }
    }
    pairs
}

struct Described {
    points: Vec<glam::Vec3>,
    tree: KdTree<3>,
    index: FeatureIndex,
}

impl Described {
    fn new(frame: &SurfelImage, voxel_size: f64) -> Self {
        let single = |v: Vector3<f64>| glam::DVec3::from(<[f64; 3]>::from(v)).as_vec3();
        let cloud = PointCloud {
            normals: Some(frame.surfels().map(|surfel| single(surfel.normal)).collect()),
            ..PointCloud::from_positions(frame.surfels().map(|surfel| single(surfel.point)).collect())
        };
        let cloud = voxel_downsample(&cloud, voxel_size).expect("a voxel");
        let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
        let double = |v: &glam::Vec3| Some(Vector3::from(v.as_dvec3().to_array()));
        let normals: Vec<_> = cloud.normals.iter().flatten().map(double).collect();
        let around = Neighborhood { max_neighbors: 100, radius: 5.0 * voxel_size };
        let index = FeatureIndex::new(fpfh(&cloud.positions, &normals, &tree, around));
        Self { points: cloud.positions, tree, index }
    }

    fn matched_with(&self, target: &Self) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let double = |p: glam::Vec3| Vector3::from(p.as_dvec3().to_array());
        let matches = mutual_matches(&self.index, &target.index, 5000);
        let pair = |m: &scanstitch::registration::global::matching::Match| {
            (double(self.points[m.source as usize]), double(target.points[m.target as usize]))
        };
        matches.iter().map(pair).collect()
    }
}

struct Input<'a> {
    lone: &'a PairRegistration,
    frame: &'a PreparedSurfels,
    source: &'a Described,
    target: &'a Described,
    pairs: &'a [(Vector3<f64>, Vector3<f64>)],
    voxel_size: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Method {
    Ransac,
    Consistency,
    Gnc,
    LargestClique,
    MaximalCliques,
    Views,
    AllAround,
}

const METHODS: [Method; 7] = [
    Method::Ransac,
    Method::Consistency,
    Method::Gnc,
    Method::LargestClique,
    Method::MaximalCliques,
    Method::Views,
    Method::AllAround,
];

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::Ransac => "FPFH + RANSAC",
            Self::Consistency => "FPFH + consistency graph",
            Self::Gnc => "FPFH + GNC-TLS",
            Self::LargestClique => "FPFH + largest clique + GNC-TLS",
            Self::MaximalCliques => "FPFH + maximal cliques",
            Self::Views => "yaw and translation by views",
            Self::AllAround => "all around, as for lost frames",
        }
    }

    fn uses_matches(self) -> bool {
        !matches!(self, Self::Views | Self::AllAround)
    }

    /// The motion, and whether the method itself accepts it.
    fn register(self, input: &Input<'_>) -> Option<(Pose3, bool)> {
        let max_distance = 1.5 * input.voxel_size;
        let pairs = input.pairs;
        let sure = |inliers: usize| inliers >= 30 || inliers >= 12 && inliers as f64 >= 0.4 * pairs.len() as f64;
        let counted = |T: Pose3| {
            let inliers = cliques::num_inliers(&T, pairs, max_distance);
            (T, sure(inliers))
        };
        match self {
            Self::Ransac => {
                let options =
                    RansacOptions { max_correspondence_distance: max_distance, seed: 1, ..RansacOptions::default() };
                let found = ransac(pairs, &input.source.points, (&input.target.points, &input.target.tree), &options)?;
                Some(counted(found.T_target_source))
            }
            Self::Consistency => consistent_motion(pairs, max_distance).map(|found| counted(found.T_target_source)),
            Self::Gnc => gnc::graduated_motion(pairs, max_distance).map(counted),
            Self::LargestClique => {
                let clique = cliques::largest_clique(pairs, max_distance);
                gnc::graduated_motion(&clique, max_distance).map(counted)
            }
            Self::MaximalCliques => cliques::maximal_clique_motion(pairs, max_distance).map(|(T, _)| counted(T)),
            Self::Views => {
                let found = input.lone.register(input.frame, Search::Anywhere, DepthOptions::default());
                Some((found.T_world_sensor, found.assessment.status == Status::Good))
            }
            Self::AllAround => {
                let found = input.lone.register(input.frame, Search::AllAround, DepthOptions::default());
                Some((found.T_world_sensor, found.assessment.status == Status::Good))
            }
        }
    }
}

#[derive(Debug, Clone, Default)]
struct Tally {
    count: usize,
    /// Within 0.2 m and 10 degrees.
    found: usize,
    /// After the local registration within 0.05 m and 3 degrees.
    refined: usize,
    /// Accepted by the method itself, but wrong.
    wrong: usize,
    /// Good after the local registration, but wrong.
    still_wrong: usize,
    /// Processor time of the method.
    seconds: f64,
}

impl Tally {
    fn add(&mut self, input: &Input<'_>, found: Option<(Pose3, bool)>, truth: &Pose3, seconds: f64) -> String {
        self.count += 1;
        self.seconds += seconds;
        let Some((T, is_sure)) = found else { return "nothing".into() };
        let error = |T: &Pose3| {
            let off = truth.inverse() * T;
            (off.translation.vector.norm(), off.rotation.angle().to_degrees())
        };
        let is_within = |(moved, turned): (f64, f64), (metres, degrees)| moved < metres && turned < degrees;
        let found = error(&T);
        self.found += usize::from(is_within(found, (0.2, 10.0)));
        self.wrong += usize::from(is_sure && !is_within(found, (0.2, 10.0)));
        let estimate = input.lone.register(input.frame, Search::From(T), DepthOptions::default());
        let refined = error(&estimate.T_world_sensor);
        let is_good = estimate.assessment.status == Status::Good;
        self.refined += usize::from(is_within(refined, (0.05, 3.0)));
        self.still_wrong += usize::from(is_good && !is_within(refined, (0.2, 10.0)));
        let way = (truth.translation.vector.norm(), truth.rotation.angle().to_degrees());
        format!(
            "way {way:.2?} found {found:.2?} sure {is_sure} refined {refined:.3?} {:?} agreement {:.3} overlap {:.2}",
            estimate.assessment.status, estimate.assessment.agreement, estimate.overlap
        )
    }

    /// Times are means: a processor's time may be counted in ticks of milliseconds.
    fn cells(&self) -> String {
        let percent = |count: usize| 100.0 * count as f64 / self.count.max(1) as f64;
        format!(
            "{:.0} % | {:.0} % | {} ({}) | {:.1} ms",
            percent(self.found),
            percent(self.refined),
            self.wrong,
            self.still_wrong,
            1e3 * self.seconds / self.count.max(1) as f64
        )
    }
}
