//! Times the benchmarks natively.
//!
//! `scanstitch-bench list` prints one benchmark a line: name, what it does, separated by a tab.
//! `scanstitch-bench NAME WARM_UP_MS SAMPLE_MS SAMPLES [FILE]...` prints two lines: the work of one run (amount and
//! unit, or `- -`), and the duration of one run in each sample, in nanoseconds.

use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{env, fs};

use scanstitch_bench::{Prepared, benchmarks};

fn main() -> ExitCode {
    let args: Vec<String> = env::args().skip(1).collect();
    let outcome = match args.as_slice() {
        [list] if list == "list" => {
            for benchmark in benchmarks() {
                println!("{}\t{}", benchmark.name, benchmark.about);
            }
            Ok(())
        }
        [name, warm_up, sample, samples, files @ ..] => time(name, [warm_up, sample, samples], files),
        _ => Err("usage: scanstitch-bench list | NAME WARM_UP_MS SAMPLE_MS SAMPLES [FILE]...".into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}

fn time(name: &str, policy: [&String; 3], files: &[String]) -> Result<(), String> {
    let number = |text: &String| text.parse::<u32>().map_err(|error| format!("{text:?}: {error}"));
    let (warm_up, sample, samples) = (number(policy[0])?, number(policy[1])?, number(policy[2])?);
    let benchmark =
        benchmarks().find(|benchmark| benchmark.name == name).ok_or(format!("no benchmark is called {name:?}"))?;
    let files = files
        .iter()
        .map(|path| fs::read(path).map(|bytes| (path.clone(), bytes)).map_err(|error| format!("{path}: {error}")))
        .collect::<Result<Vec<_>, _>>()?;
    let mut prepared = (benchmark.prepare)(files)?;

    let runs =
        runs_per_sample(&mut prepared, Duration::from_millis(warm_up.into()), Duration::from_millis(sample.into()));
    let nanoseconds: Vec<String> = (0..samples)
        .map(|_| {
            let start = Instant::now();
            for _ in 0..runs {
                (prepared.run)();
            }
            format!("{:.1}", start.elapsed().as_secs_f64() * 1e9 / f64::from(runs))
        })
        .collect();
    println!("{}", prepared.work_text());
    println!("{}", nanoseconds.join(" "));
    Ok(())
}

/// Runs for at least `warm_up` and returns how many runs last about as long as `sample`.
fn runs_per_sample(prepared: &mut Prepared, warm_up: Duration, sample: Duration) -> u32 {
    let start = Instant::now();
    let mut runs = 0_u32;
    while runs == 0 || start.elapsed() < warm_up {
        (prepared.run)();
        runs += 1;
    }
    let one_run = start.elapsed().as_secs_f64() / f64::from(runs);
    (sample.as_secs_f64() / one_run).ceil().clamp(1.0, 1e6) as u32
}
