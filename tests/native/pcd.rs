//! PCD files: what is read, and what is refused with which reason.

use std::path::Path;

use crate::common::shared_data;
use glam::{DVec3, Vec3};
use scanstitch::geometry::PointCloud;
use scanstitch::io::pcd;

fn file(fields: &str, sizes: &str, types: &str, points: usize, data: &str) -> Vec<u8> {
    let count = "1 ".repeat(fields.split(' ').count());
    format!(
        "# a comment\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nCOUNT {count}\nWIDTH {points}\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}"
    )
    .into_bytes()
}

fn refused(bytes: &[u8]) -> String {
    pcd::read(bytes).unwrap_err().to_string()
}

/// Two points with normal, colour and something else, in each of the three ways.
fn variants() -> [Vec<u8>; 3] {
    let (fields, sizes, types) =
        ("intensity x y z rgb normal_x normal_y normal_z", "2 4 4 8 4 4 4 4", "U F F F F F F F");
    let rgb = f32::from_bits(0x00_0A_14_1E);
    let points = [(7u16, 1.5f32, -2.0f32, 3.25f64), (8, f32::NAN, 0.5, 0.0)];
    let mut text = file(fields, sizes, types, 2, "ascii\n");
    let (mut rows, mut columns) = (Vec::new(), vec![Vec::new(); 8]);
    for (intensity, x, y, z) in points {
        text.extend(format!("{intensity} {x:?} {y:?} {z:?} {rgb:e} 0 0 2\n").bytes());
        let mut values = vec![intensity.to_le_bytes().to_vec(), x.to_le_bytes().to_vec(), y.to_le_bytes().to_vec()];
        values.push(z.to_le_bytes().to_vec());
        values.extend([rgb, 0.0, 0.0, 2.0].map(|value: f32| value.to_le_bytes().to_vec()));
        for (column, value) in columns.iter_mut().zip(&values) {
            column.extend(value);
        }
        rows.extend(values.concat());
    }
    let mut binary = file(fields, sizes, types, 2, "binary\n");
    binary.extend(&rows);
    // LZF of literals alone: up to 32 bytes after their number less one.
    let data = columns.concat();
    let packed: Vec<u8> =
        data.chunks(32).flat_map(|chunk| std::iter::once(chunk.len() as u8 - 1).chain(chunk.iter().copied())).collect();
    let mut compressed = file(fields, sizes, types, 2, "binary_compressed\n");
    compressed.extend((packed.len() as u32).to_le_bytes());
    compressed.extend((data.len() as u32).to_le_bytes());
    compressed.extend(packed);
    [text, binary, compressed]
}

#[test]
fn the_three_encodings_give_the_same_cloud() {
    for bytes in variants() {
        let cloud = pcd::read(&bytes).unwrap();
        assert_eq!(cloud.positions[0], Vec3::new(1.5, -2.0, 3.25));
        assert!(cloud.positions[1].x.is_nan() && cloud.positions[1].y == 0.5);
        assert_eq!(cloud.normals, Some(vec![Vec3::Z; 2]));
        assert_eq!(cloud.colors, Some(vec![[10, 20, 30]; 2]));
        assert_eq!((cloud.len(), cloud.origin), (2, DVec3::ZERO));
    }
}

#[test]
fn what_is_cut_off_is_refused_and_nothing_panics() {
    for whole in variants() {
        let start = whole.windows(5).position(|window| window == b"DATA ").unwrap();
        for length in start + 5..whole.len() - 4 {
            let message = refused(&whole[..length]);
            assert!(
                ["cut off", "in place of", "DATA", "not a number"].iter().any(|reason| message.contains(reason)),
                "{length}: {message}"
            );
        }
        for offset in 0..whole.len() {
            for flip in [0x01, 0x20, 0x80] {
                let mut broken = whole.clone();
                broken[offset] ^= flip;
                let _ = pcd::read(&broken); // an error or not, but no panic
            }
        }
    }
}

