//! Hypotheses about what a file does not say, weighed by how likely its data are under each.

/// Likelihood of what is off by so many standard deviations, relative to that of what is as expected.
pub(crate) fn gaussian(deviations: f64) -> f64 {
    (-0.5 * deviations * deviations).exp()
}

/// Likelihood of a positive value whose logarithm has a normal distribution with this median, and with this deviation.
pub(crate) fn log_normal(value: f64, (median, deviation): (f64, f64)) -> f64 {
    gaussian((value / median).ln() / deviation)
}

/// Hypotheses in the order of their probabilities, the likeliest first.
pub(crate) fn ranked<T>(hypotheses: impl IntoIterator<Item = (f64, T)>) -> Vec<(f64, T)> {
    let mut ranked: Vec<(f64, T)> = hypotheses.into_iter().collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked
}

/// The ranked hypotheses after the first that are more than `least` times as probable as it.
pub(crate) fn alternatives<T: Copy>(ranked: &[(f64, T)], least: f64) -> Vec<T> {
    let Some(((best, _), others)) = ranked.split_first() else { return Vec::new() };
    others.iter().filter(|(probability, _)| *probability > least * best).map(|(_, hypothesis)| *hypothesis).collect()
}
