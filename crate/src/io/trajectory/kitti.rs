//! KITTI's form: the upper three rows of a pose's matrix in one line, 12 numbers. Times are in a file of their own.

use super::MatrixPose;

pub(super) fn text(poses: &[MatrixPose]) -> String {
    let line = |(R, t): &MatrixPose| {
        let row = |row: usize| format!("{:?} {:?} {:?} {:?}", R[(row, 0)], R[(row, 1)], R[(row, 2)], t[row]);
        format!("{} {} {}\n", row(0), row(1), row(2))
    };
    poses.iter().map(line).collect()
}
