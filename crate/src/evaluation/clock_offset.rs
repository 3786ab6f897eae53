//! The offset between the clocks of two trajectories of one motion, by their speeds, which no choice of axes or of a world changes.

use nalgebra::Vector3;

use crate::geometry::quantile::quantile;

/// Samples of a trajectory at most: two of so many are compared at all offsets in 17 million multiplications.
const MAX_SAMPLES: f64 = 4096.0;
/// Samples of an overlap at least.
const MIN_SAMPLES: usize = 50;
/// A speed is that over so many samples to either side.
const HALF_SPAN: usize = 2;
/// Correlation of the speeds at the right offset, at least: what is common to both is then 1.8 times the rest, as a root mean square.
const MIN_CORRELATION: f64 = 0.75;
/// At an offset further away than four spans it is smaller by this at least: otherwise the motion repeats.
const MIN_LEAD: f64 = 0.1;

/// The offset (s) that added to the estimate's times makes its speeds those of the reference; `None` where none does, or several do.
pub(super) fn clock_offset(
    [reference, estimate]: [&[Vector3<f64>]; 2],
    [of_reference, of_estimate]: [&[f64]; 2],
) -> Option<f64> {
    let step = median_interval(of_reference)?.max(median_interval(of_estimate)?);
    let duration = |stamps: &[f64]| Some(stamps.last()? - stamps.first()?);
    let step = step.max(duration(of_reference)?.max(duration(of_estimate)?) / MAX_SAMPLES);
    let (a, b) = (speeds(reference, of_reference, step)?, speeds(estimate, of_estimate, step)?);
    let least = (a.len().min(b.len()) / 2).max(MIN_SAMPLES);
    let [len_a, len_b, common] = [a.len(), b.len(), least].map(usize::cast_signed);
    let lags = common - len_b..=len_a - common;
    let correlations: Vec<(isize, f64)> =
        lags.filter_map(|lag| Some((lag, correlation(&a, &b, lag, least)?))).collect();
    let best = *correlations.iter().max_by(|x, y| x.1.total_cmp(&y.1))?;
    let is_far = |lag: isize| (lag - best.0).unsigned_abs() > 8 * HALF_SPAN;
    let rival = correlations.iter().filter(|(lag, _)| is_far(*lag)).map(|other| other.1).fold(0.0, f64::max);
    if best.1 < MIN_CORRELATION || best.1 - rival < MIN_LEAD {
        return None;
    }
    let at = |lag: isize| correlations.iter().find(|other| other.0 == lag).map(|other| other.1);
    // The top of the parabola through the best one and its neighbours.
    let shift = match (at(best.0 - 1), at(best.0 + 1)) {
        (Some(before), Some(after)) => (before - after) / (2.0 * (before - 2.0 * best.1 + after)),
        _ => 0.0,
    };
    Some(of_reference[0] - of_estimate[0] + step * (best.0 as f64 + if shift.is_finite() { shift } else { 0.0 }))
}

fn median_interval(stamps: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    quantile(&mut steps, 0.5).filter(|step| *step > 0.0 && stamps.is_sorted())
}

/// Lengths of the ways (m) around times in even steps (s), between poses in proportion.
fn speeds(positions: &[Vector3<f64>], stamps: &[f64], step: f64) -> Option<Vec<f64>> {
    let (first, last) = (stamps.first()?, stamps.last()?);
    let count = ((last - first) / step).floor() as usize + 1;
    let mut after = 1;
    let even: Vec<Vector3<f64>> = (0..count)
        .map(|sample| {
            let time = first + step * sample as f64;
            while after + 1 < stamps.len() && stamps[after] < time {
                after += 1;
            }
            let gap = stamps[after] - stamps[after - 1];
            let share = if gap > 0.0 { ((time - stamps[after - 1]) / gap).clamp(0.0, 1.0) } else { 0.0 };
            positions[after - 1].lerp(&positions[after], share)
        })
        .collect();
    Some(even.windows(2 * HALF_SPAN + 1).map(|window| (window[2 * HALF_SPAN] - window[0]).norm()).collect())
}

/// Of `a[i + lag]` and `b[i]`; `None` where fewer than `least` are common, or one of them is even.
fn correlation(a: &[f64], b: &[f64], lag: isize, least: usize) -> Option<f64> {
    let (begin_a, begin_b) = (lag.max(0) as usize, (-lag).max(0) as usize);
    let count = a.len().checked_sub(begin_a)?.min(b.len().checked_sub(begin_b)?);
    if count < least {
        return None;
    }
    let (a, b) = (&a[begin_a..begin_a + count], &b[begin_b..begin_b + count]);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        let (x, y) = (x - mean_a, y - mean_b);
        ab += x * y;
        aa += x * x;
        bb += y * y;
    }
    (aa > 0.0 && bb > 0.0).then(|| ab / (aa * bb).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hand that moves irregularly for 40 s.
    fn hand(time: f64) -> Vector3<f64> {
        Vector3::new(
            (0.7 * time).sin() + 0.3 * (2.3 * time).sin(),
            (0.05 * time * time).cos(),
            0.2 * (1.1 * time).sin(),
        )
    }

    fn path(begin: f64, end: f64, step: f64, offset: f64) -> (Vec<Vector3<f64>>, Vec<f64>) {
        let times: Vec<f64> = (0..((end - begin) / step) as usize).map(|i| begin + step * i as f64).collect();
        (times.iter().map(|&time| 2.0 * hand(time)).collect(), times.iter().map(|time| time + offset).collect())
    }

    #[test]
    fn speeds_tell_the_offset_of_another_clock() {
        let (reference, stamps) = path(0.0, 40.0, 0.01, 1.6e9);
        for offset in [0.0, 0.5, -3600.0] {
            let (estimate, times) = path(7.0, 33.0, 1.0 / 30.0, offset);
            let found = clock_offset([&reference, &estimate], [&stamps, &times]).unwrap();
            assert!((found - (1.6e9 - offset)).abs() < 5e-3, "{found}, not {}", 1.6e9 - offset);
        }
    }

    #[test]
    fn a_motion_that_is_even_or_repeats_does_not_tell() {
        let stamps: Vec<f64> = (0..400).map(|i| 0.1 * f64::from(i)).collect();
        let line: Vec<_> = stamps.iter().map(|&time| Vector3::new(time, 0.0, 0.0)).collect();
        assert_eq!(clock_offset([&line, &line], [&stamps, &stamps]), None);
        let swing: Vec<_> = stamps.iter().map(|&time| Vector3::new((2.0 * time).sin(), 0.0, 0.0)).collect();
        assert_eq!(clock_offset([&swing, &swing], [&stamps, &stamps]), None);
    }
}
