//! What the names above the columns of a table say: which columns are ranges, and in which units numbers are.

use super::format::TIMES;
use crate::io::laser_log::units::MAX_RADIANS;
use crate::io::length_unit::UNITS;

/// A line of a scan has this many numbers at least: a pose has 16 at the most.
pub(super) const MIN_SCAN_NUMBERS: usize = 24;

/// Neighbouring columns whose names count: `r0`, `r1`, ... or `-90 deg`, `-89 deg`, ...
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Series {
    /// First column.
    pub first: usize,
    /// The column after the last one.
    pub end: usize,
    /// Bearing of the first reading and the step to the next (rad), where the names are angles.
    pub bearings: Option<(f64, f64)>,
}

/// What columns are called: in English, German, French, Spanish, Italian, Portuguese, Japanese and Chinese.
pub(super) const ANGLES: [&str; 12] =
    ["angle", "angule", "theta", "bearing", "azimut", "servo", "winkel", "ángulo", "angulo", "angolo", "角度", "方位"];
pub(super) const RANGES: [&str; 9] =
    ["range", "dist", "radius", "abstand", "entfernung", "portée", "alcance", "距離", "距离"];
pub(super) const BEAMS: [&str; 10] =
    ["beam", "beam_index", "beam_id", "beam_idx", "ray", "ray_index", "strahl", "haz", "faisceau", "step"];
pub(super) const CLOCKS: [&str; 18] = [
    "t",
    "time",
    "timestamp",
    "stamp",
    "sec",
    "seconds",
    "s",
    "ms",
    "us",
    "ns",
    "zeit",
    "zeitstempel",
    "uhrzeit",
    "temps",
    "tiempo",
    "tempo",
    "時刻",
    "时间",
];
pub(super) const HEADINGS: [&str; 17] = [
    "theta",
    "th",
    "yaw",
    "heading",
    "phi",
    "angle",
    "ang",
    "orientation",
    "rotation",
    "rot",
    "winkel",
    "gier",
    "richtung",
    "cap",
    "lacet",
    "rumbo",
    "ángulo",
];

/// Largest share by which even steps differ as they are rounded: those between numbered names, of a clock, of a counter.
pub(super) const SAME_STEP: f64 = 0.02;

/// The longest series of numbered names, as long as a scan.
pub(super) fn series(names: &[String]) -> Option<Series> {
    let parts: Vec<Option<Numbered>> = names.iter().map(|name| Numbered::of(name)).collect();
    let (mut longest, mut first) = (0..0, 0);
    for end in 1..=parts.len() {
        let step = |at: usize| match (&parts[at - 1], &parts[at]) {
            (Some(a), Some(b)) if (a.before, a.after) == (b.before, b.after) => Some(b.number - a.number),
            _ => None,
        };
        let follows = |at: usize| {
            let (Some(step), Some(wanted)) = (step(at), step(first + 1)) else { return false };
            step != 0.0 && (step - wanted).abs() <= SAME_STEP * wanted.abs()
        };
        if end < parts.len() && follows(end) {
            continue;
        }
        if end - first > longest.len() {
            longest = first..end;
        }
        first = end;
    }
    if longest.len() < MIN_SCAN_NUMBERS {
        return None;
    }
    let numbered: Vec<&Numbered> = parts[longest.clone()].iter().flatten().collect();
    let [from, .., to] = &numbered[..] else { return None };
    let step = (to.number - from.number) / (numbered.len() - 1) as f64;
    let unit = from.unit_of_angles(
        from.number.abs().max(to.number.abs()),
        from.number.min(to.number) < 0.0 || step.fract() != 0.0 || step < 0.0,
    );
    let bearings = unit.map(|unit| (unit * from.number, unit * step));
    Some(Series { first: longest.start, end: longest.end, bearings })
}

/// The columns that stand between those of ranges, as their intensities: `range_0, intensity_0, range_1, ...`.
pub(super) fn between_ranges(names: &[String]) -> Vec<usize> {
    let mut groups: Vec<((&str, &str), Vec<usize>)> = Vec::new();
    for (column, name) in names.iter().enumerate() {
        let Some(Numbered { before, after, .. }) = Numbered::of(name) else { continue };
        match groups.iter_mut().find(|(stem, _)| *stem == (before, after)) {
            Some((_, columns)) => columns.push(column),
            None => groups.push(((before, after), vec![column])),
        }
    }
    let is_spread = |columns: &[usize]| {
        let stride = columns.get(1).map_or(0, |second| second - columns[0]);
        stride > 1 && columns.len() >= MIN_SCAN_NUMBERS && columns.windows(2).all(|pair| pair[1] - pair[0] == stride)
    };
    groups.retain(|(_, columns)| is_spread(columns));
    let says_range = |stem: &str| RANGES.iter().any(|word| stem.contains(word));
    let ranges = groups.iter().position(|((before, _), _)| says_range(before)).unwrap_or(0);
    let others = groups.iter().enumerate().filter(|(group, _)| *group != ranges);
    others.flat_map(|(_, (_, columns))| columns.iter().copied()).collect()
}

/// A name around its number.
struct Numbered<'a> {
    before: &'a str,
    number: f64,
    after: &'a str,
}

impl<'a> Numbered<'a> {
    fn of(name: &'a str) -> Option<Self> {
        let digit = name.find(|c: char| c.is_ascii_digit())?;
        let is_sign =
            |head: &str| head.ends_with(['-', '+']) && !head[..head.len() - 1].ends_with(|c: char| c.is_alphanumeric());
        let begin = if is_sign(&name[..digit]) { digit - 1 } else { digit };
        let length = name[digit..].find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(name.len() - digit);
        let number = name[begin..digit + length].trim_end_matches('.').parse().ok()?;
        Some(Self { before: &name[..begin], number, after: &name[digit + length..] })
    }

