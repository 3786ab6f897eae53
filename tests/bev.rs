//! Bird's-eye view: the published numbers, a plain matrix evaluation, a sampled reference, and everything degenerate.
#![allow(non_snake_case)] // the names of the equations

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3, Vector4};
use scanstitch::camera::bev::axes::{AXES, EULER_ORDERS};
use scanstitch::camera::bev::points::{PAIR_COLUMNS, POINT_COLUMNS, points_csv, read_pixels};
use scanstitch::camera::bev::presets::{homework_numbers, homework_views};
use scanstitch::camera::bev::scene::other_field_of_view;
use scanstitch::camera::bev::warp::warp_rows;
use scanstitch::camera::bev::{
    BevAxes, BevCamera, BevIntrinsics, BevLayout, BevPair, BevParameter, BevPlane, BevPose, BevPoseKind,
    BevRefinementOptions, BevRole, BevScene, BevSide, BevStatus, WholePixels, presets, refine,
};

/// Uniform numbers: a multiply-with-carry generator, enough for choosing cases.
struct Chance(u64);

impl Chance {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.unit() * all.len() as f64) as usize]
    }

    /// A camera about 1 to 3 m above the ground that may look anywhere, in our own world: x right, y down, z forward.
    fn camera(&mut self, axes: BevAxes) -> BevCamera {
        let (width, height) = (self.within(100.0, 2000.0) as usize, self.within(100.0, 2000.0) as usize);
        let intrinsics = if self.unit() < 0.5 {
            let side = self.one_of(&[BevSide::Horizontal, BevSide::Vertical]);
            BevIntrinsics::FieldOfView { field_of_view: self.within(0.4, 2.4), side }
        } else {
            let [fx, fy] = [(); 2].map(|()| self.within(150.0, 1500.0));
            let [cx, cy] = [width, height].map(|size| size as f64 * self.within(0.3, 0.7));
            BevIntrinsics::Focal { fx, fy, cx, cy }
        };
        let W = axes.R_named_world();
        let place = Vector3::new(self.within(-2.0, 2.0), -self.within(0.7, 3.0), self.within(-2.0, 2.0));
        let position: [f64; 3] = (W * place).into();
        // Mostly looking somewhere down, at times upwards or on its side.
        let order = self.one_of(&EULER_ORDERS);
        let ours = yaw_pitch_roll([self.within(-PI, PI), -self.within(-0.2, 1.6), self.within(-0.6, 0.6)]);
        let named = W * ours * axes.R_named_camera().transpose();
        let pose = match (self.unit() * 3.0) as usize {
            0 => BevPose::Euler { position, order, angles: order.angles(&named) },
            1 => {
                let q = nalgebra::UnitQuaternion::from_matrix(&named);
                let scale = self.within(0.5, 2.0); // of no consequence
                BevPose::Quaternion { position, qx: q.i * scale, qy: q.j * scale, qz: q.k * scale, qw: q.w * scale }
            }
            _ => {
                let row = |i: usize| [named[(i, 0)], named[(i, 1)], named[(i, 2)], position[i]];
                BevPose::Matrix { T_world_camera: [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]] }
            }
        };
        BevCamera { image: None, width, height, intrinsics, pose }
    }

    fn scene(&mut self) -> BevScene {
        let axes = self.one_of(&AXES);
        let plane = if self.unit() < 0.5 {
            BevPlane::Level { height: self.within(-0.3, 0.3) }
        } else {
            let tilt = Vector3::from_fn(|_, _| self.within(-0.2, 0.2));
            let normal = (axes.up() + tilt) * self.one_of(&[1.0, 2.5, -1.0]);
            BevPlane::Tilted { normal: normal.into(), offset: self.within(-0.1, 0.1) }
        };
        BevScene { axes, plane, top: self.camera(axes), front: self.camera(axes) }
    }

    fn pixel(&mut self, camera: &BevCamera) -> [f64; 2] {
        [camera.width, camera.height].map(|size| self.within(-0.5, size as f64 - 0.5))
    }
}

/// Yaw about down, pitch about right, roll about forward.
fn yaw_pitch_roll([yaw, pitch, roll]: [f64; 3]) -> Matrix3<f64> {
    turn(1, yaw) * turn(0, pitch) * turn(2, roll)
}

/// A rotation about an axis, written out.
fn turn(axis: usize, angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    match axis {
        0 => Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
        1 => Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
        _ => Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
    }
}

/// The plain evaluation: 4 x 4 matrices put together and inverted in full, sharing no line with the engine.
struct Plain {
    /// 3 x 4: world to pixels, up to scale; the scale is the depth.
    P_top: Matrix3x4<f64>,
    P_front: Matrix3x4<f64>,
    plane: Vector4<f64>,
}

