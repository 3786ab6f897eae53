//! Scores the search for loops by the corrected poses in a log: the number of pairs of submaps at one place, how many of these were
//! compared, and the outcome.

use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::pipeline::planar::{LoopTrial, LoopTrials, TrialOutcome};

use super::WRONG;
use super::damage::Input;
use crate::arguments::flag;

/// Two submaps lie at one place when their middles are this near (m, rad) ...
const ONE_PLACE: (f64, f64) = (2.5, 0.8);
/// ... and so many submaps lie between them.
const MIN_BETWEEN: usize = 3;
const OUTCOMES: [TrialOutcome; 5] = [
    TrialOutcome::NotFound,
    TrialOutcome::Disagrees,
    TrialOutcome::FitsLittle,
    TrialOutcome::HasRival,
    TrialOutcome::Matched,
];

/// Prints the rounds, the outcomes and what became of the pairs at one place.
pub fn print_table(input: &Input, all: &LoopTrials) {
    let reference = |frame: usize| input.log.scans[frame].reference;
    let truth = |from: usize, to: usize| Some(reference(from)?.inverse() * reference(to)?);
    println!(
        "    loops: {} submaps; pairs possible, likely, compared in each round: {:?}",
        all.anchors.len(),
        all.rounds
    );
    let is_right =
        |trial: &LoopTrial| trial.found.zip(truth(trial.target, trial.source)).map(|(found, t)| !is_off(&t, &found));
    for outcome in OUTCOMES {
        let of: Vec<Option<bool>> = all.trials.iter().filter(|trial| trial.outcome == outcome).map(is_right).collect();
        let count = |what: Option<bool>| of.iter().filter(|&&right| right == what).count();
        println!(
            "        {outcome:?}: {} of which right {}, wrong {}",
            of.len(),
            count(Some(true)),
            count(Some(false))
        );
    }
    let last = |pair: (usize, usize)| all.trials.iter().rfind(|t| (t.target, t.source) == pair);
    let stayed = all.loops.iter().filter_map(|&pair| is_right(last(pair)?));
    let stayed: Vec<bool> = stayed.collect();
    println!("        loops {}, wrong {}", all.loops.len(), stayed.iter().filter(|&&right| !right).count());
    let at_one_place =
        (0..all.anchors.len()).flat_map(|b: usize| (0..b.saturating_sub(MIN_BETWEEN)).map(move |a| (a, b)));
    let at_one_place = at_one_place.map(|(a, b)| (all.anchors[a], all.anchors[b])).filter(|&(a, b)| {
        truth(a, b).is_some_and(|t| t.translation_norm() < ONE_PLACE.0 && t.rotation_angle() < ONE_PLACE.1)
    });
    let pairs: Vec<(usize, usize)> = at_one_place.collect();
    let compared: Vec<&LoopTrial> = pairs.iter().filter_map(|&pair| last(pair)).collect();
    let is_outside = |trial: &&&LoopTrial| {
        truth(trial.target, trial.source).is_some_and(|t| {
            let off = trial.guess.inverse() * t;
            off.translation_norm() > 1.5 * trial.window.translation || off.rotation_angle() > trial.window.rotation
        })
    };
    println!(
        "        at one place {} pairs: compared {}, of which outside the window {}, became loops {}",
        pairs.len(),
        compared.len(),
        compared.iter().filter(is_outside).count(),
        pairs.iter().filter(|pair| all.loops.contains(pair)).count()
    );
    for outcome in OUTCOMES {
        let of: Vec<&&LoopTrial> = compared.iter().filter(|trial| trial.outcome == outcome).collect();
        let right = of.iter().filter(|trial| is_right(trial) == Some(true)).count();
        println!("            {outcome:?}: {} ({right} at the right place)", of.len());
    }
    if flag("--trials") {
        for trial in &all.trials {
            print_trial(trial, truth(trial.target, trial.source), all.loops.contains(&(trial.target, trial.source)));
        }
    }
}

fn is_off(truth: &Pose2, found: &Pose2) -> bool {
    let off = truth.inverse() * found;
    off.translation_norm() > WRONG.0 || off.rotation_angle() > WRONG.1.to_radians()
}

fn print_trial(trial: &LoopTrial, truth: Option<Pose2>, is_loop: bool) {
    let off = |pose: &Pose2| {
        truth.map_or("unknown".to_owned(), |truth| {
            let off = truth.inverse() * pose;
            format!("{:.2} m {:.1} deg", off.translation_norm(), off.rotation_angle().to_degrees())
        })
    };
    println!(
        "        round {} {} -> {} window {:.2} m {:.2} rad, guess off {}, found off {}, {:?}{}",
        trial.round,
        trial.target,
        trial.source,
        trial.window.translation,
        trial.window.rotation,
        off(&trial.guess),
        trial.found.as_ref().map_or("-".to_owned(), off),
        trial.outcome,
        if is_loop { ", loop" } else { "" }
    );
}