#[test]
fn headers_that_break_the_rules_are_refused() {
    let text = |fields, sizes, types| file(fields, sizes, types, 1, "ascii\n1 2 3\n");
    for (bytes, reason) in [
        (b"ply\nformat ascii 1.0\n".to_vec(), "not a PCD file"),
        (Vec::new(), "no line DATA"),
        (b"VERSION 0.7\nFIELDS x y\n".to_vec(), "no line DATA"),
        (b"VERSION 0.7\nDATA ascii\n".to_vec(), "no line FIELDS"),
        (text("a b c", "4 4 4", "F F F"), "no field called x, only a, b, c"),
        (text("x y z", "4 4", "F F F"), "Value 3 of SIZE"),
        (text("x y z", "4 4 4", "F F"), "type"),
        (text("x y z", "4 4 2", "F F F"), "type \"F\" with 2 bytes"),
        (text("x y z w", "4 4 4 4", "F F F F"), "3 values in place of 4"),
        (file("x y z", "4 4 4", "F F F", 1, "ascii\n1 b 3\n"), "line 12: Value 2 of point 1 is \"b\""),
        (file("x y z", "4 4 4", "F F F", 3, "ascii\n1 2 3\n\n4 5 6\n"), "before point 3 of 3"),
        (
            b"FIELDS x y\nSIZE 4 4\nTYPE F F\nCOUNT 0 0\nPOINTS 9999999999\nDATA binary_compressed\n\0\0\0\0\0\0\0\0"
                .to_vec(),
            "no field called x",
        ),
        (file("x y z", "4 4 4", "F F F", 1, "zip\n"), "DATA is \"zip\""),
        (file("x y z", "4 4 4", "F F F", usize::MAX, "binary\nabc"), "cut off"),
        (file("x y z", "4 4 4", "F F F", usize::MAX, "binary_compressed\n\x01\0\0\0\x01\0\0\0\0"), "bytes, but"),
        (file("x y z", "4 4 4", "F F F", 100_000_000, "binary_compressed\n\x01\0\0\0\x00\u{8}\0\0"), "bytes, but"),
    ] {
        assert!(refused(&bytes).contains(reason), "{}", refused(&bytes));
    }
}

#[test]
fn planar_scans_capitals_and_commas() {
    let cloud = pcd::read(&file("X Y", "4 4", "F F", 2, "ascii\r\n1,2\r\n3,4\r\n")).unwrap();
    assert!(cloud.is_planar());
    assert_eq!(cloud.positions, [Vec3::new(1.0, 2.0, 0.0), Vec3::new(3.0, 4.0, 0.0)]);
    // Integers, and a field of several numbers before the position.
    let bytes = b"FIELDS h x y z rgba\nSIZE 4 2 2 2 4\nTYPE F I I I U\nCOUNT 3 1 1 1 1\nWIDTH 1\nHEIGHT 1\nDATA ascii\n0 0 0 -1 2 3 660510\n";
    let cloud = pcd::read(bytes).unwrap();
    assert_eq!(cloud.positions, [Vec3::new(-1.0, 2.0, 3.0)]);
    assert_eq!(cloud.colors, Some(vec![[10, 20, 30]]));
}

/// A clock's nanoseconds need double precision, their differences do not.
#[test]
fn times_of_points_are_read_whatever_their_type() {
    let clock = 1_700_000_000.0;
    let text = file("x y z timestamp", "4 4 4 8", "F F F F", 2, "ascii\n1 2 3 1700000000.0625\n1 2 4 1700000000.0\n");
    let times = pcd::read(&text).unwrap().times.unwrap();
    assert_eq!((times.origin, times.offsets), (clock, vec![0.0625, 0.0]));
    let mut bytes = file("x y z offset_time", "4 4 4 4", "F F F U", 2, "binary\n");
    for offset in [90_000_000u32, 5] {
        bytes.extend([1f32, 2.0, 3.0].iter().flat_map(|value| value.to_le_bytes()).chain(offset.to_le_bytes()));
    }
    let times = pcd::read(&bytes).unwrap().times.unwrap();
    assert_eq!((times.origin, times.offsets), (5.0, vec![89_999_995.0, 0.0]));
}