impl Plain {
    fn of(scene: &BevScene) -> Self {
        let plane = match scene.plane {
            BevPlane::Level { height } => match scene.axes {
                BevAxes::ThreeJs | BevAxes::Habitat => Vector4::new(0.0, 1.0, 0.0, -height),
                BevAxes::Opencv => Vector4::new(0.0, -1.0, 0.0, -height),
                BevAxes::Robotics | BevAxes::RosOptical => Vector4::new(0.0, 0.0, 1.0, -height),
            },
            BevPlane::Tilted { normal: [a, b, c], offset } => Vector4::new(a, b, c, -offset),
        };
        Self {
            P_top: Self::projection(scene.axes, &scene.top),
            P_front: Self::projection(scene.axes, &scene.front),
            plane,
        }
    }

    fn projection(axes: BevAxes, camera: &BevCamera) -> Matrix3x4<f64> {
        let (width, height) = (camera.width as f64, camera.height as f64);
        let [fx, fy, cx, cy] = match camera.intrinsics {
            BevIntrinsics::Focal { fx, fy, cx, cy } => [fx, fy, cx, cy],
            BevIntrinsics::FieldOfView { field_of_view, side } => {
                let size = if side == BevSide::Horizontal { width } else { height };
                let f = size / (2.0 * (field_of_view / 2.0).tan());
                [f, f, width / 2.0, height / 2.0]
            }
        };
        let T = match camera.pose {
            BevPose::Matrix { T_world_camera: rows } => Matrix4::from_fn(|i, j| rows[i][j]),
            BevPose::Quaternion { position: p, qx, qy, qz, qw } => {
                let n = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
                let (x, y, z, w) = (qx / n, qy / n, qz / n, qw / n);
                #[rustfmt::skip]
                let T = Matrix4::new(
                    1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w), p[0],
                    2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w), p[1],
                    2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y), p[2],
                    0.0, 0.0, 0.0, 1.0,
                );
                T
            }
            BevPose::Euler { position, order, angles: [x, y, z] } => {
                let [x, y, z] = [turn(0, x), turn(1, y), turn(2, z)];
                let R = match format!("{order:?}").as_str() {
                    "XYZ" => x * y * z,
                    "YZX" => y * z * x,
                    "ZXY" => z * x * y,
                    "XZY" => x * z * y,
                    "YXZ" => y * x * z,
                    _ => z * y * x,
                };
                Matrix4::new_translation(&position.into()) * R.to_homogeneous()
            }
        };
        // Rows: right, down and forward in the camera's named axes.
        #[rustfmt::skip]
        let axes = match axes {
            BevAxes::ThreeJs | BevAxes::Habitat => Matrix4::new(1.,0.,0.,0., 0.,-1.,0.,0., 0.,0.,-1.,0., 0.,0.,0.,1.),
            BevAxes::Opencv | BevAxes::RosOptical => Matrix4::identity(),
            BevAxes::Robotics => Matrix4::new(0.,-1.,0.,0., 0.,0.,-1.,0., 1.,0.,0.,0., 0.,0.,0.,1.),
        };
        let K = Matrix3x4::new(fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0);
        K * axes * T.try_inverse().unwrap()
    }

    /// The point of the plane that a pixel sees: three linear equations, solved in full. Pixel, depth and point.
    fn follow(from: &Matrix3x4<f64>, to: &Matrix3x4<f64>, plane: &Vector4<f64>, [u, v]: [f64; 2]) -> Seen {
        let rows = [from.row(0) - from.row(2) * u, from.row(1) - from.row(2) * v, plane.transpose()];
        let A = Matrix3::from_fn(|i, j| rows[i][j]);
        let b = Vector3::from_fn(|i, _| -rows[i][3]);
        let X = A.try_inverse().expect("a plane that is not seen edge on") * b;
        let X = X + A.try_inverse().unwrap() * (b - A * X); // one step of iterative refinement
        let (near, far) = (from * X.push(1.0), to * X.push(1.0));
        Seen { depth: near.z, ground: X, depth_there: far.z, pixel: [far.x / far.z, far.y / far.z] }
    }

    fn front(&self, pixel: [f64; 2]) -> Seen {
        Self::follow(&self.P_top, &self.P_front, &self.plane, pixel)
    }

    fn top(&self, pixel: [f64; 2]) -> Seen {
        Self::follow(&self.P_front, &self.P_top, &self.plane, pixel)
    }
}

struct Seen {
    depth: f64,
    ground: Vector3<f64>,
    depth_there: f64,
    pixel: [f64; 2],
}

