//! Cleaning a real recording.

use crate::common::shared_data;
use glam::Vec3;
use scanstitch::io::ply;
use scanstitch::preprocess::clean::{RangeLimits, clean, range_limit};

#[test]
fn the_laser_of_zju10_reports_50_metres_where_nothing_came_back() {
    let Some(folder) = shared_data("laser/zju10") else { return };
    let read = |index| ply::read(&std::fs::read(folder.join(format!("{index}.ply"))).unwrap()).unwrap().positions;
    let scans: Vec<Vec<Vec3>> = (0..10).map(read).collect();
    let max_range = range_limit(scans.iter().map(Vec::as_slice)).expect("four returns at 50 m");
    assert!((max_range - 50.0).abs() < 1e-4, "{max_range}");

    let limits = RangeLimits { min_range: 0.0, max_range };
    let at_limit: Vec<usize> = scans.iter().map(|scan| clean(scan, &limits).report.at_range_limit).collect();
    assert_eq!(at_limit, [1, 0, 0, 1, 0, 0, 0, 1, 0, 1]);
    // In single precision a return of 49.99999999 m is 50 m or just below: counted all the same.
    let exactly = RangeLimits { min_range: 0.0, max_range: 50.0 };
    assert_eq!(scans.iter().map(|scan| clean(scan, &exactly).report.at_range_limit).sum::<usize>(), 4);

    // A wall that gives the farthest returns of one scan alone, in steps of a centimetre, is no limit.
    for scan in [1, 2, 4, 5, 6, 8] {
        assert_eq!(range_limit([scans[scan].as_slice()]), None, "scan {scan}");
    }
}
