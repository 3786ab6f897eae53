//! Finds the poses of an estimate that relations refer to, and the reason where most relations refer to none.

use std::collections::HashMap;

use super::interpolate::{MAX_INTERVALS, Place, between, interval};
use super::motion_ratio::MAX_SAMPLES;
use super::path::Path;
use crate::geometry::quantile::quantile;
use crate::io::relations::{PoseKey, Relation};
use crate::search::order::ascending;
use crate::{Error, Result};

/// Upper bound of [`time_tolerance`] (s), the tolerance of Kuemmerle's `metricEvaluator`.
const MAX_TOLERANCE: f64 = 0.1;
/// Times that differ by less (s) are the same: files round to microseconds.
const SAME_TIME: f64 = 1e-5;
/// Resolution of the search for a clock offset (s), which exceeds the rounding of times in files.
const CLOCK_STEP: f64 = 1e-3;
/// Smallest share of the votes for which an offset is reported.
const MIN_AGREEING_SHARE: f64 = 0.8;

/// Largest difference (s) between the time of a relation and that of its pose, for poses at these times: half of their median
/// interval, beyond which another pose is nearer, but at most 0.1 s.
pub fn time_tolerance(stamps: &[f64]) -> f64 {
    let mut sorted = stamps.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|&step| step > 0.0).collect();
    quantile(&mut steps, 0.5).map_or(MAX_TOLERANCE, |median| (0.5 * median).min(MAX_TOLERANCE))
}

/// The poses of an estimate by index and by time.
pub(super) struct PoseLookup<'a> {
    num_poses: usize,
    stamps: Option<&'a [f64]>,
    /// Indices of the poses in the order of their times.
    order: Vec<usize>,
    max_diff: f64,
    /// Of the times, the median (s).
    interval: f64,
}

impl<'a> PoseLookup<'a> {
    pub(super) fn new(estimate: &'a Path, max_diff: f64) -> Self {
        let stamps = estimate.stamps.as_deref();
        let order = stamps.map_or_else(|| (0..estimate.len()).collect(), |stamps| ascending(stamps.iter().copied()));
        let interval = stamps.and_then(interval).unwrap_or(0.0);
        Self { num_poses: estimate.len(), stamps, order, max_diff, interval }
    }

    /// Refuses relations by time where the estimate has no times, or has pose numbers in their place, some of which would match
    /// a time by chance.
    pub(super) fn check(&self, relations: &[Relation]) -> Result<()> {
        let mut times = relations.iter().filter_map(Relation::times).flatten();
        let Some(first) = times.next() else { return Ok(()) };
        let remedy = "Reconstruct the log anew, for its trajectory carries the log's times, or give the times of the poses \
                      in a file of their own";
        let Some(stamps) = self.stamps else {
            let problem = format!("The relations name times (the first is {first} s), and the estimate has none");
            return Err(Error::whole(problem, remedy));
        };
        let is_counted = stamps.iter().enumerate().all(|(index, &stamp)| stamp == index as f64);
        if is_counted && (first.fract() != 0.0 || times.any(|time| time.fract() != 0.0)) {
            let problem = format!(
                "The relations name times (the first is {first} s), and the estimate counts its poses: 0, 1, 2"
            );
            return Err(Error::whole(problem, remedy));
        }
        Ok(())
    }

    /// The pose that a relation refers to; at a time between two poses the interpolated one, for the robot moves meanwhile.
    pub(super) fn find(&self, key: PoseKey) -> Option<Place> {
        match key {
            PoseKey::Index(index) => (index < self.num_poses).then(|| Place::of(index)),
            PoseKey::Time(time) => {
                let stamps = self.stamps?;
                let after = self.order.partition_point(|&index| stamps[index] < time);
                let candidates = self.order[after.saturating_sub(1)..].iter().take(2);
                let off = |index: usize| (stamps[index] - time).abs();
                let nearest = candidates.copied().min_by(|&a, &b| off(a).total_cmp(&off(b)))?;
                let between = || between(stamps, &self.order, time, MAX_INTERVALS * self.interval);
                let is_same = off(nearest) < SAME_TIME;
                (off(nearest) <= self.max_diff)
                    .then(|| if is_same { None } else { between() }.unwrap_or_else(|| Place::of(nearest)))
            }
        }
    }
}

/// The reason why fewer than half of the relations name poses of the estimate, and the remedy.
pub(super) fn misfit(
    relations: &[Relation],
    estimate: &Path,
    max_diff: f64,
    num_compared: usize,
) -> Option<(String, String)> {
    if 2 * num_compared >= relations.len() {
        return None;
    }
    let has = if num_compared == 0 { "the poses of none".to_owned() } else { format!("both poses of {num_compared}") };
    let times: Vec<f64> = relations.iter().filter_map(Relation::times).flatten().collect();
    let stamps = estimate.stamps.as_deref().unwrap_or_default();
    if times.is_empty() || stamps.is_empty() {
        let index = |key| if let PoseKey::Index(index) = key { index } else { 0 };
        let largest = relations.iter().map(|relation| index(relation.from).max(index(relation.to))).max()?;
        let problem = format!(
            "The estimate has {has} of the {} relations: they count poses up to {largest}, and the estimate has {}",
            relations.len(),
            estimate.len()
        );
        return Some((problem, "Give the relations of this recording, and a pose for each of its scans".to_owned()));
    }
    let span =
        |values: &[f64]| values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &t| (l.min(t), h.max(t)));
    let ((first, last), (from, to)) = (span(&times), span(stamps));
    let problem = format!(
        "The estimate has {has} of the {} relations within {max_diff:.3} s: their times span {first:.3} to {last:.3} s, the \
         estimate's {from:.3} to {to:.3} s",
        relations.len()
    );
    let remedy = match clock_offset(&times, stamps) {
        Some(offset) => format!("Another clock timed them: an offset of {offset:.3} s would make them meet"),
        None => "Give the relations of this recording; what other relations say of it is chance".to_owned(),
    };
    Some((problem, remedy))
}

/// The offset (s) to add to `stamps` so that most of `times` are among them; `None` where there is no such offset.
fn clock_offset(times: &[f64], stamps: &[f64]) -> Option<f64> {
    let stride = times.len().div_ceil(MAX_SAMPLES);
    let voters: Vec<f64> = times.iter().copied().step_by(stride).collect();
    let mut votes: HashMap<i64, usize> = HashMap::new();
    for time in &voters {
        for stamp in stamps {
            *votes.entry(((time - stamp) / CLOCK_STEP).round() as i64).or_default() += 1;
        }
    }
    // The votes for an offset between two steps are in both.
    let total = |step: i64| (step - 1..=step + 1).filter_map(|step| votes.get(&step)).sum::<usize>();
    let best = votes.keys().copied().max_by_key(|&step| (total(step), votes[&step], -step.abs()))?;
    (total(best) as f64 >= MIN_AGREEING_SHARE * voters.len() as f64).then_some(best as f64 * CLOCK_STEP)
}