const NUM_CASES: usize = 1000;

fn distance([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    (a - c).hypot(b - d)
}

#[test]
fn both_published_sets_land_on_exactly_their_integers() {
    type Pixels<'a> = &'a [[f64; 2]];
    let sets: [(Pixels, Pixels); 2] = [
        (
            &[[239.0, 141.0], [258.0, 314.0], [368.0, 211.0], [360.0, 123.0]],
            &[[247.0, 387.0], [257.0, 457.0], [322.0, 408.0], [307.0, 382.0]],
        ),
        (
            &[[145.0, 87.0], [215.0, 301.0], [356.0, 372.0], [424.0, 211.0], [295.0, 70.0]],
            &[[204.0, 374.0], [225.0, 449.0], [351.0, 500.0], [356.0, 408.0], [273.0, 370.0]],
        ),
    ];
    for axes in AXES {
        let scene = homework_numbers().in_axes(axes).unwrap();
        let (there, back) = (scene.front_from_top().unwrap(), scene.top_from_front().unwrap());
        for (marked, expected) in sets {
            for (&marked, &expected) in marked.iter().zip(expected) {
                let point = there.point(marked);
                assert_eq!(point.status, BevStatus::Visible);
                assert_eq!(point.in_whole_pixels(WholePixels::Truncated).projected, Some(expected), "{axes:?}");
                let again = back.point(point.projected.unwrap()).projected.unwrap();
                assert!(distance(again, marked) < 1e-9, "{again:?} in place of {marked:?}");
            }
        }
    }
    // By hand: the floor 1 m below and 2 m ahead is half as far down as it is far.
    let ahead = homework_numbers().front_from_top().unwrap().point([256.0, 128.0]);
    let [x, y, z] = ahead.ground.unwrap();
    assert!(x.abs() < 1e-12 && y.abs() < 1e-12 && (z + 2.0).abs() < 1e-12);
    assert!(distance(ahead.projected.unwrap(), [256.0, 384.0]) < 1e-9);
}

#[test]
fn whole_pixels_are_cut_or_rounded() {
    let cases = [(387.3, 387.0, 387.0), (387.5, 387.0, 388.0), (-0.7, 0.0, -1.0), (-0.4, 0.0, 0.0), (5.0, 5.0, 5.0)];
    for (given, truncated, rounded) in cases {
        for (whole, expected) in
            [(WholePixels::Exact, given), (WholePixels::Truncated, truncated), (WholePixels::Rounded, rounded)]
        {
            let found = whole.apply(given);
            assert_eq!((found, found.is_sign_negative()), (expected, expected < 0.0), "{whole:?} of {given}");
        }
    }
    // What is a whole number but for rounding errors stays that number.
    assert_eq!(WholePixels::Truncated.apply(386.999_999_999_999_9), 387.0);
    assert_eq!(WholePixels::Truncated.apply(386.999_9), 386.0);
}

#[test]
fn random_scenes_agree_with_the_plain_matrices_both_ways() {
    let mut chance = Chance(1);
    let mut counts = [0; 4];
    for case in 0..NUM_CASES {
        let scene = chance.scene();
        let plain = Plain::of(&scene);
        let (there, back) = (scene.front_from_top().unwrap(), scene.top_from_front().unwrap());
        let homography = there.homography();
        for _ in 0..20 {
            let marked = chance.pixel(&scene.top);
            let (point, seen) = (there.point(marked), plain.front(marked));
            counts[point.status as usize] += 1;
            assert_eq!(point.ground.is_some(), seen.depth > 0.0, "case {case}");
            let Some(ground) = point.ground else { continue };
            assert_eq!(point.projected.is_some(), seen.depth_there > 0.0, "case {case}");
            let allowed = 1e-9 * seen.ground.norm().max(1.0).powi(2);
            assert!((Vector3::from(ground) - seen.ground).norm() < allowed, "case {case}: {ground:?}");
            if point.status != BevStatus::Visible {
                continue;
            }
            let pixel = point.projected.unwrap();
            assert!(distance(pixel, seen.pixel) < 1e-9, "case {case}: {pixel:?}, {:?}", seen.pixel);
            let p = homography * Vector3::new(marked[0], marked[1], 1.0);
            assert!(distance([p.x / p.z, p.y / p.z], pixel) < 1e-9, "case {case}: the homography");

            // And back: as exactly as the way back is steep.
            let (again, seen) = (back.point(pixel), plain.top(pixel));
            let step = distance(plain.top([pixel[0] + 1e-6, pixel[1] + 1e-6]).pixel, seen.pixel) / 1e-6;
            let allowed = 1e-9 * step.max(1.0);
            assert!(distance(again.projected.unwrap(), marked) < allowed, "case {case}: back");
            assert!(distance(again.projected.unwrap(), seen.pixel) < allowed, "case {case}: back, plainly");
        }
    }
    assert!(counts.iter().all(|&count| count > 500), "each status is met often: {counts:?}");
}

#[test]
fn changing_the_axes_and_the_kind_of_pose_changes_no_pixel() {
    let mut chance = Chance(2);
    for _ in 0..NUM_CASES {
        let scene = chance.scene();
        let kinds = [BevPoseKind::Euler, BevPoseKind::Quaternion, BevPoseKind::Matrix];
        let other = scene.with_poses(chance.one_of(&kinds), chance.one_of(&EULER_ORDERS)).unwrap();
        let other = other.in_axes(chance.one_of(&AXES)).unwrap();
        let (before, after) = (scene.front_from_top().unwrap(), other.front_from_top().unwrap());
        for _ in 0..5 {
            let marked = chance.pixel(&scene.top);
            let (a, b) = (before.point(marked), after.point(marked));
            // A pixel right at a border may fall on either side of it.
            if let (BevStatus::Visible, BevStatus::Visible) = (a.status, b.status) {
                assert!(distance(a.projected.unwrap(), b.projected.unwrap()) < 1e-9);
            } else {
                let [u, v] = a.projected.or(b.projected).unwrap_or([-9.0, -9.0]);
                let inside = before.projected.sees(u, v);
                assert!(a.status == b.status || !inside, "{a:?} {b:?}");
            }
        }
    }
}

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

#[test]
fn the_vertical_field_of_view_follows_through_the_tangent() {
    // 640 x 480 at 90 degrees: f = 320, so the vertical one is 2 atan(240 / 320) = 73.74 degrees, eq. (2).
    let vertical = other_field_of_view(FRAC_PI_2, 640, 480);
    assert!((vertical.to_degrees() - 73.739_795_291_688_04).abs() < 1e-9);
    assert!((other_field_of_view(vertical, 480, 640) - FRAC_PI_2).abs() < 1e-15);
    let mut scene = homework_views();
    for camera in [&mut scene.top, &mut scene.front] {
        (camera.width, camera.height) = (640, 480);
    }
    let right = scene.front_from_top().unwrap();
    assert!((right.projected.fields_of_view()[1] - vertical).abs() < 1e-12);
    // Given by its vertical field of view it is the same camera.
    scene.front.intrinsics = BevIntrinsics::FieldOfView { field_of_view: vertical, side: BevSide::Vertical };
    let marked = [400.0, 60.0];
    let expected = right.point(marked).projected.unwrap();
    assert!(distance(scene.front_from_top().unwrap().point(marked).projected.unwrap(), expected) < 1e-9);

    // A published solution scales the angle: 90 x 480 / 640 = 67.5 degrees, so fy = 240 / tan(33.75 deg) = 359.2.
    let wrong_angle: f64 = FRAC_PI_2 * 480.0 / 640.0;
    let wrong_fy = 240.0 / (wrong_angle / 2.0).tan();
    assert!((wrong_fy - 359.19).abs() < 0.01);
    for camera in [&mut scene.top, &mut scene.front] {
        camera.intrinsics = BevIntrinsics::Focal { fx: 320.0, fy: wrong_fy, cx: 320.0, cy: 240.0 };
    }
    let wrong = scene.front_from_top().unwrap().point(marked).projected.unwrap();
    assert!(distance(wrong, expected) > 50.0, "{wrong:?} and {expected:?}");
    // In square images both agree, which is why it went unseen.
    assert!((other_field_of_view(FRAC_PI_2, 512, 512) - FRAC_PI_2).abs() < 1e-15);
}

#[test]
fn refinement_finds_how_the_camera_stood() {
    let mut chance = Chance(5);
    let mut num_refined = 0;
    for case in 0..200 {
        let role = chance.one_of(&[BevRole::Front, BevRole::Top]);
        let axes = chance.one_of(&AXES);
        let truth = homework_views().in_axes(axes).unwrap();
        // Pairs that the true cameras show, measured to 0 px: what is recovered must be the truth itself.
        let exact = truth.front_from_top().unwrap();
        let pairs: Vec<BevPair> = std::iter::repeat_with(|| [chance.within(20.0, 490.0), chance.within(20.0, 140.0)])
            .filter_map(|top| exact.point(top).projected.map(|front| BevPair { top, front }))
            .take(6)
            .collect();
        // The user's guess: a camera that was moved and turned.
        let mut guess = truth.in_axes(BevAxes::ThreeJs).unwrap();
        let camera = if role == BevRole::Front { &mut guess.front } else { &mut guess.top };
        let BevPose::Euler { position, angles, .. } = &mut camera.pose else { unreachable!("angles stay angles") };
        let shifts = [chance.within(-0.3, 0.3), chance.within(-0.2, 0.2), chance.within(-0.15, 0.15)];
        let pitch = chance.within(-0.1, 0.1);
        position.iter_mut().zip(shifts).for_each(|(value, shift)| *value += shift);
        angles[0] += pitch;
        let guess = guess.in_axes(axes).unwrap();
        let options = BevRefinementOptions { camera: role, ..BevRefinementOptions::default() };
        let found = refine(&guess, &pairs, &options).unwrap();
        assert!(found.converged, "case {case}");
        assert!(found.rmse < 1e-6 && found.rmse_before > 0.1, "case {case}: {} from {}", found.rmse, found.rmse_before);
        assert!((found.height + shifts[1]).abs() < 1e-7 && (found.pitch + pitch).abs() < 1e-7, "case {case}");
        assert!((found.right + shifts[0]).abs() < 1e-7 && (found.ahead - shifts[2]).abs() < 1e-7, "case {case}");
        let again = found.scene.front_from_top().unwrap();
        for pair in &pairs {
            assert!(distance(again.point(pair.top).projected.unwrap(), pair.front) < 1e-6);
        }
        num_refined += 1;
    }
    assert_eq!(num_refined, 200);
}

#[test]
fn refinement_of_rough_marks_leaves_the_smallest_residuals() {
    let truth = homework_views().front_from_top().unwrap();
    let mut chance = Chance(6);
    let pairs: Vec<BevPair> = (0..8)
        .map(|_| [chance.within(60.0, 450.0), chance.within(20.0, 140.0)])
        .map(|top| (top, truth.point(top).projected.unwrap()))
        .map(|(top, [u, v])| BevPair { top, front: [u.round(), v.round()] })
        .collect();
    let found = refine(&homework_views(), &pairs, &BevRefinementOptions::default()).unwrap();
    assert!(found.converged && found.rmse <= found.rmse_before && found.rmse < 0.6, "{}", found.rmse);
    assert_eq!((found.residuals.len(), found.residuals_before.len()), (8, 8));
    // No small motion of the camera makes the sum smaller: it is a minimum, not just where the steps ended.
    for parameter in [BevParameter::Pitch, BevParameter::Height, BevParameter::Offset] {
        let options = BevRefinementOptions { camera: BevRole::Front, parameters: vec![parameter] };
        let again = refine(&found.scene, &pairs, &options).unwrap();
        assert!(again.rmse > found.rmse - 1e-9);
        assert!(again.pitch.abs().max(again.height.abs()).max(again.right.abs()).max(again.ahead.abs()) < 1e-4);
    }
}

#[test]
fn refinement_says_what_pairs_cannot_tell() {
    let scene = homework_views();
    let pair = |u: f64, v: f64, [du, dv]: [f64; 2]| {
        let [fu, fv] = scene.front_from_top().unwrap().point([u, v]).projected.unwrap();
        BevPair { top: [u, v], front: [fu + du, fv + dv] }
    };
    let all = BevRefinementOptions::default();
    let message =
        |pairs: &[BevPair], options: &BevRefinementOptions| refine(&scene, pairs, options).unwrap_err().to_string();
    assert!(message(&[pair(200.0, 50.0, [1.0, 1.0])], &all).contains("1 pairs give 2 numbers, but 4 are wanted"));
    let same = [pair(200.0, 50.0, [1.0, 1.0]); 4];
    assert!(message(&same, &all).contains("do not tell"));
    let behind = BevPair { top: [250.0, 400.0], front: [250.0, 400.0] };
    assert!(message(&[same[0], same[1], behind], &all).contains("pair 3"));
    let nothing = BevRefinementOptions { parameters: vec![], ..all };
    assert!(message(&same, &nothing).contains("Nothing"));
    // Both cameras stand over one place: only the ratio of their heights shows, so not the ground as well.
    let ratio = BevRefinementOptions { parameters: vec![BevParameter::Height, BevParameter::Ground], ..height_only() };
    let spread = [pair(100.0, 40.0, [0.0, 9.0]), pair(300.0, 90.0, [0.0, 7.0]), pair(400.0, 120.0, [0.0, 8.0])];
    assert!(message(&spread, &ratio).contains("do not tell"));
    // One pair is enough for one number.
    let found = refine(&scene, &[pair(256.0, 56.0, [0.0, 12.0])], &height_only()).unwrap();
    assert!(found.converged && found.rmse < 1e-9 && found.height > 0.05, "{found:?}");
}

fn height_only() -> BevRefinementOptions {
    BevRefinementOptions { parameters: vec![BevParameter::Height], camera: BevRole::Front }
}

#[test]
fn refinement_finds_the_ground() {
    for axes in AXES {
        let scene = homework_views().in_axes(axes).unwrap();
        let mut lower = scene.clone();
        lower.plane = BevPlane::Level { height: -0.1 };
        let shown = lower.front_from_top().unwrap();
        let pairs = [[100.0, 40.0], [300.0, 90.0], [400.0, 120.0]]
            .map(|top| BevPair { top, front: shown.point(top).projected.unwrap() });
        let options = BevRefinementOptions { parameters: vec![BevParameter::Ground], camera: BevRole::Front };
        let found = refine(&scene, &pairs, &options).unwrap();
        assert!(found.converged && (found.ground + 0.1).abs() < 1e-9, "{axes:?}: {}", found.ground);
        assert_eq!((&found.scene.top, &found.scene.front), (&scene.top, &scene.front));
        // The same ground given by its normal, which may point down and have any length.
        let normal = (axes.up() * -2.0).into();
        let tilted = BevScene { plane: BevPlane::Tilted { normal, offset: 0.0 }, ..scene.clone() };
        let found = refine(&tilted, &pairs, &options).unwrap();
        assert!((found.ground + 0.1).abs() < 1e-9);
        assert!(matches!(found.scene.plane, BevPlane::Tilted { offset, .. } if (offset - 0.2).abs() < 1e-9));
    }
}

/// Places of the floor in the homework's own two pairs of views, read off the enlarged pictures by eye, to 2 px.
#[test]
fn the_homeworks_views_show_a_floor_that_lies_a_little_lower() {
    let on_the_rug = [
        BevPair { top: [234.0, 46.0], front: [228.0, 387.0] }, // corner of the rug
        BevPair { top: [305.0, 120.0], front: [346.0, 454.0] }, // corner of the table's shadow
    ];
    let on_the_floor = [
        BevPair { top: [237.0, 66.0], front: [231.0, 404.0] }, // corners of the planks in the doorway
        BevPair { top: [307.0, 84.0], front: [332.0, 419.0] },
    ];
    let official = homework_views();
    let options = BevRefinementOptions { parameters: vec![BevParameter::Ground], camera: BevRole::Front };
    for (pairs, lowest, highest) in [(on_the_rug, -0.10, -0.04), (on_the_floor, -0.14, -0.11)] {
        let found = refine(&official, &pairs, &options).unwrap();
        for [across, down] in &found.residuals_before {
            assert!(across.abs() < 2.6 && (-11.0..-5.0).contains(down), "{across} {down}");
        }
        assert!((lowest..highest).contains(&found.ground), "{}", found.ground);
        assert!(found.rmse < 2.8, "{}", found.rmse);
    }
}

#[test]
fn every_degenerate_input_has_its_own_message() {
    let with = |change: &dyn Fn(&mut BevScene)| {
        let mut scene = homework_views();
        change(&mut scene);
        scene.front_from_top().expect_err("refused").to_string()
    };
    let matrix = |rows: [[f64; 4]; 3]| {
        let T_world_camera = [rows[0], rows[1], rows[2], [0.0, 0.0, 0.0, 1.0]];
        BevPose::Matrix { T_world_camera }
    };
    let level = |height| BevPlane::Level { height };
    let angle = |field_of_view| BevIntrinsics::FieldOfView { field_of_view, side: BevSide::Horizontal };
    let messages = [
        (with(&|scene| scene.front.intrinsics = angle(PI)), "front camera's field of view is 180 degrees"),
        (with(&|scene| scene.top.intrinsics = angle(0.0)), "top camera's field of view is 0 degrees"),
        (with(&|scene| scene.top.intrinsics = angle(f64::NAN)), "field of view is NaN degrees"),
        (
            with(&|scene| scene.top.intrinsics = BevIntrinsics::Focal { fx: 0.0, fy: 1.0, cx: 0.0, cy: 0.0 }),
            "The top camera: fx = 0",
        ),
        (with(&|scene| scene.front.width = 0), "front camera is said to have 0 x 512 pixels"),
        (
            with(&|scene| {
                scene.front.pose = matrix([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0], [2.0, 0.0, 0.0, 0.0]]);
            }),
            "front camera is singular (determinant 0)",
        ),
        (
            with(&|scene| {
                scene.front.pose = matrix([[-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]]);
            }),
            "mirrors (determinant -1)",
        ),
        (
            with(&|scene| {
                scene.top.pose = matrix([[2.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 1.0], [0.0, 0.0, 2.0, 0.0]]);
            }),
            "is no rotation: its entries are off by up to 1.000",
        ),
        (
            with(&|scene| {
                let mut T_world_camera = [[0.0; 4]; 4];
                (0..4).for_each(|i| T_world_camera[i][i] = 1.0);
                T_world_camera[3][1] = 2.5;
                scene.top.pose = BevPose::Matrix { T_world_camera };
            }),
            "ends in the row [0.0, 2.5, 0.0, 1.0]",
        ),
        (
            with(&|scene| {
                let position = [0.0, 1.0, 0.0];
                scene.front.pose = BevPose::Quaternion { position, qx: 0.0, qy: 0.0, qz: 0.0, qw: 0.0 };
            }),
            "front camera's quaternion is zero",
        ),
        (
            with(&|scene| {
                scene.front.pose =
                    BevPose::Euler { position: [f64::INFINITY; 3], order: EULER_ORDERS[0], angles: [0.0; 3] };
            }),
            "front camera's position or orientation has a number that is not finite",
        ),
        (with(&|scene| scene.plane = level(1.0)), "The ground passes through the front camera"),
        (with(&|scene| scene.plane = level(2.5)), "The ground passes through the top camera"),
        (with(&|scene| scene.plane = BevPlane::Tilted { normal: [0.0; 3], offset: 0.0 }), "normal is zero"),
        (with(&|scene| scene.plane = level(f64::NAN)), "The ground has a number that is not finite"),
    ];
    for (message, expected) in &messages {
        assert!(message.contains(expected), "{message} should say: {expected}");
        assert!(message.matches('.').count() >= 2, "{message} should say what to do");
    }
    let distinct: std::collections::BTreeSet<&String> = messages.iter().map(|(message, _)| message).collect();
    assert_eq!(distinct.len(), messages.len());

    let size = homework_views().top.check_image("top", 640, 480).unwrap_err().to_string();
    assert!(size.contains("640 x 480") && size.contains("512 x 512"), "{size}");
    assert!(homework_views().top.check_image("top", 512, 512).is_ok());
}

