//! Association: finds the pose of the reference that corresponds to each pose of the estimate, by time, index or number.

use crate::io::trajectory::Trajectory;
use crate::search::order::ascending;
use crate::{Error, Result};

/// Indices of corresponding poses of the reference and the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    /// Index in the reference.
    pub reference: usize,
    /// Index in the estimate.
    pub estimate: usize,
}

/// Largest difference between the time of a frame and that of its pose (s): half the interval of a camera of 30 frames a second,
/// and some delay.
pub(crate) const MAX_TIME_DIFFERENCE: f64 = 0.02;

/// Pairs by time, as in evo's `associate_trajectories`: for each stamp of the trajectory with fewer poses (of the estimate
/// where the numbers are equal), in its order, the nearest stamp of the other, if it is within `max_diff` (s). Of two equally
/// near stamps the earlier is used. `offset` (s) is added to the estimate's times.
///
/// A pose of the longer trajectory may thus correspond to several poses of the shorter one.
///
/// # Errors
/// When no stamps match; the error gives both time spans and, where one is found, the unit or offset by which they overlap. When
/// all stamps of one are the same.
pub fn by_time(reference: &[f64], estimate: &[f64], max_diff: f64, offset: f64) -> Result<Vec<Pair>> {
    for (whose, stamps) in [("reference", reference), ("estimate", estimate)] {
        if stamps.len() > 1 && stamps.iter().all(|stamp| *stamp == stamps[0]) {
            return Err(Error::whole(
                format!(
                    "All times of one of them are the same, {} s in the {whose}, as numbers of too few digits are",
                    stamps[0]
                ),
                "Write them with more digits, or leave them out where both have a pose for each frame",
            ));
        }
    }
    let estimate_is_longer = estimate.len() > reference.len();
    let (short, long) = if estimate_is_longer { (reference, estimate) } else { (estimate, reference) };
    let shift = if estimate_is_longer { offset } else { -offset };
    let long: Vec<f64> = long.iter().map(|stamp| stamp + shift).collect();
    let matches =
        if long.is_sorted() { nearest_sorted(short, &long, max_diff) } else { nearest(short, &long, max_diff) };
    if matches.is_empty() {
        return Err(no_match(reference, estimate, max_diff, offset));
    }
    let pair = |(short, long)| {
        let (reference, estimate) = if estimate_is_longer { (short, long) } else { (long, short) };
        Pair { reference, estimate }
    };
    Ok(matches.into_iter().map(pair).collect())
}

/// Pairs of poses with the same index.
///
/// # Errors
/// When the numbers of poses differ.
pub fn by_index(reference: usize, estimate: usize) -> Result<Vec<Pair>> {
    if reference != estimate {
        return Err(Error::whole(
            format!(
                "The reference has {reference} poses and the estimate {estimate}, and without times only poses of the same index can be compared"
            ),
            "Give both with times, or with one pose for each frame",
        ));
    }
    Ok((0..reference).map(|index| Pair { reference: index, estimate: index }).collect())
}

/// Pairs by number, and the name of the trajectory whose "times" are pose numbers of the other one: integers from 0,
/// ascending, none beyond the other's last pose, and the last in its second half: numbers that end before count something else.
/// `None` where that holds for neither or for both.
pub fn by_number(reference: &[f64], estimate: &[f64]) -> Option<(&'static str, Vec<Pair>)> {
    let counts = |numbers: &[f64], others: usize| {
        let is_number = |&number: &f64| number >= 0.0 && number.fract() == 0.0 && number < others as f64;
        let reach = numbers.last().is_some_and(|last| 2.0 * last >= others as f64 - 1.0);
        reach && numbers.iter().all(is_number) && numbers.windows(2).all(|pair| pair[0] < pair[1])
    };
    match (counts(reference, estimate.len()), counts(estimate, reference.len())) {
        (true, false) => {
            let pair = |(index, &number): (usize, &f64)| Pair { reference: index, estimate: number as usize };
            Some(("reference", reference.iter().enumerate().map(pair).collect()))
        }
        (false, true) => {
            let pair = |(index, &number): (usize, &f64)| Pair { reference: number as usize, estimate: index };
            Some(("estimate", estimate.iter().enumerate().map(pair).collect()))
        }
        _ => None,
    }
}

