//! CARMEN's logs, and what pose graph tools made of them.
//!
//! - `FLASER n r1 .. rn x y theta odom_x odom_y odom_theta time host time`: the pose of the laser, then the robot's;
//! - `ROBOTLASER1 type start_angle field_of_view angular_resolution maximum_range accuracy remission_mode n r1 .. rn
//!   m v1 .. vm laser_x laser_y laser_theta robot_x robot_y robot_theta tv rv forward side turn_axis time host time`;
//! - `RAWLASER1`, the same as far as the remissions, then times; the robot's pose is that of the last `ODOM x y theta ...`;
//! - `LASER_READING n r1 .. rn x y theta time`, by GMapping's viewer: the pose is the odometry's;
//! - `VERTEX2 id x y theta` before a scan: where a pose graph puts it; `PARAM name value` for the laser.
//!
//! Metres and radians. Lines of other words are stepped over. Of several lasers the front one's scans are read; `RLASER`,
//! `ROBOTLASER2` and `RAWLASER2` are the others'.

use super::fields::{Fields, are_nearly_all, decimal, is_comment, tolerate, words};
use super::lasers::one_laser;
use super::stated_limit::drop_false_limit;
use super::{Bearings, LaserLog, LaserScan, OdometryOrigin, common_offset, front_laser};
use crate::geometry::Pose2;
use crate::io::text::lines;
use crate::{Error, Result};

/// Kinds of lines that hold a scan, the preferred first.
const SCANS: [&[u8]; 4] = [b"ROBOTLASER1", b"FLASER", b"RAWLASER1", b"LASER_READING"];
/// Those of them whose lines do not tell the angles.
const PLAIN_SCANS: [&[u8]; 2] = [b"FLASER", b"LASER_READING"];
/// Words that begin a line of such a log.
const WORDS: [&[u8]; 10] = [
    b"FLASER",
    b"ROBOTLASER1",
    b"RAWLASER1",
    b"LASER_READING",
    b"ODOM",
    b"PARAM",
    b"VERTEX2",
    b"EDGE2",
    b"SYNC",
    b"RLASER",
];

/// Odometry has gaps where this number of scans in a row have no line of their own before them: lines may change places.
const MIN_STALE_SCANS: usize = 3;

/// Words that begin a scan of another laser than the front one.
const OTHER_LASERS: [&[u8]; 3] = [b"RLASER", b"ROBOTLASER2", b"RAWLASER2"];

/// Whether the beginning of a file is one of a CARMEN log.
pub(super) fn looks_like_carmen(head: &[u8]) -> bool {
    let first = |line: &[u8]| words(line).next().is_some_and(|word| WORDS.contains(&word));
    lines(head).map(|(_, line)| line).filter(|line| !is_comment(line)).take(3).any(first)
}

/// The log with the poses of its laser, which are judged once all are known.
struct Reader {
    scans: Vec<LaserScan>,
    /// The laser's pose in each scan's line, where there is one.
    laser_poses: Vec<Option<Pose2>>,
    /// Words after the readings in each scan's line.
    num_words_after: Vec<usize>,
    kind: &'static [u8],
    /// Scans that there were so far, those that could not be read among them.
    num_scans: usize,
    /// Scans of other lasers, and of other lines about the same one.
    num_others: usize,
    num_same: usize,
    vertex: Option<Pose2>,
    odometry: Option<Pose2>,
    /// Words of the `ODOM` line before the last one, and of the last one.
    num_odometry_words: [usize; 2],
    /// For each scan whose pose is that of an `ODOM` line its number, and how many such scans came after the line before it.
    since_odometry: Vec<(usize, usize)>,
    num_since_odometry: usize,
    /// Scans with a pose of their own after lines of odometry, each at another pose than the scan before; and those of them whose
    /// pose is that of the line.
    num_moved: usize,
    num_repeating: usize,
    field_of_view: Option<f64>,
    max_range: f64,
}

#[inline(never)]
pub(super) fn read(bytes: &[u8]) -> Result<LaserLog> {
    let kinds = |kind: &&&[u8]| lines(bytes).any(|(_, line)| begins_with(line, kind));
    let kind = SCANS.iter().find(kinds).copied().unwrap_or(SCANS[0]);
    let mut reader = Reader::new(kind);
    let mut damaged: Vec<Error> = Vec::new();
    let mut losses = Vec::new();
    for (line, text) in lines(bytes) {
        // A recorder that was switched off leaves half a line behind.
        let is_last = text.as_ptr_range().end == bytes.as_ptr_range().end && !text.is_empty();
        match reader.take(line, text) {
            Err(_) if is_last && !reader.scans.is_empty() => losses.push(cut_off(line)),
            Err(error) => damaged.push(error),
            Ok(()) if is_last && (reader.take_back_if_cut(line) || reader.is_cut(text)) => losses.push(cut_off(line)),
            Ok(()) => {}
        }
    }
    losses.extend(tolerate(&damaged, reader.scans.len())?);
    Ok(reader.finish(losses))
}

/// Whether this is the first word of a line.
#[inline(never)]
fn begins_with(line: &[u8], word: &[u8]) -> bool {
    words(line).next() == Some(word)
}

