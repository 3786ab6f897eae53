//! In which unit numbers are that are lengths and do not say which.
//!
//! Every unit is a hypothesis with a prior. Two things tell: the size that the numbers have in it, and the step that they are
//! multiples of, for no sensor measures in steps of metres. The readers of clouds and of tables of ranges share the weighing.

use crate::geometry::hypotheses::{alternatives, gaussian, log_normal, ranked};
use crate::geometry::quantile::quantile;

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthUnit {
    /// Metres of one.
    pub metres: f64,
    /// As it is written.
    pub symbol: &'static str,
    /// In words.
    pub name: &'static str,
}

/// Metres.
pub const METRE: LengthUnit = LengthUnit { metres: 1.0, symbol: "m", name: "metres" };
/// Centimetres.
pub const CENTIMETRE: LengthUnit = LengthUnit { metres: 0.01, symbol: "cm", name: "centimetres" };
/// Millimetres.
pub const MILLIMETRE: LengthUnit = LengthUnit { metres: 1e-3, symbol: "mm", name: "millimetres" };

/// Tenths of a millimetre.
pub const TENTH_OF_MILLIMETRE: LengthUnit =
    LengthUnit { metres: 1e-4, symbol: "0.0001", name: "tenths of millimetres" };
/// Inches, which only who wrote a file can say.
pub const INCH: LengthUnit = LengthUnit { metres: 0.0254, symbol: "in", name: "inches" };
/// Feet, likewise.
pub const FOOT: LengthUnit = LengthUnit { metres: 0.3048, symbol: "ft", name: "feet" };

/// What units of length are called in files, and metres of each; of several names for one, the first is written.
pub const UNITS: [(&str, f64); 21] = [
    (METRE.symbol, METRE.metres),
    (CENTIMETRE.symbol, CENTIMETRE.metres),
    (MILLIMETRE.symbol, MILLIMETRE.metres),
    (INCH.symbol, INCH.metres),
    (FOOT.symbol, FOOT.metres),
    ("inch", INCH.metres),
    ("inches", INCH.metres),
    ("foot", FOOT.metres),
    ("feet", FOOT.metres),
    ("metre", METRE.metres),
    ("metres", METRE.metres),
    ("meter", METRE.metres),
    ("meters", METRE.metres),
    ("centimetre", CENTIMETRE.metres),
    ("centimetres", CENTIMETRE.metres),
    ("centimeter", CENTIMETRE.metres),
    ("centimeters", CENTIMETRE.metres),
    ("millimetre", MILLIMETRE.metres),
    ("millimetres", MILLIMETRE.metres),
    ("millimeter", MILLIMETRE.metres),
    ("millimeters", MILLIMETRE.metres),
];

/// The unit that words in lower case name: `distance_mm`, `range (cm)`, `range in m`. The last one counts: `in` is a word, too.
pub fn unit_in(words: &str, units: &[(&str, f64)]) -> Option<f64> {
    let words = words.split(|c: char| !c.is_ascii_alphabetic());
    words.filter_map(|word| Some(units.iter().find(|unit| unit.0 == word)?.1)).next_back()
}

/// What numbers of one kind are like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Probability of metres, centimetres, millimetres and tenths of them before anything is known of the numbers.
    pub priors: [f64; 4],
    /// Median (m), and its standard deviation as a logarithm.
    pub median: (f64, f64),
    /// Largest values that such sensors measure, from the shortest to the farthest (m).
    pub largest: (f64, f64),
}

/// Ranges of planar lasers: from a desk to a yard; the farthest of the common ones reports 82 m for no return, and ultrasonic
/// and infrared sensors see 1 m at least.
pub const LASER_RANGES: Expected =
    Expected { priors: [0.7, 0.05, 0.245, 0.005], median: (2.5, 1.1), largest: (1.0, 100.0) };
/// Distances within a cloud: rooms have 2 to 3 m, streets 10, yards and halls up to 60.
pub const CLOUD_SIZES: Expected =
    Expected { priors: [0.976, 0.003, 0.02, 0.001], median: (4.0, 1.39), largest: (0.0, f64::INFINITY) };

/// No planar laser sees so far (m).
pub const LONGEST_LASER_RANGE: f64 = 200.0;

/// Another unit is open where it is at least so probable in relation to the likeliest; ...
const MIN_ALTERNATIVE: f64 = 0.1;
/// ... beside metres even less: what is taken for metres is taken without a word.
const MIN_ALTERNATIVE_TO_METRES: f64 = 0.02;
/// Likelihoods of steps larger than these (m): sensors measure in finer ones, the coarsest of them by ultrasound; grids have coarser ones,
/// and the coarsest are of no measurement.
const COARSE_STEPS: [(f64, f64); 2] = [(0.199, 1e-4), (0.02, 0.05)];
/// Deviation of a range limit beyond the usual ones, in either direction, as a logarithm: twice as far is improbable.
const LIMIT_DEVIATION: f64 = 0.35;
/// Steps that numbers may be multiples of, the coarsest first: whole numbers, quarters (RPLIDAR), decimals.
const STEPS: [f64; 9] = [100.0, 10.0, 1.0, 0.5, 0.25, 0.1, 0.05, 0.01, 0.001];

