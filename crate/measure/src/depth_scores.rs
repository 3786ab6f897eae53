//! Scores the depth engine on all recordings at once, real and generated: `cargo measure depth_scores
//! [--only 'WORDS|WORDS'] [--first SEED] [--seeds N] [--frames N] [--cache FOLDER] [--runs] [--each] [--quick] [--planar]
//! [--open] [--color used|where_open|not_used] [--images] [--pictures FOLDER] [--lines FOLDER] [--threads N] [--ablations
//! [--variants 'NAME|NAME'] | --per-seed]`.
//! Prints a Markdown table with one row for each kind of recording; with `--ablations` a column for each part of the engine that
//! is left out; with `--per-seed` a row for each generated world. `--images` renders colour images of flats as well; `--lines`
//! writes one line per frame with all digits, to compare runs before and after a change. A word after an equals sign matches a
//! whole kind of recording.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use scanstitch::odometry::depth::Effort;
use scanstitch::pipeline::spatial_settings::{ColorUse, LoopClosing, SpatialSettings};
use scanstitch::registration::solver::Motion;
use scanstitch_scene::apartment::Tour;

use crate::arguments::{argument, flag};
use crate::depth::disturbances::Disturbance;
use crate::depth::recordings::{self, Choice, Recording, Walk, Way};
use crate::depth::scores::{self, score};
use crate::depth::tables::{self, Scored};
use crate::depth::{ablations, picture};

/// Number of frames of a recording to which disturbances are applied.
const DISTURBED_FRAMES: usize = 50;

/// A recording that is generated when it is its turn.
struct Run {
    group: String,
    make: Box<dyn Fn() -> Recording + Send + Sync>,
}

pub fn main() {
    let number = |name: &str, default: usize| argument(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let settings = SpatialSettings {
        effort: if flag("--quick") { Effort::Quick } else { Effort::Thorough },
        motion: if flag("--planar") { Motion::Planar } else { Motion::Free },
        loop_closing: if flag("--open") { LoopClosing::Off } else { LoopClosing::On },
        color: match argument("--color").as_deref() {
            Some("not_used") => ColorUse::NotUsed,
            Some("where_open") => ColorUse::WhereDegenerate,
            _ => ColorUse::Used,
        },
        ..SpatialSettings::default()
    };
    let mut variants =
        if flag("--ablations") { ablations::ablations(&settings) } else { ablations::unchanged(&settings) };
    if let Some(names) = argument("--variants") {
        variants.retain(|variant| names.split('|').any(|name| name == variant.name));
    }
    let cache = argument("--cache").map(PathBuf::from);
    let pictures = argument("--pictures").map(PathBuf::from);
    let lines = argument("--lines").map(PathBuf::from);
    let first = number("--first", 1) as u64;
    let mut runs = if flag("--per-seed") { Vec::new() } else { real_runs() };
    for seed in first..first + number("--seeds", 10) as u64 {
        runs.extend(generated_runs(seed, number("--frames", 100), cache.as_deref(), flag("--images")));
    }
    let only = argument("--only").unwrap_or_default();
    let is_meant = |group: &str, words: &str| words.strip_prefix('=').map_or(group.contains(words), |all| group == all);
    runs.retain(|run| only.split('|').any(|words| is_meant(&run.group, words)));

    let (next, scored) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..number("--threads", 2) {
            scope.spawn(|| {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let Some(run) = runs.get(place) else { break };
                    let recording = (run.make)();
                    if recording.truth.len() < 2 {
                        continue;
                    }
                    for variant in &variants {
                        let (score, mut reconstruction) = score(&recording, &variant.settings, flag("--each"));
                        if let Some(folder) = &pictures {
                            let name = format!("{}, {}.png", run.group, recording.name).replace('%', "percent");
                            picture::draw(&reconstruction.map().cloud().positions, &folder.join(name));
                        }
                        if let Some(folder) = &lines {
                            let name = format!("{}, {}, {}.txt", run.group, recording.name, variant.name);
                            let file = folder.join(name.replace('%', "percent").replace('/', " "));
                            std::fs::write(file, scores::lines(&reconstruction)).expect("a folder for the lines");
                        }
                        if flag("--runs") {
                            println!("{} {}, {}: {}", run.group, recording.name, variant.name, tables::line(&score));
                        }
                        let (group, name) = (run.group.clone(), recording.name.clone());
                        let run = Scored { group, name, variant: variant.name, score };
                        scored.lock().unwrap().push((place, run));
                    }
                }
            });
        }
    });
    let mut scored = scored.into_inner().unwrap();
    scored.sort_by_key(|(place, _)| *place);
    let scored: Vec<Scored> = scored.into_iter().map(|(_, run)| run).collect();
    let table = if flag("--ablations") {
        tables::by_variant(&scored)
    } else if flag("--per-seed") {
        tables::by_recording(&scored)
    } else {
        tables::by_kind(&scored)
    };
    print!("{table}");
}

/// Every second frame of a floor.
fn thinned(which: &'static str) -> Recording {
    Choice::Every(2).apply(&recordings::floor(which)).first(DISTURBED_FRAMES)
}