#[test]
fn a_scene_is_read_as_it_is_written_and_faults_are_named() {
    for preset in presets() {
        let text = serde_json::to_string_pretty(&preset.scene).unwrap();
        assert_eq!(BevScene::read(text.as_bytes()).unwrap(), preset.scene);
    }
    let mut chance = Chance(7);
    for _ in 0..100 {
        let scene = chance.scene();
        let again = BevScene::read(serde_json::to_string(&scene).unwrap().as_bytes()).unwrap();
        // Decimal numbers may come back with another last bit, which no pixel shows.
        let [before, after] = [&scene, &again].map(|scene| scene.front_from_top().unwrap());
        let marked = chance.pixel(&scene.top);
        if let (BevStatus::Visible, Some(pixel)) = (before.point(marked).status, after.point(marked).projected) {
            assert!(distance(before.point(marked).projected.unwrap(), pixel) < 1e-9);
        }
        assert_eq!((again.axes, again.top.width), (scene.axes, scene.top.width));
    }
    let text = serde_json::to_string_pretty(&homework_views()).unwrap();
    let misspelt = BevScene::read(text.replace("\"axes\"", "\"axis\"").as_bytes()).unwrap_err().to_string();
    assert!(misspelt.starts_with("line 2: unknown field `axis`"), "{misspelt}");
    let cut = BevScene::read(&text.as_bytes()[..100]).unwrap_err().to_string();
    assert!(cut.contains("EOF"), "{cut}");
}