    /// Radians of a unit of the numbers, where they are angles: by the words around them, or as bare numbers that do not count
    /// from 0 or 1 (`is_no_count`).
    fn unit_of_angles(&self, largest: f64, is_no_count: bool) -> Option<f64> {
        let says = |word: &str| self.before.contains(word) || self.after.contains(word);
        let is_bare = self.before.is_empty() && self.after.is_empty();
        let is_angle = says("angle") || says("theta") || says("bearing") || is_bare && is_no_count;
        if says("deg") || says("°") || is_angle && !says("rad") && largest > MAX_RADIANS {
            return Some(1f64.to_radians());
        }
        (says("rad") || is_angle).then_some(1.0)
    }
}

/// Whether each column behind one of bearings is a scan: `angle, scan_0, scan_1, ...`.
pub(super) fn are_scans(names: &[String]) -> bool {
    let [bearing, scans @ ..] = names else { return false };
    let numbered: Option<Vec<Numbered>> = scans.iter().map(|name| Numbered::of(name)).collect();
    let follows = |pair: &[Numbered]| {
        (pair[0].before, pair[0].after) == (pair[1].before, pair[1].after) && pair[1].number == pair[0].number + 1.0
    };
    scans.len() > 1 && may_be_bearing(bearing) && numbered.is_some_and(|numbered| numbered.windows(2).all(follows))
}

/// What poses are called, and what may stand before the names of their parts.
const POSES: [&str; 7] = ["odometry", "odom", "odo", "pose", "robot", "position", "pos"];

/// Whether a column of this name holds a pose.
pub(super) fn is_pose(name: &str) -> bool {
    POSES.contains(&bare(name))
}

/// A name without its unit and without what it belongs to: `odom_x (m)` is `x`.
pub(super) fn bare(name: &str) -> &str {
    let name = name.split(['(', '[']).next().unwrap_or(name).trim();
    let name = POSES.iter().find_map(|prefix| name.strip_prefix(prefix)?.strip_prefix(['_', '.', ' '])).unwrap_or(name);
    match name.rsplit_once(['_', ' ']) {
        Some((stem, unit)) if is_unit(unit) => stem,
        _ => name,
    }
}

fn is_unit(word: &str) -> bool {
    ["deg", "rad", "degrees", "radians"].contains(&word) || UNITS.iter().chain(&TIMES).any(|(name, _)| *name == word)
}

/// Whether a column of this name may be the bearing of a reading: `scan_angle`, `theta`, or anything in degrees or radians
/// (`sensor_deg`) that is not called as a heading.
pub(super) fn may_be_bearing(name: &str) -> bool {
    let is_word = |word: &str| word == "ang" || ANGLES.iter().any(|angle| word.starts_with(angle));
    let words = || name.split(|c: char| !c.is_alphanumeric());
    let is_angle = words().any(|word| ["deg", "rad", "degrees", "radians"].contains(&word)) || name.contains('°');
    words().any(is_word) || is_angle && !HEADINGS.contains(&bare(name))
}

/// Radians of a unit of a heading, by the name of its column.
pub(super) fn heading_unit(name: &str) -> f64 {
    if name.contains("deg") || name.contains("grad") || name.contains('°') { 1f64.to_radians() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(of: impl Iterator<Item = String>) -> Vec<String> {
        [vec!["time".to_owned()], of.collect(), vec!["temp1".to_owned()]].concat()
    }

    #[test]
    fn names_that_count_are_ranges_and_angles_are_bearings() {
        for stem in ["r", "range_", "ranges[", "beam "] {
            let found = series(&names((0..181).map(|at| format!("{stem}{at}")))).expect(stem);
            assert_eq!(found, Series { first: 1, end: 182, bearings: None });
        }
        for text in ["deg", "°", " deg)"] {
            let found = series(&names((0..61).map(|at| format!("{}{text}", at - 30)))).expect(text);
            let (start, step) = found.bearings.expect(text);
            assert!((start + 30f64.to_radians()).abs() < 1e-12 && (step - 1f64.to_radians()).abs() < 1e-12);
        }
        let radians = series(&names((0..101).map(|at| format!("{:.4}", 0.0314 * f64::from(at - 50)))));
        let (start, step) = radians.and_then(|found| found.bearings).expect("radians");
        assert!((start + 1.57).abs() < 1e-9 && (step - 0.0314).abs() < 1e-9);
        assert_eq!(series(&names((0..181).map(|at| at.to_string()))).expect("a count").bearings, None);
        assert_eq!(series(&names((0..20).map(|at| format!("r{at}")))), None);
        assert_eq!(series(&names((0..100).map(|at| format!("{}", 3.0 + 0.1 * f64::from(at * at))))), None);
    }

    #[test]
    fn numbered_columns_beside_one_of_bearings_are_scans() {
        let named = |text: &str| are_scans(&text.split(',').map(str::to_owned).collect::<Vec<_>>());
        assert!(named("angle_deg,scan_0,scan_1,scan_2") && named("theta,1,2"));
        assert!(!named("angle,range0") && !named("angle,range_0,quality_1") && !named("time,scan_0,scan_1"));
    }

    #[test]
    fn names_are_told_from_their_units() {
        assert_eq!(
            ["odom_x (m)", "pose.theta_deg", "x", "odo_th", "yaw [rad]"].map(bare),
            ["x", "theta", "x", "th", "yaw"]
        );
        let bearings = ["angle", "scan_angle", "servo", "sensor_deg", "angle (°)", "theta"].map(may_be_bearing);
        assert_eq!(bearings, [true; 6]);
        assert_eq!(["heading_deg", "x", "rectangle", "yaw (rad)", "radius"].map(may_be_bearing), [false; 5]);
    }
}