fn real_runs() -> Vec<Run> {
    if !recordings::are_there() {
        return Vec::new();
    }
    let mut runs: Vec<Run> = Vec::new();
    let mut add = |group: &str, make: Box<dyn Fn() -> Recording + Send + Sync>| {
        runs.push(Run { group: group.to_owned(), make });
    };
    for which in ["first", "second"] {
        add(&format!("{which} floor"), Box::new(move || recordings::floor(which)));
        for stride in 2..=6 {
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
    for (name, disturbance) in Disturbance::ALL {
        for (which, other) in [("first", "second"), ("second", "first")] {
            let make = move || disturbance.apply(&thinned(which), &thinned(other));
            add(&format!("disturbed floors: {name}"), Box::new(make));
        }
    }
    add("fusion_demo50", Box::new(recordings::fusion_demo));
    add("redwood5", Box::new(recordings::redwood));
    runs
}

fn generated_runs(seed: u64, frames: usize, cache: Option<&Path>, has_color: bool) -> Vec<Run> {
    let flat = |step, turn, bits, noise| Walk {
        way: Way::Flat(Tour::AllRooms),
        step,
        turn,
        bits,
        noise,
        frames,
        focal: 1.0,
        has_color,
    };
    let pier = |step, turn, bits| Walk { way: Way::Flat(Tour::Pier), frames: 1000, ..flat(step, turn, bits, 0.0) };
    let ring = |step, turn, bits, noise, focal| Walk {
        way: Way::Ring(4.0),
        frames: 1000,
        focal,
        ..flat(step, turn, bits, noise)
    };
    let kinds = [
        ("flats, 8 bit, 0.25 m, 10 deg", flat(0.25, 10.0, 8, 0.0)),
        ("flats, 8 bit, 0.5 m, 20 deg", flat(0.5, 20.0, 8, 0.0)),
        ("flats, 16 bit, 0.25 m, 10 deg", flat(0.25, 10.0, 16, 0.0)),
        ("flats, 16 bit, 0.5 m, 20 deg", flat(0.5, 20.0, 16, 0.0)),
        ("flats, 16 bit noisy, 0.25 m, 10 deg", flat(0.25, 10.0, 16, 2e-3)),
        ("loops, 8 bit, 0.25 m, 10 deg", pier(0.25, 10.0, 8)),
        ("loops, 8 bit, 0.5 m, 20 deg", pier(0.5, 20.0, 8)),
        ("loops, 16 bit, 0.25 m, 10 deg", pier(0.25, 10.0, 16)),
        ("loops, 16 bit, 0.5 m, 20 deg", pier(0.5, 20.0, 16)),
        ("rings, 8 bit, 0.25 m, 10 deg", ring(0.25, 10.0, 8, 0.0, 1.0)),
        ("rings, 8 bit, 0.5 m, 15 deg", ring(0.5, 15.0, 8, 0.0, 1.0)),
        ("rings, 16 bit noisy, 0.25 m, 10 deg", ring(0.25, 10.0, 16, 2e-3, 1.0)),
        ("rings, 16 bit noisy, 0.25 m, 10 deg, focal length 3 % off", ring(0.25, 10.0, 16, 2e-3, 1.03)),
        ("rings, 16 bit noisy, 0.25 m, 10 deg, focal length 6 % off", ring(0.25, 10.0, 16, 2e-3, 1.06)),
        ("rings, 8 bit, 0.25 m, 10 deg, focal length 5 % short", ring(0.25, 10.0, 8, 0.0, 0.95)),
        (
            "flats, 16 bit noisy, 0.25 m, 10 deg, focal length 5 % off",
            Walk { focal: 1.05, ..flat(0.25, 10.0, 16, 2e-3) },
        ),
    ];
    let run = |(group, walk): (&str, Walk)| {
        let cache = cache.map(Path::to_owned);
        Run { group: group.to_owned(), make: Box::new(move || walk.recording(seed, cache.as_deref())) }
    };
    let mut runs: Vec<Run> = kinds.map(run).into();
    let folder = cache.map(Path::to_owned);
    runs.push(Run {
        group: "flats, 8 bit, 0.5 m, 20 deg, random two thirds".into(),
        make: Box::new(move || Choice::TwoThirds(seed).apply(&kinds[1].1.recording(seed, folder.as_deref()))),
    });
    for (name, disturbance) in Disturbance::ALL {
        for (step, walk) in [("0.25 m", kinds[0].1), ("0.5 m", kinds[1].1)] {
            let folder = cache.map(Path::to_owned);
            let make = move || {
                let recording = |seed| walk.recording(seed, folder.as_deref()).first(DISTURBED_FRAMES);
                // Seeds in fives: the strangers of a set of seeds are of the same set.
                let other = if seed.is_multiple_of(5) { seed - 4 } else { seed + 1 };
                disturbance.apply(&recording(seed), &recording(other))
            };
            runs.push(Run { group: format!("disturbed, {step}: {name}"), make: Box::new(make) });
        }
    }
    runs
}