#[test]
fn tables_of_pixels_are_read_with_and_without_names() {
    let read = |text: &str| read_pixels(text.as_bytes(), POINT_COLUMNS);
    let expected = vec![[239.0, 141.0], [258.5, -3.0]];
    for text in [
        "239,141\n258.5,-3\n",
        "u,v\n239,141\n258.5,-3",
        "\u{feff}239; 141\r\n258.5; -3\r\n",
        "# marked by hand\n239 141 # rug\n\n258.5\t-3\n",
        "number,top_u,top_v\n1,239,141\n2,258.5,-3\n",
        "v,u\n141,239\n-3,258.5\n",
    ] {
        assert_eq!(read(text).unwrap(), expected, "{text}");
    }
    let message = |text: &str| read(text).unwrap_err().to_string();
    assert!(message("239,141\n258\n").starts_with("line 2: The line has 1 of 2 numbers"));
    assert!(message("239,141\n258,left\n").starts_with("line 2: \"left\" is not a number"));
    assert!(message("239,141\n258,inf\n").starts_with("line 2: \"inf\" is not a number"));
    assert!(message("a,b\n1,2\n").starts_with("line 1: No column is called u or top_u"));
    assert!(message("u,v\n").contains("no point"));
    assert!(read_pixels(&[0xff, 0xfe], POINT_COLUMNS).unwrap_err().to_string().contains("no text"));
    let pairs = read_pixels(b"front_u,front_v,top_u,top_v\n1,2,3,4\n", PAIR_COLUMNS).unwrap();
    assert_eq!(pairs, [[3.0, 4.0, 1.0, 2.0]]);
}

