//! Where the ranges of a scan a line begin and end.

use std::f64::consts::{FRAC_PI_4, TAU};

use super::super::names::MIN_SCAN_NUMBERS;
use super::super::numbers::{MIN_GROWING_LINES, is_even_growth, is_time};
use super::super::rows::Table;
use super::Row;
use super::view::field_of_view;
use crate::io::laser_log::units::MAX_RADIANS;

/// What lasers write in place of a range.
const NO_RETURN: f64 = -1.0;

/// The columns of the ranges, from the first to before the second: as many as a known laser has, where that leaves nothing among
/// them that is no range and nothing beside them without need; and what is to be asked where they may lie elsewhere as well.
pub(super) fn block_of_ranges(table: &Table, rows: &[Row]) -> (usize, usize, Option<String>) {
    let width = table.width();
    let is_none: Vec<bool> = (0..width).map(|column| is_no_range(rows, column)).collect();
    let most = MIN_SCAN_NUMBERS.min(width - MIN_SCAN_NUMBERS);
    // From the outermost column that is no range; what grows may be a range that does.
    let front = (0..most).rev().find(|&column| is_none[column]).map_or(0, |column| column + 1);
    let back = (0..most).find(|&back| is_none[width - most + back]).map_or(0, |back| most - back);
    let beside = |extra: usize| (0..=extra).map(move |before| (front + before, back + extra - before));
    let fits = |&(front, back): &(usize, usize)| {
        let count = width.saturating_sub(front + back);
        count >= MIN_SCAN_NUMBERS && field_of_view(count).is_some()
    };
    let Some(extra) = (0..=most).find(|&extra| beside(extra).any(|place| fits(&place))) else {
        return (front, width - back, None);
    };
    // A clock or a counter is told from ranges, however large: its neighbour does not grow by one step.
    let are_clocks = |mut columns: std::ops::Range<usize>, inner: usize| {
        columns.all(|column| is_even_growth(rows, column)) && !is_even_growth(rows, inner)
    };
    let is_told = |&(f, b): &(usize, usize)| {
        extra > 0
            && (f == front || are_clocks(front..f, f))
            && (b == back || are_clocks(width - b..width - back, width - b - 1))
    };
    let told = beside(extra).filter(fits).find(is_told);
    let (front, back) = told.or_else(|| beside(extra).find(fits)).unwrap_or((front, back));
    let (first, end) = (front, width - back);
    if extra == 0 && field_of_view(end - first - 1).is_some() && is_apart(rows, first, end) {
        let [count, from] = [end - first - 1, first + 2];
        let doubt = format!("The {count} ranges may begin at column {from}, as is assumed, or one column before.");
        return (first + 1, end, Some(doubt));
    }
    let doubt = (extra > 0 && told.is_none()).then(|| {
        let [count, from] = [end - first, first + 1];
        format!("The {count} ranges may begin at column {from}, as is assumed, or up to {extra} further on.")
    });
    (first, end, doubt)
}

/// Neighbours of a reading that tell how much the readings of a line change from one to the next.
const NEIGHBORS: usize = 10;

/// A column differs from the next by this many times the largest change among its neighbours, where it is none of the ranges.
const APART: f64 = 3.0;

/// Whether a column has in every line a value far from what follows: a speed or a steering angle before the ranges.
fn is_apart(rows: &[Row], first: usize, end: usize) -> bool {
    let is_far = |row: &Row| {
        let Some(values) = row.values.get(first..end.min(first + NEIGHBORS + 2)) else { return false };
        let change = |pair: &[f64]| (pair[1] - pair[0]).abs();
        let largest = values[1..].windows(2).map(change).fold(0.0, f64::max);
        largest > 0.0 && change(&values[..2]) > APART * largest
    };
    rows.len() >= MIN_GROWING_LINES && rows.iter().all(is_far)
}

/// The ranges of lines that count them.
pub(super) struct CountedBlock {
    pub(super) first: usize,
    pub(super) end: usize,
    /// Of the first reading, and from one to the next (rad), where the lines tell.
    pub(super) bearings: Option<(f64, f64)>,
}

/// The columns of the ranges behind one that counts them, the same in every line. What is the same in every line as well, behind
/// the count, are the angles of the first and the last reading; nothing but a pose may follow the ranges.
pub(super) fn counted_block(rows: &[Row], width: usize) -> Option<CountedBlock> {
    let count_at = |column: usize| rows[0].values[column] as usize;
    let is_count = |&column: &usize| {
        let (count, behind) = (count_at(column), width - column - 1);
        let is_same = |row: &Row| row.values.get(column) == Some(&(count as f64));
        (MIN_SCAN_NUMBERS..=behind).contains(&count) && behind - count < MIN_SCAN_NUMBERS && rows.iter().all(is_same)
    };
    let column = (0..MIN_SCAN_NUMBERS.min(width)).find(is_count).filter(|_| rows.len() >= MIN_GROWING_LINES)?;
    let (count, behind) = (count_at(column), column + 1);
    let value = |column: usize| rows[0].values[column];
    let is_same = |column: &usize| rows.iter().all(|row| row.values.get(*column) == Some(&value(*column)));
    let num_constant = (behind..width - count).take_while(is_same).count();
    // Where the ranges do not change either, as of a robot that stands, nothing tells.
    let num_constant = if is_same(&(behind + num_constant)) { 0 } else { num_constant };
    let first = behind + num_constant;
    let bearings = match num_constant {
        0 => None,
        1 => angle_span(value(behind), -value(behind)),
        _ => angle_span(value(behind), value(behind + 1)),
    };
    let steps = (count - 1) as f64;
    Some(CountedBlock { first, end: first + count, bearings: bearings.map(|(start, view)| (start, view / steps)) })
}

/// The angle of the first reading and the view up to that of the last (rad), where two numbers can be those: radians, or degrees
/// where they are too large for that.
fn angle_span(start: f64, end: f64) -> Option<(f64, f64)> {
    let unit = if start.abs().max(end.abs()) > MAX_RADIANS { 1f64.to_radians() } else { 1.0 };
    let view = unit * (end - start);
    (start < 0.0 && view > FRAC_PI_4 && view < 1.01 * TAU).then_some((unit * start, view))
}

/// Whether a column can hold no ranges.
fn is_no_range(rows: &[Row], column: usize) -> bool {
    let is_word = rows.iter().any(|row| row.words.contains(&column));
    let is_negative = |row: &Row| row.values.get(column).is_some_and(|&value| value < 0.0 && value != NO_RETURN);
    is_word || rows.iter().any(is_negative) || is_time(rows, column)
}
