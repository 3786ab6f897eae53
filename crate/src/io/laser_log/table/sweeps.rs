//! The sweeps of a laser in a column of angles.

/// Lasers that do not see all round leave out at least this part of a turn: their widest view is 270 degrees.
const MIN_UNSEEN: f64 = 0.25;

/// The angles counted from the sector that no reading falls into, where there is one: a sweep that passes 360 degrees does not end there.
fn from_unseen_sector(angles: &[f64], turn: f64) -> Vec<f64> {
    let mut seen: Vec<f64> =
        angles.iter().map(|angle| angle.rem_euclid(turn)).filter(|angle| angle.is_finite()).collect();
    seen.sort_by(f64::total_cmp);
    let gaps = seen.windows(2).map(|pair| (pair[1] - pair[0], pair[1]));
    let widest = gaps.filter(|(gap, _)| *gap > MIN_UNSEEN * turn).max_by(|a, b| a.0.total_cmp(&b.0));
    widest.map_or_else(
        || angles.to_vec(),
        |(_, first)| angles.iter().map(|angle| (angle - first).rem_euclid(turn)).collect(),
    )
}

/// Whether the angles go one way, and round once at most: they are one sweep, wherever it leaves out a sector.
fn is_one_sweep(angles: &[f64], turn: f64) -> bool {
    let goes = |sign: f64| angles.windows(2).all(|pair| sign * (pair[1] - pair[0]) >= 0.0);
    let [Some(first), Some(last)] = [angles.first(), angles.last()] else { return false };
    (last - first).abs() <= turn && (goes(1.0) || goes(-1.0))
}

/// A sweep has this share of the angles between the lowest and the highest at least.
const MIN_SWEEP: f64 = 0.5;

/// Where the sweeps of an angle end, of which a turn has so many units.
pub(super) fn ends_of_sweeps(angles: &[f64], turn: f64) -> Vec<usize> {
    if is_one_sweep(angles, turn) { vec![angles.len()] } else { ends_of(&from_unseen_sector(angles, turn)) }
}

/// Where an angle jumps, and where it turns back, as that of a sensor on a servo does.
fn ends_of(angles: &[f64]) -> Vec<usize> {
    let (low, high) = angles.iter().fold((f64::MAX, f64::MIN), |(low, high), &a| (low.min(a), high.max(a)));
    let least = MIN_SWEEP * (high - low);
    let mut ends = Vec::new();
    // Where this sweep has come furthest up and furthest down.
    let (mut up, mut down) = (0, 0);
    for at in 1..angles.len() {
        let (angle, before) = (angles[at], angles[at - 1]);
        if (angle - before).abs() > least || angle.is_nan() {
            ends.push(at);
            (up, down) = (at, at);
            continue;
        }
        // It has swept up to `up` and is on its way down again, or the other way round.
        let has_turned = |turn: usize, other: usize| {
            other < turn && (angles[turn] - angles[other]).abs() > least && (angle - angles[turn]).abs() > least
        };
        if has_turned(up, down) || has_turned(down, up) {
            let turn = up.max(down);
            ends.push(turn + 1);
            (up, down) = if angles[turn] > angle { (turn + 1, at) } else { (at, turn + 1) };
        }
        up = if angle > angles[up] { at } else { up };
        down = if angle < angles[down] { at } else { down };
    }
    ends.push(angles.len());
    ends
}
