//! Which clouds are certain relative to each other.
//!
//! A good registration tells where a cloud is relative to the clouds that it lies on. After a doubtful one, which becomes part of the map
//! as well, clouds may be good relative to it alone: they are then another part, and only the largest part is known as a whole.

use crate::geometry::connected_parts::connected_parts;

/// The registered clouds, by their numbers in the order of registration, and what connects them.
#[derive(Default)]
pub(super) struct Parts {
    is_good: Vec<bool>,
    /// Of two clouds that good registrations connect; none within a part.
    edges: Vec<[usize; 2]>,
}

impl Parts {
    /// Number of clouds.
    pub fn len(&self) -> usize {
        self.is_good.len()
    }

    /// Whether all clouds are certain relative to each other.
    pub fn are_one(&self) -> bool {
        self.edges.len() + 1 >= self.len()
    }

    /// For each cloud the first one of its part.
    pub fn firsts(&self) -> Vec<usize> {
        connected_parts(self.len(), self.edges.iter().copied())
    }

    /// Adds a cloud. `on`: a cloud of each part that it lies on.
    pub fn add(&mut self, is_good: bool, on: impl IntoIterator<Item = usize>) {
        let number = self.len();
        self.is_good.push(is_good);
        self.edges.extend(on.into_iter().filter(|_| is_good).map(|other| [other, number]));
    }

    /// Connects two clouds that were found to be certain relative to each other.
    pub fn connect(&mut self, clouds: [usize; 2]) {
        let firsts = self.firsts();
        if firsts[clouds[0]] != firsts[clouds[1]] {
            self.edges.push(clouds);
        }
    }

    /// For each cloud, whether it is in the part with most good clouds; the first of these, where there are several.
    pub fn are_in_largest(&self) -> Vec<bool> {
        let firsts = self.firsts();
        let mut num_good = vec![0; self.len()];
        for (first, _) in firsts.iter().zip(&self.is_good).filter(|(_, is_good)| **is_good) {
            num_good[*first] += 1;
        }
        let largest = (0..self.len()).rev().max_by_key(|&first| num_good[first]);
        firsts.into_iter().map(|first| Some(first) == largest).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_after_a_doubtful_one_are_another_part_until_one_lies_on_both() {
        let mut parts = Parts::default();
        parts.add(true, []);
        parts.add(true, [0]);
        assert!(parts.are_one());
        parts.add(false, [0]);
        parts.add(true, [2]);
        assert!(!parts.are_one());
        assert_eq!(parts.firsts(), [0, 0, 2, 2]);
        assert_eq!(parts.are_in_largest(), [true, true, false, false]);
        parts.add(true, [2]);
        assert_eq!(parts.are_in_largest(), [true, true, false, false, false], "as many: the first");
        parts.add(true, [2]);
        assert_eq!(parts.are_in_largest(), [false, false, true, true, true, true]);
        parts.add(true, [0, 2]);
        assert!(parts.are_one());
        assert_eq!(parts.are_in_largest(), [true; 7]);
        parts.add(false, [6]);
        parts.add(true, [7]);
        assert_eq!(parts.are_in_largest()[7..], [false, false]);
        parts.connect([1, 8]);
        parts.connect([8, 1]);
        assert_eq!(parts.firsts(), [0; 9], "a loop leads past the doubtful one");
    }
}