fn cut_off(line: usize) -> String {
    format!("Line {line}, the last one, is cut off and was left out.")
}

impl Reader {
    fn new(kind: &'static [u8]) -> Self {
        Self {
            scans: Vec::new(),
            laser_poses: Vec::new(),
            num_words_after: Vec::new(),
            kind,
            num_scans: 0,
            num_others: 0,
            num_same: 0,
            vertex: None,
            odometry: None,
            num_odometry_words: [0; 2],
            since_odometry: Vec::new(),
            num_since_odometry: 0,
            num_moved: 0,
            num_repeating: 0,
            field_of_view: None,
            max_range: f64::INFINITY,
        }
    }

    #[inline(never)]
    fn take(&mut self, line: usize, text: &[u8]) -> Result<()> {
        if is_comment(text) {
            return Ok(());
        }
        let mut fields = Fields::new(text, line);
        let Some(word) = fields.words.first().copied() else { return Ok(()) };
        fields.next = 1;
        match word {
            b"VERTEX2" => {
                fields.next = 2;
                self.vertex = Some(fields.pose("VERTEX2")?);
            }
            b"ODOM" => {
                self.odometry = Some(fields.pose("ODOM")?);
                self.num_odometry_words = [self.num_odometry_words[1], fields.words.len()];
                self.num_since_odometry = 0;
            }
            b"PARAM" => self.parameter(&fields),
            kind if kind == self.kind => {
                self.num_scans += 1;
                self.scan(&mut fields)?;
            }
            kind if OTHER_LASERS.contains(&kind) => self.num_others += 1,
            kind if SCANS.contains(&kind) => self.num_same += 1,
            _ => {}
        }
        Ok(())
    }

    /// Takes the scan of the file's last line back where the line lacks words that the one before has.
    fn take_back_if_cut(&mut self, line: usize) -> bool {
        let [.., before, last] = self.num_words_after[..] else { return false };
        let is_cut = last < before && self.scans.last().is_some_and(|scan| scan.line == line);
        if is_cut {
            self.scans.pop();
            self.laser_poses.pop();
            self.num_words_after.pop();
        }
        is_cut
    }

    /// Whether the file's last line, which is no scan, ends within its word or lacks words that the line of odometry before has.
    fn is_cut(&self, text: &[u8]) -> bool {
        let Some(word) = words(text).next().filter(|_| !is_comment(text)) else { return false };
        let [before, last] = self.num_odometry_words;
        let is_part = |whole: &&[u8]| whole.len() > word.len() && whole.starts_with(word);
        if word == b"ODOM" { last < before } else { WORDS.iter().any(is_part) && !WORDS.contains(&word) }
    }

    /// The longest gap between lines of odometry, where scans have their poses from these and nearly every one has its own.
    fn gap_of_odometry(&self) -> Option<String> {
        let num_fresh = self.since_odometry.iter().filter(|(_, since)| *since == 0).count();
        let &(last, since) =
            self.since_odometry.iter().max_by_key(|(number, since)| (*since, std::cmp::Reverse(*number)))?;
        // Those of the gap aside.
        let is_usual = num_fresh > since && are_nearly_all(num_fresh + since, self.since_odometry.len());
        (is_usual && since >= MIN_STALE_SCANS).then(|| {
            format!(
                "The log has no line of odometry (ODOM) between scans {} and {last}: for {since} scans the robot seems to stand \
                 still. Complete the log, or place its scans without odometry (odometry=none).",
                last - since
            )
        })
    }

    /// Parameters say what a FLASER line does not. Unknown ones, and such that are no numbers, are none of ours.
    fn parameter(&mut self, fields: &Fields<'_>) {
        let &[_, name, value, ..] = fields.words.as_slice() else { return };
        let Some(value) = decimal(value).filter(|value| value.is_finite() && *value > 0.0) else { return };
        match name {
            b"laser_front_laser_fov" => self.field_of_view = Some(value.to_radians()),
            b"robot_front_laser_max" | b"robot_frontlaser_max" => self.max_range = value,
            _ => {}
        }
    }

    fn scan(&mut self, fields: &mut Fields<'_>) -> Result<()> {
        let (bearings, max_range) = self.laser(fields)?;
        let ranges = fields.list("readings")?;
        if !PLAIN_SCANS.contains(&self.kind) && fields.next < fields.words.len() {
            fields.list("remissions")?;
        }
        let bearings = bearings.unwrap_or_else(|| front_laser(ranges.len(), self.field_of_view));
        let num_words_after = fields.left();
        let (laser, robot) = self.poses(fields)?;
        if self.kind == b"ROBOTLASER1" {
            fields.next += 5; // velocities, safety distances and the axis of turning
        }
        self.count_odometry(robot, num_words_after);
        let time = fields.words.get(fields.next).and_then(|word| decimal(word)).filter(|time| time.is_finite());
        let reference = self.vertex.take().or(robot);
        self.laser_poses.push(laser);
        self.num_words_after.push(num_words_after);
        self.scans.push(LaserScan {
            number: self.num_scans - 1,
            line: fields.line,
            bearings,
            ranges,
            max_range,
            time,
            reference,
            odometry: robot,
        });
        Ok(())
    }

