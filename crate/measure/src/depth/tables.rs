//! Scores as Markdown tables.

use super::scores::Score;

/// The score of one run.
pub struct Scored {
    /// The kind of recording.
    pub group: String,
    /// The recording.
    pub name: String,
    /// The settings it was run with.
    pub variant: &'static str,
    pub score: Score,
}

/// One run in one line.
pub fn line(score: &Score) -> String {
    let Score {
        frames,
        mean,
        believed_mean,
        last,
        wrong,
        flagged,
        doubtful,
        lost,
        bounded: [within, beyond, told],
        gap,
        closed,
        milliseconds,
        early_and_late,
    } = score;
    format!(
        "{frames} frames, mean {:.1} mm ({:.1} mm of the believed), last {:.1} mm, {wrong} wrong, {flagged} flagged, {doubtful} doubtful, {lost} lost, of {told} good positions \
         {within} in their 95 % region and {beyond} beyond twice that, gap {:.1} mm, {closed} closed, {milliseconds:.1} ms a frame, registering {:.1} ms in frames 20 to 40 and {:.1} ms in 100 to 120",
        1000.0 * mean,
        1000.0 * believed_mean,
        1000.0 * last,
        1000.0 * gap,
        early_and_late[0],
        early_and_late[1]
    )
}

/// One row for each kind of recording.
pub fn by_kind(scored: &[Scored]) -> String {
    let mut rows = vec![String::from(
        "| recording | runs | frames | median of the means | worst mean | worst of the believed | worst last | believed \
         wrong steps | right but doubted | doubtful | lost | ms a frame |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    )];
    for group in distinct(scored.iter().map(|run| run.group.as_str())) {
        let sum = Sum::of(scored.iter().filter(|run| run.group == group));
        rows.push(format!(
            "| {group} | {} | {} | {:.1} mm | {:.1} mm | {:.1} mm | {:.1} mm | {} | {} | {} | {} | {:.1} |\n",
            sum.runs,
            sum.frames,
            1000.0 * sum.median_mean,
            1000.0 * sum.worst_mean,
            1000.0 * sum.worst_believed,
            1000.0 * sum.worst_last,
            sum.wrong,
            sum.flagged,
            sum.doubtful,
            sum.lost,
            sum.milliseconds
        ));
    }
    rows.concat()
}

/// One row for each kind of recording and one column for each variant of the settings: the median and the maximum of the mean
/// errors, wrong steps between good frames, right frames that are doubtful, and the time per frame.
pub fn by_variant(scored: &[Scored]) -> String {
    let variants = distinct(scored.iter().map(|run| run.variant));
    let mut rows = vec![format!("| recording | {} |\n|---|{}\n", variants.join(" | "), "---|".repeat(variants.len()))];
    for group in distinct(scored.iter().map(|run| run.group.as_str())) {
        let cells = variants.iter().map(|&variant| {
            let sum = Sum::of(scored.iter().filter(|run| run.group == group && run.variant == variant));
            let (median, worst) = (1000.0 * sum.median_mean, 1000.0 * sum.worst_mean);
            let both = if sum.runs > 1 { format!("{median:.1}, {worst:.1} mm") } else { format!("{median:.1} mm") };
            format!("{both}; {}; {}; {:.0} ms", sum.wrong, sum.flagged, sum.milliseconds)
        });
        rows.push(format!("| {group} | {} |\n", cells.collect::<Vec<_>>().join(" | ")));
    }
    rows.concat()
}

/// One row for each recording and one column for each of its kinds: the mean error, and for loops the error of the end against the
/// start.
pub fn by_recording(scored: &[Scored]) -> String {
    let groups = distinct(scored.iter().map(|run| run.group.as_str()));
    let mut rows = vec![format!("| recording | {} |\n|---|{}\n", groups.join(" | "), "---|".repeat(groups.len()))];
    for name in distinct(scored.iter().map(|run| run.name.as_str())) {
        let cells = groups.iter().map(|&group| {
            let Some(run) = scored.iter().find(|run| run.group == group && run.name == name) else {
                return String::new();
            };
            let mean = format!("{:.1} mm", 1000.0 * run.score.mean);
            let wrong = if run.score.wrong > 0 { format!(", {} wrong", run.score.wrong) } else { String::new() };
            let is_loop = group.starts_with("loop");
            let end = if is_loop { format!(", end {:.1} mm", 1000.0 * run.score.last) } else { String::new() };
            mean + &wrong + &end
        });
        rows.push(format!("| {name} | {} |\n", cells.collect::<Vec<_>>().join(" | ")));
    }
    rows.concat()
}

/// The runs of one kind together.
struct Sum {
    runs: usize,
    frames: usize,
    median_mean: f64,
    worst_mean: f64,
    worst_believed: f64,
    worst_last: f64,
    wrong: usize,
    flagged: usize,
    doubtful: usize,
    lost: usize,
    milliseconds: f64,
}

impl Sum {
    fn of<'a>(runs: impl Iterator<Item = &'a Scored>) -> Self {
        let scores: Vec<&Score> = runs.map(|run| &run.score).collect();
        let mut means: Vec<f64> = scores.iter().map(|score| score.mean).collect();
        means.sort_by(f64::total_cmp);
        let sum = |count: fn(&Score) -> usize| scores.iter().map(|score| count(score)).sum::<usize>();
        Self {
            runs: scores.len(),
            frames: sum(|score| score.frames),
            median_mean: means.get(means.len() / 2).copied().unwrap_or(f64::NAN),
            worst_mean: means.last().copied().unwrap_or(f64::NAN),
            worst_believed: scores.iter().map(|score| score.believed_mean).fold(0.0, f64::max),
            worst_last: scores.iter().map(|score| score.last).fold(0.0, f64::max),
            wrong: sum(|score| score.wrong),
            flagged: sum(|score| score.flagged),
            doubtful: sum(|score| score.doubtful),
            lost: sum(|score| score.lost),
            milliseconds: scores.iter().map(|score| score.milliseconds).sum::<f64>() / scores.len().max(1) as f64,
        }
    }
}

/// Each word once, in the order in which they come.
fn distinct<'a>(words: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut distinct = Vec::new();
    for word in words {
        if !distinct.contains(&word) {
            distinct.push(word);
        }
    }
    distinct
}