#[test]
fn every_pcd_file_of_other_projects_is_read() {
    let Some(folder) = shared_data("ply_pcd") else { return };
    let mut expected = vec![
        ("capture0001.pcd", 307_200, false, false),
        ("capture0002.pcd", 307_200, false, false),
        ("room_scan1.pcd", 112_586, false, false),
        ("room_scan2.pcd", 112_624, false, false),
        ("milk_color.pcd", 13_704, false, true),
        ("loaders_gl/Zaghetto.pcd", 59_750, false, false),
        ("loaders_gl/simple-ascii.pcd", 213, false, true),
        ("pcl_test/bun0.pcd", 397, true, false),
        ("pcl_test/bun4.pcd", 361, false, false),
        ("pcl_test/bunny.pcd", 397, false, false),
        ("pcl_test/colored_cloud.pcd", 1000, true, true),
        ("pdal/utm17_comma.pcd", 10, false, false),
        ("pdal/utm17_space.pcd", 10, false, false),
    ];
    for path in pcd_files(&folder) {
        let name = path.strip_prefix(&folder).unwrap().to_str().unwrap().to_owned();
        let index = expected.iter().position(|entry| entry.0 == name).unwrap_or_else(|| panic!("{name} is new"));
        let (_, len, has_normals, has_colors) = expected.swap_remove(index);
        let cloud: PointCloud = pcd::read(&std::fs::read(&path).unwrap()).unwrap();
        let finite: Vec<&Vec3> = cloud.positions.iter().filter(|position| position.is_finite()).collect();
        assert!(finite.len() * 3 > cloud.len(), "{name}: {} of {}", finite.len(), cloud.len());
        // Rooms, bunnies and milk cartons: nothing is larger than a hall.
        assert!(finite.iter().all(|position| position.abs().max_element() < 1000.0), "{name}");
        assert_eq!(
            (cloud.len(), cloud.normals.is_some(), cloud.colors.is_some()),
            (len, has_normals, has_colors),
            "{name}"
        );
        if name.starts_with("pdal") {
            let first = cloud.positions[0].as_dvec3() + cloud.origin;
            assert!((first - DVec3::new(289_814.15, 4_320_978.61, 170.76)).length() < 1e-3, "{name}: {first}");
        }
    }
    assert!(expected.is_empty(), "missing: {expected:?}");
}

fn pcd_files(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(pcd_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "pcd") {
            files.push(path);
        }
    }
    files
}

/// Every form comes back as it was written.
#[test]
fn what_is_written_is_read_again() {
    let points = 500;
    let cloud = PointCloud {
        positions: (0..points).map(|i| glam::Vec3::new(i as f32 * 0.1, -1.5 / (i + 1) as f32, 3e-5)).collect(),
        normals: Some((0..points).map(|i| glam::Vec3::from([[1.0, 0.0, 0.0], [0.0, 0.6, -0.8]][i % 2])).collect()),
        colors: Some((0..points).map(|i| [i as u8, 255, (i / 2) as u8]).collect()),
        ..PointCloud::default()
    };
    for format in [pcd::Format::Ascii, pcd::Format::Binary, pcd::Format::BinaryCompressed] {
        assert_eq!(pcd::read(&pcd::write(&cloud, format)).unwrap(), cloud, "{format:?}");
        let bare = PointCloud::from_positions(cloud.positions.clone());
        assert_eq!(pcd::read(&pcd::write(&bare, format)).unwrap(), bare, "{format:?}");
    }
    // Positions in a map's coordinates are of eight bytes: in four, 5,000 km have steps of half a metre.
    let placed = PointCloud { origin: DVec3::new(289_814.0, 5_320_978.0, 170.0), ..cloud.clone() };
    for format in [pcd::Format::Ascii, pcd::Format::Binary, pcd::Format::BinaryCompressed] {
        let again = pcd::read(&pcd::write(&placed, format)).unwrap();
        assert_eq!((&again.normals, &again.colors), (&placed.normals, &placed.colors), "{format:?}");
        for index in 0..points {
            let off = again.point(index) + again.origin - placed.point(index) - placed.origin;
            assert!(off.length() < 1e-8, "{format:?} {index}: {off}");
        }
    }
    let sizes = [pcd::Format::Binary, pcd::Format::BinaryCompressed].map(|format| pcd::write(&cloud, format).len());
    assert!(sizes[1] < sizes[0]);
    assert!(pcd::read(&pcd::write(&PointCloud::default(), pcd::Format::Binary)).is_ok_and(|cloud| cloud.is_empty()));
}