    /// The bearings, where the line gives them, and the limit (m) of its laser.
    fn laser(&self, fields: &mut Fields<'_>) -> Result<(Option<Bearings>, f64)> {
        if PLAIN_SCANS.contains(&self.kind) {
            return Ok((None, self.max_range));
        }
        let [_, start, _, step, limit, _, _] = fields.numbers::<7>("what the laser is like")?;
        if step <= 0.0 {
            return Err(fields.fault(format!("The angle from beam to beam is {step}"), "It has to be above zero"));
        }
        Ok((Some(Bearings::Even { start, step }), if limit > 0.0 { limit } else { self.max_range }))
    }

    /// The poses of the laser and of the robot, which follow the readings.
    fn poses(&self, fields: &mut Fields<'_>) -> Result<(Option<Pose2>, Option<Pose2>)> {
        Ok(match self.kind {
            b"RAWLASER1" => (None, self.odometry),
            _ if fields.left() >= 6 => (Some(fields.pose("the laser's pose")?), Some(fields.pose("the robot's pose")?)),
            _ if fields.left() >= 3 && PLAIN_SCANS.contains(&self.kind) => {
                (None, Some(fields.pose("the robot's pose")?))
            }
            _ if fields.left() == 0 => (None, self.odometry),
            _ => {
                let problem = format!("After the readings there are {} of 6 numbers of poses", fields.left());
                return Err(fields.fault(problem, "The line may be cut off: complete it or remove it"));
            }
        })
    }

    /// Counts the scans since the last line of odometry, and those whose own pose repeats that line's.
    fn count_odometry(&mut self, robot: Option<Pose2>, num_words_after: usize) {
        let has_own_pose = num_words_after > 0 && self.kind != b"RAWLASER1";
        if robot.is_some() && !has_own_pose {
            self.since_odometry.push((self.num_scans - 1, self.num_since_odometry));
            self.num_since_odometry += 1;
        }
        let last = self.scans.last().and_then(|scan| scan.odometry);
        if has_own_pose && self.odometry.is_some() && robot != last {
            self.num_moved += 1;
            self.num_repeating += usize::from(robot == self.odometry);
        }
    }

    /// Where laser and robot keep their distance, that is the offset; where they do not, the laser's poses have been
    /// corrected afterwards and the robot's are what its wheels told.
    #[inline(never)]
    fn finish(mut self, mut losses: Vec<String>) -> LaserLog {
        let mut notes = self.notes();
        losses.extend(self.keep_one_laser());
        notes.extend(drop_false_limit(&mut self.scans));
        let poses = self.scans.iter().zip(&self.laser_poses);
        let pairs: Vec<(Pose2, Pose2)> = poses.filter_map(|(scan, laser)| Some((scan.odometry?, (*laser)?))).collect();
        let offset = common_offset(pairs.iter().copied());
        if offset.is_none() && !pairs.is_empty() {
            for (scan, laser) in self.scans.iter_mut().zip(&self.laser_poses) {
                scan.reference = laser.or(scan.reference);
            }
        }
        // All scans of a raw log repeat the `ODOM` line before, and none of four logs whose poses a program corrected.
        let is_repeated = self.num_moved > 0 && are_nearly_all(self.num_repeating, self.num_moved);
        let origin = if is_repeated { OdometryOrigin::RepeatsWheels } else { OdometryOrigin::Unknown };
        LaserLog {
            scans: self.scans,
            T_robot_laser: offset.unwrap_or_else(Pose2::identity),
            odometry_origin: origin,
            losses,
            notes,
            ..LaserLog::default()
        }
    }

    /// Lines that are no scans of the laser that is read.
    fn notes(&self) -> Vec<String> {
        let kind = String::from_utf8_lossy(self.kind);
        let mut notes = Vec::new();
        if self.num_others > 0 {
            let others = self.num_others;
            notes.push(format!(
                "{others} scans of another laser (RLASER, ROBOTLASER2) were left out: the front one's ({kind}) are placed."
            ));
        }
        if self.num_same > 0 {
            let same = self.num_same;
            notes.push(format!(
                "{same} lines of other kinds of scans were left out: {kind} lines tell more of the laser."
            ));
        }
        notes.extend(self.gap_of_odometry());
        notes
    }

    /// Leaves out the scans of other lasers under the same word, and says so.
    fn keep_one_laser(&mut self) -> Option<String> {
        let offset = |(scan, laser): (&LaserScan, &Option<Pose2>)| Some(scan.odometry?.inverse() * (*laser)?);
        let offsets: Vec<Option<Pose2>> = self.scans.iter().zip(&self.laser_poses).map(offset).collect();
        let (is_kept, loss) = one_laser(&self.scans, &offsets)?;
        let mut keep = is_kept.iter();
        self.scans.retain(|_| keep.next() == Some(&true));
        let mut keep = is_kept.iter();
        self.laser_poses.retain(|_| keep.next() == Some(&true));
        Some(loss)
    }
}
