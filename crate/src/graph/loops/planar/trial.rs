//! The record of a search for loops: which submaps were compared, and what came of each comparison.

use super::LoopClosure;
use super::matching::{Pair, SubmapMatch};
use crate::geometry::Pose2;
use crate::odometry::planar::RIVAL_SHARE;
use crate::odometry::planar::assess::MIN_OVERLAP;
use crate::registration::correlative::SearchWindow;

/// A match needs this share of agreeing returns. With 0.8, the fifth campus has 5 stretches falsely good (2), and the corridor 10 wrong (9).
const MIN_AGREEMENT: f64 = 0.85;

/// What came of comparing two submaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrialOutcome {
    /// No pose of the window scores enough.
    NotFound,
    /// Too few of the returns that both see agree.
    Disagrees,
    /// Too few of the source's returns have a partner.
    FitsLittle,
    /// Another place of the window scores nearly as well.
    HasRival,
    /// A match, which becomes a loop where the others agree with it.
    Matched,
}

/// A comparison of two submaps.
#[derive(Debug, Clone, Copy)]
pub struct LoopTrial {
    /// The round of the search, from 1.
    pub round: usize,
    /// The node in whose frame the submap looked in is.
    pub target: usize,
    /// The node in whose frame the submap looked for is.
    pub source: usize,
    /// Where the source was looked for in the target.
    pub guess: Pose2,
    /// How far off it was looked for.
    pub window: SearchWindow,
    /// Where it was found.
    pub found: Option<Pose2>,
    /// What came of it.
    pub outcome: TrialOutcome,
}

/// All comparisons, and the loops that stayed.
#[derive(Debug, Clone, Default)]
pub struct LoopTrials {
    /// In their order.
    pub trials: Vec<LoopTrial>,
    /// The nodes of each loop: target and source.
    pub loops: Vec<(usize, usize)>,
    /// The nodes in whose frames the submaps are.
    pub anchors: Vec<usize>,
    /// For each round the pairs that may show one place, those that are the likeliest for a submap, and those that the search
    /// could afford.
    pub rounds: Vec<[usize; 3]>,
}

impl TrialOutcome {
    /// Why there is no match, in words.
    pub(super) fn figure(self, found: Option<&SubmapMatch>) -> String {
        let Some(found) = found else { return "no pose near there fits".to_owned() };
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        match self {
            Self::NotFound | Self::Matched => String::new(),
            Self::Disagrees => {
                format!(
                    "{} of the returns seen from both places agree, not {}",
                    percent(found.agreement),
                    percent(MIN_AGREEMENT)
                )
            }
            Self::FitsLittle => {
                format!("{} of the returns have a partner, not {}", percent(found.fitness), percent(MIN_OVERLAP))
            }
            Self::HasRival => "they fit nearly as well at another pose near there".to_owned(),
        }
    }

    /// By what was found, in the order of what speaks against a match.
    pub(super) fn of(found: Option<&SubmapMatch>) -> Self {
        let Some(found) = found else { return Self::NotFound };
        if found.agreement <= MIN_AGREEMENT {
            Self::Disagrees
        } else if found.fitness <= MIN_OVERLAP {
            Self::FitsLittle
        } else if found.rival >= RIVAL_SHARE {
            Self::HasRival
        } else {
            Self::Matched
        }
    }
}

impl LoopClosure {
    /// Notes a comparison of two submaps.
    pub(super) fn note_trial(&mut self, pair: &Pair, found: Option<&SubmapMatch>, outcome: TrialOutcome) {
        self.trials.trials.push(LoopTrial {
            round: self.round,
            target: self.submaps[pair.target].anchor,
            source: self.submaps[pair.source].anchor,
            guess: pair.guess,
            window: pair.window,
            found: found.map(|found| found.T_target_source),
            outcome,
        });
    }

    /// What the search compared, and the loops that stayed.
    pub fn trials(&self) -> LoopTrials {
        let anchor = |submap: usize| self.submaps[submap].anchor;
        let loops = self.loops.iter().map(|closed| (anchor(closed.candidate.target), anchor(closed.candidate.source)));
        let anchors = (0..self.submaps.len()).map(anchor).collect();
        LoopTrials { loops: loops.collect(), anchors, ..self.trials.clone() }
    }
}