#[test]
fn points_become_a_table() {
    let there = homework_views().front_from_top().unwrap();
    let points = [[256.0, 128.0], [250.0, 400.0]].map(|pixel| there.point(pixel).in_whole_pixels(WholePixels::Rounded));
    let text = points_csv(&points, "top", "front");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "number,top_u,top_v,x,y,z,front_u,front_v,status");
    assert!(lines[1].starts_with("1,256,128,") && lines[1].ends_with(",256,461,visible"), "{}", lines[1]);
    assert!(lines[2].ends_with(",,,behind_camera") && lines[2].matches(',').count() == 8, "{}", lines[2]);
    // What is written is read again.
    assert_eq!(read_pixels(text.as_bytes(), POINT_COLUMNS).unwrap(), [[256.0, 128.0], [250.0, 400.0]]);
}

#[test]
fn the_warped_view_has_the_colours_of_the_places_it_shows() {
    let mut scene = homework_views();
    for camera in [&mut scene.top, &mut scene.front] {
        (camera.width, camera.height) = (96, 64);
    }
    let transfer = scene.top_from_front().unwrap();
    // Red grows to the right and green downwards, so a colour tells the place.
    let image: Vec<u8> = (0..64).flat_map(|v| (0..96).flat_map(move |u| [2 * u as u8, 3 * v as u8, 7, 255])).collect();
    let warped = warp_rows(&transfer, &image, 0, 64).unwrap();
    let mut num_shown = 0;
    for v in 0..64 {
        for u in 0..96 {
            let pixel = &warped[(v * 96 + u) * 4..][..4];
            let point = transfer.point([u as f64, v as f64]);
            assert_eq!(pixel[3] == 255, point.status == BevStatus::Visible, "{u} {v}: {point:?}");
            if point.status == BevStatus::Visible {
                num_shown += 1;
                let [x, y] = point.projected.unwrap();
                let [x, y] = [x.clamp(0.0, 95.0), y.clamp(0.0, 63.0)];
                assert!((f64::from(pixel[0]) - 2.0 * x).abs() <= 0.51 && (f64::from(pixel[1]) - 3.0 * y).abs() <= 0.51);
                assert_eq!(pixel[2], 7);
            }
        }
    }
    assert!(num_shown > 250, "{num_shown}");
    // Strips are parts of the whole; what lies beyond is empty.
    assert_eq!(warp_rows(&transfer, &image, 40, 8).unwrap(), warped[40 * 96 * 4..48 * 96 * 4]);
    assert_eq!(warp_rows(&transfer, &image, 64, 8).unwrap(), [0; 0]);
    assert!(warp_rows(&transfer, &image[4..], 0, 8).is_err());
}