/// Pairs of poses of trajectories without times and of different lengths, where one has the numbers of its poses: they count the
/// rows of the other, from 1 where the last number is the number of rows and none is 0, and from 0 otherwise. Where both have
/// numbers, equal ones correspond. With a note in a whole sentence.
///
/// # Errors
/// As [`by_index`] when neither has numbers, or a number has no row.
pub fn by_row(reference: &Trajectory, estimate: &Trajectory) -> Result<(String, Vec<Pair>)> {
    let of_rows = |whose: &str, numbers: &[f64], other: &Trajectory| {
        let first = usize::from(numbers.last() == Some(&(other.num_rows() as f64)) && !numbers.contains(&0.0));
        let row = |number: &f64| (*number as usize).checked_sub(first).filter(|row| *row < other.num_rows());
        let rows: Vec<usize> = numbers.iter().map(row).collect::<Option<_>>()?;
        let words = "numbers count the poses of the other";
        Some((format!("The {whose}'s {words} from {first}: they were matched by number."), rows))
    };
    let indices = |rows: Vec<usize>, other: &Trajectory| -> Vec<_> {
        rows.into_iter().enumerate().filter_map(|(index, row)| Some((index, other.index_of_row(row)?))).collect()
    };
    let found = match (numbers_of(reference), numbers_of(estimate)) {
        (None, Some(numbers)) => of_rows("estimate", &numbers, reference).map(|(note, rows)| {
            let pair = |(estimate, reference)| Pair { reference, estimate };
            (note, indices(rows, reference).into_iter().map(pair).collect())
        }),
        (Some(numbers), None) => of_rows("reference", &numbers, estimate).map(|(note, rows)| {
            let pair = |(reference, estimate)| Pair { reference, estimate };
            (note, indices(rows, estimate).into_iter().map(pair).collect())
        }),
        (Some(of_reference), Some(of_estimate)) => by_time(&of_reference, &of_estimate, 0.0, 0.0)
            .ok()
            .map(|pairs| ("Both number their poses: equal numbers were matched.".to_owned(), pairs)),
        (None, None) => None,
    };
    found.map_or_else(|| by_index(reference.num_rows(), estimate.num_rows()).map(|pairs| (String::new(), pairs)), Ok)
}

/// Whole numbers from 0, ascending, that a trajectory has of its poses or in the place of their times.
fn numbers_of(trajectory: &Trajectory) -> Option<Vec<f64>> {
    let numbers = trajectory.numbers.as_ref().or(trajectory.stamps.as_ref())?;
    let is_number = |number: &f64| *number >= 0.0 && number.fract() == 0.0;
    let are_numbers = numbers.iter().all(is_number) && numbers.windows(2).all(|pair| pair[0] < pair[1]);
    are_numbers.then(|| numbers.clone())
}

/// Nearest stamps by binary search in sorted stamps. Among repeated stamps the last one is used, except for a query equal to
/// the last stamps of all, for which the last but one is. evo's search does the same.
fn nearest_sorted(queries: &[f64], stamps: &[f64], max_diff: f64) -> Vec<(usize, usize)> {
    let (Some(&first), Some(&last)) = (stamps.first(), stamps.last()) else { return Vec::new() };
    let find = |&query: &f64| {
        if query < first - max_diff || query > last + max_diff {
            return None;
        }
        let after = stamps.partition_point(|&stamp| stamp <= query).min(stamps.len() - 1);
        let to_after = stamps[after] - query;
        let to_before = if after > 0 { query - stamps[after - 1] } else { f64::INFINITY };
        if to_after <= max_diff && to_after < to_before {
            Some(after)
        } else if to_before <= max_diff && to_before <= to_after {
            Some(after - 1)
        } else {
            None
        }
    };
    queries.iter().enumerate().filter_map(|(index, query)| Some((index, find(query)?))).collect()
}

