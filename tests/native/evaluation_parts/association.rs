//! Which pose of the estimate belongs to which of the reference.

use scanstitch::evaluation::associate::{Pair, by_index, by_number, by_time, oddities};
use scanstitch::evaluation::evaluate::{Association, EvaluationOptions, evaluate};
use scanstitch_scene::random::Random;

use super::samples::winding;

fn pairs(found: &[Pair]) -> Vec<(usize, usize)> {
    found.iter().map(|pair| (pair.reference, pair.estimate)).collect()
}

#[test]
fn nearest_times_as_evo_takes_them() {
    // The shorter one asks; the estimate, when they are as long.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 2.0, 3.0], &[0.9, 2.2], 0.3, 0.0).unwrap()), [(1, 0), (2, 1)]);
    assert_eq!(pairs(&by_time(&[0.9, 2.2], &[0.0, 1.0, 2.0, 3.0], 0.3, 0.0).unwrap()), [(0, 1), (1, 2)]);
    // Poses of the longer one may be taken twice.
    assert_eq!(pairs(&by_time(&[1.0, 9.0, 10.0], &[0.9, 1.1], 0.2, 0.0).unwrap()), [(0, 0), (0, 1)]);
    // The offset is added to the estimate's times, whoever asks.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 2.0], &[5.0, 6.0], 0.01, -5.0).unwrap()), [(0, 0), (1, 1)]);
    assert_eq!(pairs(&by_time(&[0.0, 1.0], &[5.0, 6.0, 7.0], 0.01, -5.0).unwrap()), [(0, 0), (1, 1)]);
    // Of two equally near, the earlier.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 4.0], &[0.5], 1.0, 0.0).unwrap()), [(0, 0)]);
    // At the tolerance exactly.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 4.0], &[1.5], 0.5, 0.0).unwrap()), [(1, 0)]);
    // Repeated times: before the end the last of them, at the very end the last but one.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 1.0, 2.0], &[1.0], 0.1, 0.0).unwrap()), [(2, 0)]);
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 1.0, 1.0], &[1.0], 0.1, 0.0).unwrap()), [(2, 0)]);
    // Times that go back: the first of the nearest.
    assert_eq!(pairs(&by_time(&[2.0, 0.0, 1.0, 0.0], &[1.1, 0.0], 0.2, 0.0).unwrap()), [(2, 0), (1, 1)]);
    assert_eq!(pairs(&by_time(&[3.0, 1.0, 2.0], &[1.5], 0.5, 0.0).unwrap()), [(1, 0)]);

    assert_eq!(pairs(&by_index(2, 2).unwrap()), [(0, 0), (1, 1)]);
    assert!(by_index(3, 2).unwrap_err().to_string().contains("The reference has 3 poses and the estimate 2"));
    assert_eq!(oddities(&[0.0, 1.0, 2.0]), None);
    assert_eq!(oddities(&[0.0, 2.0, 1.0, 2.0]).unwrap(), "times go back once, first at pose 3; 1 time is repeated");
}

#[test]
fn unsorted_times_agree_with_a_search_through_all() {
    let mut random = Random::new(3);
    for _ in 0..50 {
        let mut stamps = || (0..40).map(|_| (random.uniform(0.0, 20.0) * 4.0).round() / 4.0).collect::<Vec<f64>>();
        let (long, short) = (stamps(), stamps()[..25].to_vec());
        let nearest = |query: f64| {
            let best = (0..long.len()).min_by(|&a, &b| (long[a] - query).abs().total_cmp(&(long[b] - query).abs()));
            best.filter(|&index| (long[index] - query).abs() <= 0.3)
        };
        let expected: Vec<(usize, usize)> =
            short.iter().enumerate().filter_map(|(index, &query)| Some((nearest(query)?, index))).collect();
        assert_eq!(pairs(&by_time(&long, &short, 0.3, 0.0).unwrap()), expected);
    }
}

#[test]
fn an_error_without_overlap_in_time_gives_both_spans_and_a_guess() {
    let reference: Vec<f64> = (0..50).map(|i| 1000.0 + f64::from(i)).collect();
    let told = |estimate: &[f64]| by_time(&reference, estimate, 0.01, 0.0).unwrap_err().to_string();
    let shifted = told(&[0.0, 10.0, 49.0]);
    assert!(
        shifted.contains("the reference spans 1000.000 to 1049.000 s, the estimate 0.000 to 49.000 s"),
        "{shifted}"
    );
    assert!(shifted.contains("an offset of 1000.000 s would make them meet"), "{shifted}");
    for (factor, unit) in [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")] {
        let scaled: Vec<f64> = reference.iter().map(|stamp| (stamp + 0.5) * factor).collect();
        assert!(told(&scaled).contains(&format!("look like {unit}: divide them by 1e")), "{}", told(&scaled));
    }
    let milliseconds_from_zero: Vec<f64> = (0..50).map(|i| 1e7 + 1000.0 * f64::from(i)).collect();
    assert!(told(&milliseconds_from_zero).contains("The estimate's times look like milliseconds"));
    let seconds: Vec<f64> = (0..50).map(f64::from).collect();
    let in_nanoseconds: Vec<f64> = seconds.iter().map(|stamp| 1.7e18 + stamp * 1e9).collect();
    let told_of_reference = by_time(&in_nanoseconds, &seconds, 0.01, 0.0).unwrap_err().to_string();
    assert!(told_of_reference.contains("The reference's times look like nanoseconds"), "{told_of_reference}");
    assert!(told(&[1000.5, 1001.5]).contains("The spans overlap"));
}

#[test]
fn numbers_name_the_poses_of_a_trajectory_with_times() {
    let times = [70.2, 70.4, 70.5, 70.9];
    let (whose, found) = by_number(&[0.0, 2.0, 3.0], &times).unwrap();
    assert_eq!((whose, pairs(&found)), ("reference", vec![(0, 0), (1, 2), (2, 3)]));
    let (whose, found) = by_number(&times, &[1.0, 2.0]).unwrap();
    assert_eq!((whose, pairs(&found)), ("estimate", vec![(1, 0), (2, 1)]));
    for none in [[0.0, 4.0], [1.0, 1.0], [0.5, 1.0], [-1.0, 0.0]] {
        assert!(by_number(&none, &times).is_none(), "{none:?}");
    }
    // Of two that count, neither counts the other's poses.
    assert!(by_number(&[0.0, 1.0], &[0.0, 1.0]).is_none());

    let timed = winding(4).with_stamps(times.to_vec()).unwrap();
    let counted = winding(4).with_stamps(vec![0.0, 1.0, 2.0, 3.0]).unwrap();
    let summary = evaluate(&counted, &timed, &EvaluationOptions::default()).unwrap().summary;
    assert_eq!((summary.num_matched, summary.statistics.max), (4, 0.0));
    assert!(summary.notes[0].contains("matched by number"), "{:?}", summary.notes);
    let by_time = EvaluationOptions { association: Association::Time, ..EvaluationOptions::default() };
    assert!(evaluate(&counted, &timed, &by_time).is_err());
}