#[test]
fn the_layout_is_what_the_scene_says() {
    let layout = BevLayout::new(&homework_views().front_from_top().unwrap(), 20.0);
    let close = |a: [f64; 3], b: [f64; 3]| assert!((Vector3::from(a) - Vector3::from(b)).norm() < 1e-9, "{a:?} {b:?}");
    close(layout.up, [0.0, 1.0, 0.0]);
    close(layout.front.forward, [0.0, 0.0, -1.0]);
    close(layout.top.forward, [0.0, -1.0, 0.0]);
    close(layout.top.down, [0.0, 0.0, 1.0]);
    assert!((layout.top.height - 2.5).abs() < 1e-12 && (layout.front.height - 1.0).abs() < 1e-12);
    assert!((layout.front.vertical_field_of_view - FRAC_PI_2).abs() < 1e-12);
    // The top camera sees a square of 5 m; the front camera sees the floor from 1 m ahead up to the depth asked for.
    assert_eq!(layout.top.footprint.len(), 4);
    for corner in &layout.top.footprint {
        assert!((corner[0].abs() - 2.5).abs() < 0.01 && (corner[2].abs() - 2.5).abs() < 0.01 && corner[1].abs() < 1e-9);
    }
    let depths: Vec<f64> = layout.front.footprint.iter().map(|corner| -corner[2]).collect();
    assert!(depths.iter().all(|depth| (0.99..20.01).contains(depth)), "{depths:?}");
    assert!(depths.iter().any(|depth| *depth > 19.9));
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
