//! The words and numbers on the lines of a text log.

use super::pose;
use crate::geometry::Pose2;
use crate::io::limits::MAX_BEAMS;
use crate::io::text::{number, quote};
use crate::{Error, Result};

/// Largest share of a log's lines or scans that are exceptions, one in twenty: beyond it, what the others show does not hold for the log.
const MAX_EXCEPTIONS: f64 = 0.05;

/// Whether so many of a log's scans are all but exceptions.
pub(super) fn are_nearly_all(count: usize, num_scans: usize) -> bool {
    are_exceptions(num_scans.saturating_sub(count), num_scans)
}

/// Whether so few of a log's scans are exceptions.
pub(super) fn are_exceptions(count: usize, num_scans: usize) -> bool {
    count as f64 <= MAX_EXCEPTIONS * num_scans as f64
}

/// Number of damaged lines that are reported one by one.
const MOST_TOLD: usize = 3;

/// What to say of damaged lines, which are left out.
///
/// # Errors
/// The first of them, where they are too many for the number of scans.
pub(super) fn tolerate(damaged: &[Error], num_scans: usize) -> Result<Vec<String>> {
    if let Some(first) = damaged.first()
        && !are_exceptions(damaged.len(), num_scans)
    {
        return Err(first.clone());
    }
    let told = damaged.iter().take(MOST_TOLD).map(|error| format!("A line was left out. {}", capitalized(error)));
    let more = damaged.len().saturating_sub(MOST_TOLD);
    Ok(told.chain((more > 0).then(|| format!("{more} more damaged lines were left out."))).collect())
}

/// An error as a sentence.
fn capitalized(error: &Error) -> String {
    let text = error.to_string();
    text.strip_prefix("line").map_or_else(|| text.clone(), |rest| format!("Line{rest}"))
}

/// The words of a line, taken one after the other.
pub(super) struct Fields<'a> {
    pub words: Vec<&'a [u8]>,
    /// Of the next word.
    pub next: usize,
    pub line: usize,
}

impl<'a> Fields<'a> {
    pub fn new(text: &'a [u8], line: usize) -> Self {
        Self { words: words(text).collect(), next: 0, line }
    }

    pub fn left(&self) -> usize {
        self.words.len().saturating_sub(self.next)
    }

    pub fn fault(&self, problem: String, remedy: &str) -> Error {
        Error::line(self.line, problem, remedy)
    }

    pub fn number(&mut self, what: &str) -> Result<f64> {
        let Some(word) = self.words.get(self.next) else {
            return Err(self.fault(format!("The line ends before {what}"), "Complete the line or remove it"));
        };
        let value = decimal(word).ok_or_else(|| {
            self.fault(
                format!("{} in the place of {what} is not a number", quote(word)),
                "Correct the line or remove it",
            )
        })?;
        self.next += 1;
        Ok(value)
    }

    pub fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.number(what)?;
            if !value.is_finite() {
                return Err(self.fault(format!("{value} in the place of {what} is not finite"), "Correct the line"));
            }
        }
        Ok(values)
    }

    pub fn pose(&mut self, what: &str) -> Result<Pose2> {
        let [x, y, theta] = self.numbers::<3>(what)?;
        pose(x, y, theta).ok_or_else(|| self.fault(format!("{what} is not finite"), "Correct the line"))
    }

    /// A count and as many numbers. NaN and infinite readings stand for none.
    pub fn list(&mut self, what: &str) -> Result<Vec<f32>> {
        let count = self.number(&format!("the number of {what}"))?;
        let most = self.left().min(MAX_BEAMS);
        if !(count >= 0.0 && count.fract() == 0.0 && count <= most as f64) {
            let problem = format!("The line announces {count} {what}, and {} words follow", self.left());
            return Err(self.fault(problem, "The line may be cut off: complete it or remove it"));
        }
        let mut values = Vec::with_capacity(count as usize);
        for _ in 0..count as usize {
            let value = self.number(what)? as f32;
            values.push(if value.is_finite() && value >= 0.0 { value } else { f32::NAN });
        }
        Ok(values)
    }
}

/// A number with a decimal point or, as programs write it under some locales, a decimal comma: between words that blanks separate, a
/// comma is nothing else.
pub(super) fn decimal(word: &[u8]) -> Option<f64> {
    number(word).or_else(|| {
        let comma = word.iter().position(|&byte| byte == b',')?;
        let with_point: Vec<u8> = [&word[..comma], b".", &word[comma + 1..]].concat();
        number(&with_point).filter(|_| !word.contains(&b'.'))
    })
}

pub(super) fn is_comment(line: &[u8]) -> bool {
    line.iter().find(|byte| !byte.is_ascii_whitespace()).is_none_or(|&byte| byte == b'#')
}

pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}
