//! Scores the depth engine on all recordings at once, real and generated: `cargo run --release --example depth_scores --
//! [--only 'WORDS|WORDS'] [--first SEED] [--seeds N] [--frames N] [--cache FOLDER] [--runs] [--each] [--quick] [--planar] [--joint]
//! [--threads N]`. One row a kind of recording, as a Markdown table.

#[path = "depth/recordings.rs"]
mod recordings;
#[path = "depth/scores.rs"]
mod scores;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use recordings::{Choice, Recording, Walk};
use scanstitch::depth_odometry::Effort;
use scanstitch::registration::solver::Motion;
use scanstitch::scene::apartment::Tour;
use scanstitch::spatial_settings::{ColorUse, Refinement, SpatialSettings};
use scores::{Score, score};

/// A recording that is made when it is its turn.
struct Run {
    group: String,
    make: Box<dyn Fn() -> Recording + Send + Sync>,
}

fn main() {
    let argument = |name: &str| std::env::args().skip_while(|argument| argument != name).nth(1);
    let number = |name: &str, default: usize| argument(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let flag = |name: &str| std::env::args().any(|argument| argument == name);
    let settings = SpatialSettings {
        effort: if flag("--quick") { Effort::Quick } else { Effort::Thorough },
        motion: if flag("--planar") { Motion::Planar } else { Motion::Free },
        refinement: if flag("--joint") { Refinement::Joint } else { Refinement::None },
        color: match argument("--color").as_deref() {
            Some("not_used") => ColorUse::NotUsed,
            Some("where_open") => ColorUse::WhereOpen,
            _ => ColorUse::Used,
        },
        ..SpatialSettings::default()
    };
    let cache = argument("--cache").map(PathBuf::from);
    let first = number("--first", 1) as u64;
    let mut runs = real_runs();
    for seed in first..first + number("--seeds", 10) as u64 {
        runs.extend(generated_runs(seed, number("--frames", 100), cache.as_deref(), flag("--images")));
    }
    let only = argument("--only").unwrap_or_default();
    runs.retain(|run| only.split('|').any(|words| run.group.contains(words)));

    let (next, scored) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..number("--threads", 2) {
            scope.spawn(|| {
                while let Some(run) = runs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let recording = (run.make)();
                    if recording.truth.len() < 2 {
                        continue;
                    }
                    let score = score(&recording, &settings, flag("--each"));
                    if flag("--runs") {
                        println!("{} {}: {}", run.group, recording.name, line(&score));
                    }
                    scored.lock().unwrap().push((run.group.clone(), score));
                }
            });
        }
    });
    table(&runs, &scored.into_inner().unwrap());
}

fn real_runs() -> Vec<Run> {
    if !Path::new(recordings::DATA).is_dir() {
        eprintln!("skipped: ../shared/data is absent");
        return Vec::new();
    }
    let mut runs: Vec<Run> = Vec::new();
    let mut add = |group: &str, make: Box<dyn Fn() -> Recording + Send + Sync>| {
        runs.push(Run { group: group.to_owned(), make });
    };
    for which in ["first", "second"] {
        add(&format!("{which} floor"), Box::new(move || recordings::floor(which)));
        for stride in [2, 3, 4] {
            let make = move || Choice::Every(stride).apply(&recordings::floor(which));
            add(&format!("{which} floor, one of {stride}"), Box::new(make));
        }
        for seed in 1..=5 {
            let make = move || Choice::TwoThirds(seed).apply(&recordings::floor(which));
            add(&format!("{which} floor, random two thirds"), Box::new(make));
        }
        let make = move || Choice::ToAndFro(3).apply(&recordings::floor(which));
        add(&format!("{which} floor, to and fro 3x"), Box::new(make));
    }
    add("fusion_demo50", Box::new(recordings::fusion_demo));
    add("redwood5", Box::new(recordings::redwood));
    runs
}

fn generated_runs(seed: u64, frames: usize, cache: Option<&Path>, has_color: bool) -> Vec<Run> {
    let walk = |tour, step, turn, bits, noise| Walk { tour, step, turn, bits, noise, frames, has_color };
    let kinds = [
        ("flats, 8 bit, 0.25 m, 10 deg", walk(Tour::AllRooms, 0.25, 10.0, 8, 0.0)),
        ("flats, 8 bit, 0.5 m, 20 deg", walk(Tour::AllRooms, 0.5, 20.0, 8, 0.0)),
        ("flats, 16 bit, 0.25 m, 10 deg", walk(Tour::AllRooms, 0.25, 10.0, 16, 0.0)),
        ("flats, 16 bit, 0.5 m, 20 deg", walk(Tour::AllRooms, 0.5, 20.0, 16, 0.0)),
        ("flats, 16 bit noisy, 0.25 m, 10 deg", walk(Tour::AllRooms, 0.25, 10.0, 16, 2e-3)),
        ("loops, 8 bit, 0.25 m, 10 deg", Walk { frames: 1000, ..walk(Tour::Pier, 0.25, 10.0, 8, 0.0) }),
    ];
    let run = |(group, walk): (&str, Walk)| {
        let cache = cache.map(Path::to_owned);
        Run { group: group.to_owned(), make: Box::new(move || walk.recording(seed, cache.as_deref())) }
    };
    kinds.map(run).into()
}

fn line(score: &Score) -> String {
    let Score { frames, mean, last, wrong, flagged, doubtful, lost, gap, milliseconds } = score;
    format!(
        "{frames} frames, mean {:.1} mm, last {:.1} mm, {wrong} wrong, {flagged} flagged, {doubtful} doubtful, {lost} lost, \
         gap {:.1} mm, {milliseconds:.1} ms a frame",
        1000.0 * mean,
        1000.0 * last,
        1000.0 * gap
    )
}

fn table(runs: &[Run], scored: &[(String, Score)]) {
    println!(
        "| recording | runs | frames | median of the means | worst mean | worst last | believed wrong steps | right but \
         doubted | doubtful | lost | ms a frame |\n|---|---|---|---|---|---|---|---|---|---|---|"
    );
    let mut groups: Vec<&str> = Vec::new();
    for run in runs {
        if !groups.contains(&run.group.as_str()) {
            groups.push(&run.group);
        }
    }
    for group in groups {
        let of: Vec<&Score> = scored.iter().filter(|(name, _)| name == group).map(|(_, score)| score).collect();
        if of.is_empty() {
            continue;
        }
        let mut means: Vec<f64> = of.iter().map(|score| score.mean).collect();
        means.sort_by(f64::total_cmp);
        let worst_last = of.iter().map(|score| score.last).fold(0.0, f64::max);
        let sum = |count: fn(&Score) -> usize| of.iter().map(|score| count(score)).sum::<usize>();
        println!(
            "| {group} | {} | {} | {:.1} mm | {:.1} mm | {:.1} mm | {} | {} | {} | {} | {:.1} |",
            of.len(),
            sum(|score| score.frames),
            1000.0 * means[means.len() / 2],
            1000.0 * means[means.len() - 1],
            1000.0 * worst_last,
            sum(|score| score.wrong),
            sum(|score| score.flagged),
            sum(|score| score.doubtful),
            sum(|score| score.lost),
            of.iter().map(|score| score.milliseconds).sum::<f64>() / of.len() as f64
        );
    }
}
