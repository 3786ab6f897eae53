//! What is told of single frames, so that the same problem in many frames is one note.

use std::collections::HashMap;
use std::fmt;

use serde::{Deserialize, Serialize};

/// What could not be used of a frame or is unusual about it: `2.png: its colours are left out: 2.jpg: it is broken`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameNote {
    /// The frame, and the file that the note is about: `2.png: its colours are left out: 2.jpg`.
    pub subject: String,
    /// The rest, the same for all frames with this problem.
    pub reason: String,
}

impl fmt::Display for FrameNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.subject, self.reason)
    }
}

/// The notes as sentences in their order: the first frame with each reason, with the number of others.
pub(crate) fn merged(notes: &[FrameNote]) -> Vec<String> {
    let mut counts: HashMap<&str, usize> = HashMap::new();
    for note in notes {
        *counts.entry(&note.reason).or_default() += 1;
    }
    let sentence = |note: &FrameNote| match counts.remove(note.reason.as_str())? {
        1 => Some(note.to_string()),
        2 => Some(format!("{} (and 1 other frame): {}", note.subject, note.reason)),
        count => Some(format!("{} (and {} other frames): {}", note.subject, count - 1, note.reason)),
    };
    notes.iter().filter_map(sentence).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_problem_in_many_frames_is_one_note() {
        let note = |frame: usize, reason: &str| FrameNote {
            subject: format!("{frame}.png: its colours are left out: {frame}.jpg"),
            reason: reason.to_owned(),
        };
        let notes =
            [note(0, "wide"), note(1, "broken"), note(2, "wide"), note(3, "wide"), note(4, "cut"), note(5, "cut")];
        assert_eq!(
            merged(&notes),
            [
                "0.png: its colours are left out: 0.jpg (and 2 other frames): wide",
                "1.png: its colours are left out: 1.jpg: broken",
                "4.png: its colours are left out: 4.jpg (and 1 other frame): cut",
            ]
        );
    }
}