/// Nearest stamps among unsorted ones; among equally near stamps the first in the file.
fn nearest(queries: &[f64], stamps: &[f64], max_diff: f64) -> Vec<(usize, usize)> {
    let order = ascending(stamps.iter().copied());
    let find = |&query: &f64| {
        let after = order.partition_point(|&index| stamps[index] < query);
        let before = after.checked_sub(1).map(|before| {
            let stamp = stamps[order[before]];
            order[order.partition_point(|&index| stamps[index] < stamp)]
        });
        let after = order.get(after).copied();
        let diff = |index: &usize| (stamps[*index] - query).abs();
        let best = before.into_iter().chain(after).min_by(|a, b| diff(a).total_cmp(&diff(b)).then(a.cmp(b)))?;
        (diff(&best) <= max_diff).then_some(best)
    };
    queries.iter().enumerate().filter_map(|(index, query)| Some((index, find(query)?))).collect()
}

/// Earliest and latest time (s).
fn span(stamps: &[f64]) -> (f64, f64) {
    stamps.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &stamp| (low.min(stamp), high.max(stamp)))
}

fn no_match(reference: &[f64], estimate: &[f64], max_diff: f64, offset: f64) -> Error {
    let (of_reference, of_estimate) = (span(reference), span(estimate));
    let shifted = if offset == 0.0 { String::new() } else { format!(" with an offset of {offset} s") };
    let problem = format!(
        "No time of the estimate is within {max_diff} s of one of the reference{shifted}: the reference spans {:.3} to \
         {:.3} s, the estimate {:.3} to {:.3} s",
        of_reference.0, of_reference.1, of_estimate.0, of_estimate.1
    );
    Error::whole(problem, guess(of_reference, of_estimate, offset))
}

/// The likely cause, in a sentence: the estimate's unit, a constant offset, or the tolerance.
fn guess((low, high): (f64, f64), (first, last): (f64, f64), offset: f64) -> String {
    let (first, last) = (first + offset, last + offset);
    let overlaps = |first: f64, last: f64| first <= high && last >= low;
    if overlaps(first, last) {
        return "The spans overlap: allow a larger time difference, or interpolate".to_owned();
    }
    let (duration, length) = (high - low, last - first);
    if !are_similar(duration, length) {
        let remedy = |whose, unit, factor| {
            format!("The {whose}'s times look like {unit}: divide them by {factor:e} to get seconds")
        };
        let units = [(1e9, "nanoseconds"), (1e6, "microseconds"), (1e3, "milliseconds")];
        // Equal durations tell more than times that overlap.
        for (factor, unit) in units {
            if are_similar(duration, length / factor) {
                return remedy("estimate", unit, factor);
            }
            if are_similar(duration / factor, length) {
                return remedy("reference", unit, factor);
            }
        }
        for (factor, unit) in units {
            if overlaps(first / factor, last / factor) && is_part(length / factor, duration) {
                return remedy("estimate", unit, factor);
            }
            if overlaps(first * factor, last * factor) && first * factor > 1e6 && is_part(length * factor, duration) {
                return remedy("reference", unit, factor);
            }
        }
    }
    format!("If both began at the same moment, an offset of {:.3} s would make them meet", offset + low - first)
}

/// Whether two durations differ by at most a fifth.
fn are_similar(a: f64, b: f64) -> bool {
    a > 0.0 && b > 0.0 && (a / b).max(b / a) <= 1.2
}

/// Whether a recording of one duration may be a part of one of the other: of seconds and days, hardly.
fn is_part(a: f64, b: f64) -> bool {
    /// The units in question differ by a thousand: half of that, as a logarithm, is nearer to none of them.
    const MAX_RATIO: f64 = 31.6;
    (a / b).max(b / a) <= MAX_RATIO
}

/// A clause about times that go back and times that are repeated; `None` where there are none.
pub fn oddities(stamps: &[f64]) -> Option<String> {
    let back = stamps.windows(2).position(|pair| pair[1] < pair[0]).map(|index| index + 2);
    let back_count = stamps.windows(2).filter(|pair| pair[1] < pair[0]).count();
    let mut sorted = stamps.to_vec();
    sorted.sort_by(f64::total_cmp);
    let repeated = sorted.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let mut parts = Vec::new();
    if let Some(pose) = back {
        let times = if back_count == 1 { "once".to_owned() } else { format!("{back_count} times") };
        parts.push(format!("times go back {times}, first at pose {pose}"));
    }
    if repeated > 0 {
        parts.push(if repeated == 1 {
            "1 time is repeated".to_owned()
        } else {
            format!("{repeated} times are repeated")
        });
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}
