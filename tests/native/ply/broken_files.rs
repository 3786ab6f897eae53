//! Files that are cut off or broken: what is said of them, and that nothing panics.

use std::path::Path;

use scanstitch::io::ply::read;

use super::random_files::{Random, random_file};

fn own_data(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)).expect("a file of tests/data")
}

#[test]
fn broken_files_are_told_by_place_and_reason() {
    for (name, expected) in [
        ("cut_off.ply", "line 12: In vertex 5 of 6 the file is cut off before z. Copy or export it again."),
        (
            "cut_off_binary.ply",
            "byte 170: The file is cut off: it ends in vertex 5 of the 6 announced, each of 12 bytes. Copy or export it \
             again.",
        ),
        (
            "four_billion_points.ply",
            "line 14: The file is cut off: it ends before vertex 7 of the 4000000000 announced. Copy or export it again.",
        ),
        (
            "four_billion_points_binary.ply",
            "byte 196: The file is cut off: it ends in vertex 7 of the 4000000000 announced, each of 12 bytes. Copy or \
             export it again.",
        ),
        (
            "text.ply",
            "line 1: This is not a PLY file: it begins with \"These are my laser scans, see the other ...\". A PLY file \
             begins with the line \"ply\".",
        ),
        (
            "decimal_commas.ply",
            "line 9: In vertex 2 of 6 x is \"1,618\", not a number. Write decimal points, and blanks between values.",
        ),
        ("missing_value.ply", "line 10: In vertex 3 of 6 the line ends before z. Write one vertex a line."),
        (
            "without_coordinates.ply",
            "line 3: The vertices have no number called x, only range, angle. Points need x, y and z, or x and y for a \
             scan in the plane.",
        ),
    ] {
        assert_eq!(read(&own_data(name)).expect_err(name).to_string(), expected, "{name}");
    }
}

#[test]
fn vertices_without_properties_are_refused_in_a_whole_sentence() {
    let file = b"ply\nformat ascii 1.0\nelement vertex 2\nend_header\n\n\n";
    assert_eq!(
        read(file).unwrap_err().to_string(),
        "line 3: The header declares no properties of the vertices. Points need x, y and z, or x and y for a scan in the plane."
    );
}

#[test]
fn points_that_are_no_numbers_are_kept() {
    let cloud = read(&own_data("nan.ply")).unwrap();
    let finite: Vec<bool> = cloud.positions.iter().map(|position| position.is_finite()).collect();
    assert_eq!(finite, [true, false, true, false, false, true]);
    assert_eq!(cloud.positions[4].y, f32::NEG_INFINITY);
    assert!(read(&own_data("empty_cloud.ply")).unwrap().is_empty());
    assert!(!read(&own_data("space.ply")).unwrap().is_planar());
}

#[test]
fn negative_list_lengths_in_binary_files_are_told() {
    let mut bytes =
        b"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list char int a\nelement vertex 0\n\
        property float x\nproperty float y\nend_header\n"
            .to_vec();
    let start = bytes.len();
    bytes.extend([0xFF; 40]);
    assert_eq!(
        read(&bytes).unwrap_err().to_string(),
        format!("byte {start}: The list a has a length of -1. Export the file again, with lengths of type uchar.")
    );
}

#[test]
fn files_cut_off_at_any_byte_and_files_with_wrong_bytes_never_panic() {
    let mut random = Random(3);
    let (mut refused, mut altered) = (0, 0);
    for _ in 0..40 {
        let (bytes, positions) = random_file(&mut random);
        for length in 0..bytes.len() {
            // Complete without what follows the vertices, or with a number that lost its last digits.
            match read(&bytes[..length]) {
                Ok(cloud) => assert_eq!(cloud.len(), positions.len()),
                Err(error) => refused += usize::from(!error.to_string().is_empty()),
            }
        }
        for _ in 0..200 {
            let mut bytes = bytes.clone();
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len());
                bytes[at] = random.bits() as u8;
            }
            altered += usize::from(read(&bytes).is_ok());
        }
    }
    assert!(refused > 5000, "{refused}");
    assert!(altered > 500, "{altered}");
}
