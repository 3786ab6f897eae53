//! The times of scans, as far as a trajectory can carry them.

use super::fields::are_exceptions;

/// Times that are fit for a trajectory, and what is to be said of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stamps {
    /// A time a scan (s); `None` where scans have none, or such that do not tell them apart.
    pub times: Option<Vec<f64>>,
    /// What is wrong with the times, in whole sentences.
    pub note: Option<String>,
}

/// The times of the scans of a recording (s), in their order.
#[inline(never)]
pub fn stamps(times: &[Option<f64>]) -> Stamps {
    let known: Vec<f64> = times.iter().copied().flatten().collect();
    if known.is_empty() {
        return Stamps::default();
    }
    let remedy = "To compare by time, export the log with the time of each scan, in all its digits";
    if known.len() < times.len() {
        let missing = times.len() - known.len();
        let note = format!("{missing} of {} scans have no time, so the trajectory counts them. {remedy}.", times.len());
        return Stamps { times: None, note: Some(note) };
    }
    let is_faulty = |pair: &&[f64]| pair[1] <= pair[0];
    let Some(first) = known.windows(2).position(|pair| is_faulty(&pair)) else {
        return Stamps { times: Some(known), note: None };
    };
    let faulty = known.windows(2).filter(is_faulty).count();
    let (before, after) = (known[first], known[first + 1]);
    let said = format!(
        "{faulty} of {} scans are not later than the one before (first scan {}: {after} s after {before} s)",
        known.len(),
        first + 1
    );
    if are_exceptions(faulty, known.len()) {
        let note = format!("{said}; the trajectory has their times as the log does.");
        return Stamps { times: Some(known), note: Some(note) };
    }
    let note =
        format!("The log's times do not tell its scans apart: {said}. The trajectory counts the scans. {remedy}.");
    Stamps { times: None, note: Some(note) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_kept_where_they_ascend_and_told_where_they_do_not() {
        let of = |times: &[f64]| stamps(&times.iter().map(|&time| Some(time)).collect::<Vec<_>>());
        assert_eq!(stamps(&[None, None]), Stamps::default());
        assert_eq!(of(&[1.0, 1.5, 4.0]), Stamps { times: Some(vec![1.0, 1.5, 4.0]), note: None });
        let repeated = of(&[1.01893e9; 4]);
        assert_eq!(repeated.times, None);
        let note = repeated.note.unwrap();
        assert!(note.contains("3 of 4 scans are not later") && note.contains("counts the scans. To compare"), "{note}");
        assert!(of(&[3.0, 2.0, 1.0]).times.is_none());
        let partly = stamps(&[Some(1.0), None, Some(2.0)]);
        assert!(partly.times.is_none() && partly.note.unwrap().starts_with("1 of 3 scans have no time"));
        // A hiccup in a long log.
        let mut long: Vec<f64> = (0..300).map(f64::from).collect();
        long[100] = 99.0;
        let kept = of(&long);
        assert_eq!(kept.times, Some(long));
        assert!(kept.note.unwrap().contains("first scan 100: 99 s after 99 s"));
    }
}