/// The likeliest unit, and those that are open beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedUnit {
    /// The likeliest.
    pub unit: LengthUnit,
    /// Others that the numbers allow, the likeliest first.
    pub alternatives: Vec<LengthUnit>,
    /// The step that all numbers are multiples of, in the unit of the file; 0 where there is none.
    pub step: f64,
    /// Median of the numbers, in the unit of the file.
    pub median: f64,
}

/// Weighs the units of `values`, whose `step` is that of the numbers as they are written; `sizes` are what is measured.
pub fn judge_unit(mut sizes: Vec<f64>, step: f64, expected: &Expected) -> JudgedUnit {
    sizes.retain(|size| size.is_finite() && *size > 0.0);
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let median = quantile(&mut sizes, 0.5).unwrap_or(1.0);
    let ranked =
        ranked([METRE, CENTIMETRE, MILLIMETRE, TENTH_OF_MILLIMETRE].into_iter().zip(expected.priors).map(
            |(unit, prior)| (prior * expected.likelihood([median, largest, step].map(|x| x * unit.metres)), unit),
        ));
    let (_, unit) = ranked[0];
    let least = if unit == METRE { MIN_ALTERNATIVE_TO_METRES } else { MIN_ALTERNATIVE };
    JudgedUnit { unit, alternatives: alternatives(&ranked, least), step, median }
}

impl Expected {
    /// Of a median, a largest value and a step (m).
    fn likelihood(&self, [median, largest, step]: [f64; 3]) -> f64 {
        let of_step = COARSE_STEPS.iter().find(|(least, _)| step > *least).map_or(1.0, |(_, likelihood)| *likelihood);
        let (shortest, farthest) = self.largest;
        let beyond = (shortest / largest).ln().max((largest / farthest).ln()).max(0.0) / LIMIT_DEVIATION;
        log_normal(median, self.median) * gaussian(beyond) * of_step
    }
}

/// The coarsest step that all of these are multiples of, to the rounding of a file; 0 where there is none.
pub fn step_of(values: impl Iterator<Item = f64>) -> f64 {
    let is_multiple = |value: f64, step: f64| {
        let count = value / step;
        (count - count.round()).abs() <= (1e-6 * count.abs().max(1.0)).min(0.02)
    };
    let mut all = values.filter(|value| value.is_finite());
    let mut left = STEPS.to_vec();
    all.by_ref()
        .take_while(|&value| {
            left.retain(|&step| is_multiple(value, step));
            !left.is_empty()
        })
        .for_each(drop);
    left.first().copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers about a median, as multiples of a step.
    fn spread(median: f64, step: f64) -> Vec<f64> {
        let value = |i: i32| median * (0.25 + 0.04 * f64::from(i) + 0.001 * f64::from(i).powf(1.8));
        (1..=30).map(value).map(|value| if step > 0.0 { (value / step).round() * step } else { value }).collect()
    }

    #[test]
    fn the_unit_of_ranges_is_that_of_lasers() {
        for (median, step, symbol) in [
            (2.5, 0.0, "m"),
            (0.6, 0.001, "m"),
            (12.0, 0.01, "m"),
            (1300.0, 0.25, "mm"),
            (900.0, 1.0, "mm"),
            (6000.0, 1.0, "mm"),
            (150.0, 1.0, "cm"),
            (250.0, 0.1, "cm"),
            (2500.0, 0.0, "mm"),
        ] {
            let values = spread(median, step);
            let judged = judge_unit(values.clone(), step_of(values.iter().copied()), &LASER_RANGES);
            assert_eq!(judged.unit.symbol, symbol, "{median} in steps of {step}: {judged:?}");
        }
    }

    #[test]
    fn names_of_units_are_found_among_other_words() {
        assert_eq!(
            ["dist_cm", "range in m", "dist (in)", "span_ft", "unit: millimeters"].map(|name| unit_in(name, &UNITS)),
            [0.01, 1.0, 0.0254, 0.3048, 1e-3].map(Some)
        );
        assert_eq!(unit_in("distance", &UNITS), None);
        assert_eq!(unit_in("time (ms)", &[("ms", 1e-3)]), Some(1e-3));
    }

    #[test]
    fn clouds_are_in_metres_unless_their_size_says_otherwise() {
        for (median, step, symbol, is_open) in [
            (2.5, 0.0, "m", false),
            (12.0, 0.0, "m", false),
            (60.0, 0.001, "m", false),
            (100.0, 0.0, "m", true),
            (2500.0, 1.0, "mm", false),
            (2500.0, 0.0, "mm", false),
            (300.0, 0.0, "m", true),
        ] {
            let values = spread(median, step);
            let judged = judge_unit(values.clone(), step_of(values.iter().copied()), &CLOUD_SIZES);
            assert_eq!(
                (judged.unit.symbol, !judged.alternatives.is_empty()),
                (symbol, is_open),
                "{median}: {judged:?}"
            );
        }
    }

    #[test]
    fn steps_are_those_that_all_numbers_are_multiples_of() {
        assert_eq!(step_of([1303.5, 1307.25, 1316.5].into_iter()), 0.25);
        assert_eq!(step_of([100.0, 300.0].into_iter()), 100.0);
        assert_eq!(step_of([0.12, 3.4, f64::NAN].into_iter()), 0.01);
        assert_eq!(step_of([0.123_456, 3.4].into_iter()), 0.0);
    }
}
