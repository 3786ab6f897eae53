//! Where the frames were thought to be at each moment of a run: later knowledge moves them.

use crate::geometry::Pose3;

/// The poses of each frame over the run, one whenever it changed.
#[derive(Default)]
pub(super) struct PoseHistory {
    /// Of each frame: how many frames were registered when it got the pose, and `T_world_sensor`.
    changes: Vec<Vec<(usize, Pose3)>>,
}

impl PoseHistory {
    /// Keeps what has changed by the registration of the last of these frames.
    pub(super) fn record(&mut self, poses: &[Pose3]) {
        self.changes.resize_with(poses.len(), Vec::new);
        for (changes, pose) in self.changes.iter_mut().zip(poses) {
            if changes.last().is_none_or(|(_, last)| last != pose) {
                changes.push((poses.len(), *pose));
            }
        }
    }

    /// The poses of the first `num_registered` frames, as they were when that many were registered.
    pub(super) fn poses_of_first(&self, num_registered: usize) -> Vec<Pose3> {
        let at_that_time = |changes: &Vec<(usize, Pose3)>| {
            changes.iter().rev().find(|(registered, _)| *registered <= num_registered).map(|(_, pose)| *pose)
        };
        self.changes.iter().take(num_registered).filter_map(at_that_time).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_those_of_their_time() {
        let at = |x: f64| Pose3::translation(x, 0.0, 0.0);
        let mut history = PoseHistory::default();
        let moments = [vec![at(0.0)], vec![at(0.0), at(1.0)], vec![at(0.0), at(1.5), at(2.0)]];
        for poses in &moments {
            history.record(poses);
        }
        for poses in &moments {
            assert_eq!(history.poses_of_first(poses.len()), *poses);
        }
        assert_eq!(history.changes.iter().map(Vec::len).collect::<Vec<_>>(), [1, 2, 1]);
    }
}
