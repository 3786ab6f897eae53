//! What becomes of the numbers: colours, large coordinates, random layouts, writing and reading again.

use glam::{DVec3, Vec3};
use scanstitch::geometry::PointCloud;
use scanstitch::io::ply::{Format, read, write};

use super::random_files::{Random, random_file};
use super::texts::text;

#[test]
fn colors_of_every_width() {
    let colors = |scalar: &str, names: [&str; 3], values: [&str; 2]| {
        let properties = names.map(|name| format!("property {scalar} {name}"));
        let header: Vec<&str> = ["element vertex 2", "property float x", "property float y"]
            .into_iter()
            .chain(properties.iter().map(String::as_str))
            .collect();
        let body = values.map(|value| format!("1 2 {value}"));
        read(&text(&header, &[&body[0], &body[1]])).unwrap().colors.unwrap()
    };
    let rgb = ["red", "green", "blue"];
    assert_eq!(colors("uchar", rgb, ["0 127 255", "1 2 3"]), [[0, 127, 255], [1, 2, 3]]);
    assert_eq!(colors("float", ["r", "g", "b"], ["0 0.5 1", "0.25 nan -1"]), [[0, 128, 255], [64, 0, 0]]);
    assert_eq!(colors("float", rgb, ["0 127.5 255", "1 2 3"]), [[0, 128, 255], [1, 2, 3]]);
    assert_eq!(colors("ushort", rgb, ["0 32768 65535", "257 0 0"]), [[0, 128, 255], [1, 0, 0]]);
    assert_eq!(colors("int", rgb, ["0 128 255", "-5 0 1"]), [[0, 128, 255], [0, 0, 1]]);
    let diffuse = ["diffuse_red", "diffuse_green", "diffuse_blue"];
    assert_eq!(colors("double", diffuse, ["0 1e5 2e5", "nan nan nan"]), [[0, 128, 255], [0, 0, 0]]);
}

#[test]
fn map_coordinates_are_kept_relative_to_an_origin() {
    let header = ["element vertex 3", "property double x", "property double y", "property double z"];
    // The first is a far point that stands for "no return": it must not decide.
    let body = ["99999 99999 99999", "512345.6789 5412345.1234 87.5", "512346.6789 5412344.1234 88.25"];
    let cloud = read(&text(&header, &body)).unwrap();
    assert_eq!(cloud.origin, DVec3::new(512_346.0, 5_412_344.0, 88.0).round());
    let error =
        (cloud.positions[1].as_dvec3() + cloud.origin).distance(DVec3::new(512_345.678_9, 5_412_345.123_4, 87.5));
    assert!(error < 1e-7, "{error} m");
    for format in [Format::Ascii, Format::BinaryLittleEndian] {
        let again = read(&write(&cloud, format)).unwrap();
        assert_eq!((&again.positions, again.origin), (&cloud.positions, cloud.origin));
        // The text of coordinates of five million metres has nanometres.
        assert!((1..3).all(|index| again.point(index).distance(cloud.point(index)) < 2e-9));
    }
    // Points up to 10 km away keep their own coordinates, and so does a scan with one far return.
    assert_eq!(read(&text(&header, &["9999 0 0", "0 1e9 0", "1 2 3"])).unwrap().origin, DVec3::ZERO);
}

#[test]
fn what_is_written_is_read_back() {
    let mut random = Random(1);
    for case in 0..200 {
        let num_points = random.below(20);
        let mut position = || match random.below(10) {
            0 => f32::from_bits(random.bits() as u32),
            1 => random.pick(&[f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, f32::MIN_POSITIVE, 1e-45, 1e4]),
            _ => (random.bits() as i32) as f32 * 1e-6,
        };
        // NaN is no equal of itself: told apart by the test of spellings.
        let mut finite = || Some(position()).filter(|value| !value.is_nan()).unwrap_or(1.0);
        let positions: Vec<Vec3> = (0..num_points).map(|_| Vec3::new(finite(), finite(), finite())).collect();
        let direction = |position: &Vec3| if position.is_finite() { position.normalize_or(Vec3::X) } else { Vec3::Y };
        let cloud = PointCloud {
            normals: (case % 2 == 0).then(|| positions.iter().map(direction).collect()),
            colors: (case % 3 == 0).then(|| (0..num_points).map(|i| [i as u8, 255, case as u8]).collect()),
            positions,
            ..PointCloud::default()
        };
        let ascii = read(&write(&cloud, Format::Ascii)).unwrap();
        let binary = read(&write(&cloud, Format::BinaryLittleEndian)).unwrap();
        assert_eq!(ascii, binary, "case {case}");
        assert_eq!((&ascii.normals, &ascii.colors), (&cloud.normals, &cloud.colors), "case {case}");
        if ascii.origin == DVec3::ZERO {
            assert_eq!(ascii.positions, cloud.positions, "case {case}");
        }
    }
}

#[test]
fn random_layouts_are_read() {
    let mut random = Random(2);
    for case in 0..2000 {
        let (bytes, positions) = random_file(&mut random);
        let cloud =
            read(&bytes).unwrap_or_else(|error| panic!("case {case}: {error}\n{}", String::from_utf8_lossy(&bytes)));
        assert_eq!(cloud.positions, positions, "case {case}:\n{}", String::from_utf8_lossy(&bytes));
    }
}
