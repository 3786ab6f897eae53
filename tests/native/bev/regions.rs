//! Polygons and lines of one view in the other, cut where they stop being seen.

use scanstitch::camera::bev::BevStatus;
use scanstitch::camera::bev::presets::homework_views;

use super::chance::Chance;
use super::plain::{NUM_CASES, Plain, distance};

#[test]
fn polygons_hold_exactly_what_the_other_camera_sees() {
    let mut chance = Chance(3);
    let (mut num_clipped, mut num_inside) = (0, 0);
    for case in 0..NUM_CASES {
        let scene = chance.scene();
        let plain = Plain::of(&scene);
        let there = scene.front_from_top().unwrap();
        let count = 3 + (chance.unit() * 5.0) as usize;
        let corners: Vec<[f64; 2]> = (0..count).map(|_| chance.pixel(&scene.top)).collect();
        let polygon = there.polygon(&corners);
        num_clipped += usize::from(polygon.is_clipped);
        let size = [polygon.projected.len(), polygon.sources.len(), polygon.cuts.len()];
        assert_eq!(size, [polygon.marked.len(); 3]);
        for (index, &[u, v]) in polygon.projected.iter().enumerate() {
            assert!(there.projected.sees(u, v), "case {case}: within the image");
            if let Some(source) = polygon.sources[index] {
                assert_eq!(polygon.marked[index], corners[source]);
                assert!(distance(there.point(corners[source]).projected.unwrap(), [u, v]) < 1e-6);
            }
        }
        for _ in 0..40 {
            // A sample is in the clipped polygon where it is in the region and the other image shows it.
            let marked = chance.pixel(&scene.top);
            let seen = plain.front(marked);
            let is_seen =
                seen.depth > 0.0 && seen.depth_there > 0.0 && there.projected.sees(seen.pixel[0], seen.pixel[1]);
            let expected = is_seen && winding(&corners, marked) != 0;
            // Polygons that cut themselves are areas by winding number, which clipping keeps.
            if nearest_edge(&polygon.marked, marked) > 1e-6 {
                assert_eq!(
                    winding(&polygon.marked, marked) != 0,
                    expected,
                    "case {case}: {marked:?} in the marked view"
                );
            }
            if is_seen && nearest_edge(&polygon.projected, seen.pixel) > 1e-6 {
                let found = winding(&polygon.projected, seen.pixel) != 0;
                assert_eq!(found, expected, "case {case}: {marked:?} in the other view");
                num_inside += usize::from(found);
            }
        }
    }
    assert!(num_clipped > 300 && num_inside > 500, "{num_clipped} clipped, {num_inside} samples inside");
}

#[test]
fn lines_are_cut_where_their_points_stop_being_seen() {
    let mut chance = Chance(4);
    let mut num_cut = 0;
    for case in 0..NUM_CASES {
        let scene = chance.scene();
        let there = scene.front_from_top().unwrap();
        let ends = [chance.pixel(&scene.top), chance.pixel(&scene.top)];
        let segment = there.segment(ends);
        for step in 0..=50 {
            let share = f64::from(step) / 50.0;
            let marked = std::array::from_fn(|i| ends[0][i] + (ends[1][i] - ends[0][i]) * share);
            let is_seen = there.point(marked).status == BevStatus::Visible;
            let along = |p: [f64; 2]| distance(p, ends[0]) / distance(ends[1], ends[0]);
            let kept = segment.map(|segment| segment.marked.map(along));
            let is_kept = kept.is_some_and(|[begin, end]| (begin..=end).contains(&share));
            let is_edge = kept.is_some_and(|kept| kept.iter().any(|end| (end - share).abs() < 1e-9));
            assert!(is_kept == is_seen || is_edge, "case {case}, {share}");
            num_cut += usize::from(step == 0 && kept.is_some_and(|[begin, end]| begin > 0.0 || end < 1.0));
        }
        if let Some(segment) = segment {
            for (marked, projected) in segment.marked.into_iter().zip(segment.projected) {
                assert!(there.projected.sees(projected[0], projected[1]));
                if let Some(pixel) = there.point(marked).projected {
                    assert!(distance(pixel, projected) < 1e-5, "case {case}");
                }
            }
        }
    }
    assert!(num_cut > 100, "{num_cut}");
}

#[test]
fn a_region_that_reaches_behind_the_camera_is_cut_and_not_mirrored() {
    // In the homework's views the camera stands over the middle of the top view; below it is behind the camera.
    let there = homework_views().front_from_top().unwrap();
    let corners = [[200.0, 60.0], [310.0, 60.0], [310.0, 400.0], [200.0, 400.0]];
    assert_eq!(there.point(corners[2]).status, BevStatus::BehindCamera);
    assert_eq!(there.point(corners[2]).projected, None);
    let polygon = there.polygon(&corners);
    assert!(polygon.is_clipped);
    // Lower edge of the image: 1 m below and 1 m (less half a pixel) ahead of the camera.
    let lowest = 511.5;
    let ahead = 256.0 / (lowest - 256.0);
    assert_eq!(polygon.sources, [Some(0), Some(1), None, None]);
    assert_eq!(polygon.cuts, [false, false, true, false]);
    for index in [2, 3] {
        assert!((polygon.projected[index][1] - lowest).abs() < 1e-9);
        assert!((polygon.marked[index][1] - (256.0 - 256.0 * ahead / 2.5)).abs() < 1e-9);
    }
    // Wholly behind: nothing is left. Nothing hidden: nothing is cut.
    let behind = there.polygon(&[[200.0, 300.0], [310.0, 300.0], [250.0, 400.0]]);
    assert_eq!((behind.marked.len(), behind.is_clipped), (0, true));
    let ahead = there.polygon(&[[200.0, 50.0], [310.0, 50.0], [250.0, 100.0]]);
    assert_eq!((ahead.marked.len(), ahead.is_clipped), (3, false));
    // A concave region that is cut into two: the edge that joins the parts is marked as a cut.
    let comb =
        [[170.0, 60.0], [350.0, 60.0], [350.0, 300.0], [300.0, 300.0], [250.0, 80.0], [200.0, 300.0], [170.0, 300.0]];
    let polygon = there.polygon(&comb);
    let cut_rows = polygon.cuts.iter().enumerate().filter(|(_, cut)| **cut).map(|(i, _)| polygon.projected[i][1]);
    assert_eq!(polygon.cuts.iter().filter(|&&cut| cut).count(), 2);
    for row in cut_rows {
        assert!((row - lowest).abs() < 1e-9);
    }
}

/// How often a polygon goes around a place.
fn winding(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> i32 {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    edges
        .map(|(&[x0, y0], &[x1, y1])| {
            let side = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0);
            i32::from(y0 <= y && y1 > y && side > 0.0) - i32::from(y0 > y && y1 <= y && side < 0.0)
        })
        .sum()
}

/// Distance of a place from the nearest edge of a polygon.
fn nearest_edge(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    edges.fold(f64::INFINITY, |best, (&[x0, y0], &[x1, y1])| {
        let (dx, dy) = (x1 - x0, y1 - y0);
        let length = dx * dx + dy * dy;
        let share = if length > 0.0 { (((x - x0) * dx + (y - y0) * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
        best.min((x - x0 - share * dx).hypot(y - y0 - share * dy))
    })
}
