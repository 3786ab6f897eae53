//! PLY reading and writing, on real files, on files made here, and on broken ones.
#![allow(clippy::format_push_string)] // Headers are put together line by line; here speed does not matter.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use scanstitch::geometry::PointCloud;
use scanstitch::io::ply::{Format, read, write};

fn shared_data() -> Option<PathBuf> {
    Some(Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data")).filter(|folder| folder.is_dir())
}

fn own_data(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)).expect("a file of tests/data")
}

/// What an independent reader (Python's plyfile) or the eye says a file holds: name, points, first and last position,
/// whether there are normals and colours.
type Known = (&'static str, usize, [f64; 3], [f64; 3], bool, bool);

#[rustfmt::skip]
#[allow(clippy::unreadable_literal)]
const KNOWN: [Known; 25] = [
    ("assimp/cube.ply", 8, [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], false, false),
    ("assimp/cube_binary.ply", 8, [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], false, false),
    ("assimp/cube_binary_starts_with_nl.ply", 8, [5.967534065246582, 0.0, 0.0], [6.967534065246582, 1.0, 0.0], false, false),
    ("assimp/cube_uv.ply", 24, [1.0, 1.0, -1.0], [-1.0, 1.0, 1.0], true, false),
    ("assimp/float-color.ply", 3, [0.0, 0.0, 0.0], [200.0, 200.0, 0.0], false, true),
    ("assimp/points.ply", 4, [0.0, 0.0, 0.0], [0.0, 1.0, 1.0], true, true),
    ("happly/platonic_shelf.ply", 50, [-3.562626, -0.627972, 0.613591], [6.068807, 0.985759, 0.056527], false, false),
    ("happly/platonic_shelf_ascii.ply", 50, [-3.562626, -0.627972, 0.613591], [6.068807, 0.985759, 0.056527], false, false),
    ("loaders_gl/cube_att.ply", 24, [0.0, 0.0, 0.0], [1.0, 0.0, 1.0], true, false),
    ("open3d/color.ply", 3017, [0.4007812440395355, 0.3007468581199646, 0.4164062440395355], [0.4039062559604645, 0.3051159977912903, 0.43085938692092896], true, true),
    ("open3d/test_sample_ascii.ply", 7, [0.0, 8.40703010559082, 0.0], [0.1979999989271164, 8.380040168762207, -0.053054001182317734], false, false),
    ("open3d/test_sample_custom.ply", 7, [0.0, 8.40703010559082, 0.0], [0.1979999989271164, 8.380040168762207, -0.053054001182317734], false, false),
    // An intensity of 128 does not fit its type int8: a column that is stepped over.
    ("open3d/test_sample_wrong_format_v1.ply", 2, [0.0, 0.0, -1.0], [0.7236, -0.52572, -0.447215], true, false),
    // The coordinates are so large that they are kept relative to an origin.
    ("pdal/issue_2421.ply", 1, [1.23457, 12345.6789, 1234567890.12345], [1.23457, 12345.6789, 1234567890.12345], false, false),
    ("pdal/mesh.ply", 4, [1.0, 1.0, 0.0], [2.0, 2.0, 2.0], false, false),
    ("pdal/simple_binary.ply", 3, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], false, false),
    ("pdal/simple_text.ply", 3, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], false, false),
    // x and y alone.
    ("pdal/sized_dims.ply", 1, [1.0, 12346.0, 0.0], [1.0, 12346.0, 0.0], false, false),
    ("trimesh/metadata.ply", 4, [-4.0, -4.0, 0.0], [4.0, 4.0, 0.0], false, false),
    ("trimesh/ply_empty_ascii.ply", 0, [0.0; 3], [0.0; 3], true, false),
    ("trimesh/ply_points_ascii.ply", 8, [1.0, 1.0, 1.0], [1.0, 1.0, -1.0], false, false),
    // All normals are zero: none.
    ("trimesh/ply_points_bin.ply", 8, [1.0, 1.0, 1.0], [1.0, 1.0, -1.0], false, false),
    ("trimesh/points_ascii_with_lists.ply", 5, [-0.06324999779462814, 0.03597930073738098, 0.04208730161190033], [-0.06350000202655792, 0.03672889992594719, 0.04246620088815689], false, false),
    ("trimesh/points_emptyface.ply", 1024, [-86.01312255859375, 39.389984130859375, -32.027198791503906], [-63.021419525146484, -21.709869384765625, 1.6876213550567627], false, false),
    ("trimesh/sphere.ply", 642, [-0.5257310271263123, 0.8506510257720947, 0.0], [0.9129819869995117, 0.39960700273513794, -0.0823236033320427], false, false),
];

/// Files that are refused, and how the message begins.
const REFUSED: [(&str, &str); 1] = [("assimp/empty.ply", "The file is empty.")];

#[test]
fn every_ply_file_of_seven_projects_is_read_or_refused_with_the_right_reason() {
    let Some(data) = shared_data() else {
        eprintln!("skipped: ../shared/data is absent");
        return;
    };
    let folder = data.join("ply_pcd");
    let mut found = Vec::new();
    for project in std::fs::read_dir(&folder).unwrap() {
        for file in std::fs::read_dir(project.unwrap().path()).into_iter().flatten() {
            let file = file.unwrap().path();
            if file.extension().is_some_and(|extension| extension == "ply") {
                found.push(file.strip_prefix(&folder).unwrap().to_str().unwrap().replace('\\', "/"));
            }
        }
    }
    for name in &found {
        let listed = KNOWN.iter().any(|known| known.0 == name) || REFUSED.iter().any(|refused| refused.0 == name);
        assert!(listed, "{name} is in neither table");
    }
    assert_eq!(found.len(), KNOWN.len() + REFUSED.len());

    for (name, message) in REFUSED {
        let error = read(&std::fs::read(folder.join(name)).unwrap()).expect_err(name);
        assert!(error.to_string().starts_with(message), "{name}: {error}");
    }
    for (name, num_points, first, last, has_normals, has_colors) in KNOWN {
        let cloud = read(&std::fs::read(folder.join(name)).unwrap()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(cloud.len(), num_points, "{name}");
        assert_eq!(cloud.normals.is_some(), has_normals, "{name}");
        assert_eq!(cloud.colors.is_some(), has_colors, "{name}");
        for (position, expected) in [(cloud.positions.first(), first), (cloud.positions.last(), last)] {
            let Some(position) = position else { continue };
            let error = (position.as_dvec3() + cloud.origin).distance(DVec3::from(expected));
            assert!(error < 1e-6, "{name}: {error} m");
        }
        for normal in cloud.normals.iter().flatten() {
            assert!(*normal == Vec3::ZERO || (normal.length() - 1.0).abs() < 1e-5, "{name}: {normal}");
        }
    }

    let read_known = |name: &str| read(&std::fs::read(folder.join(name)).unwrap()).unwrap();
    let points = read_known("assimp/points.ply");
    assert_eq!(points.colors.unwrap(), [[255, 255, 255], [255, 0, 255], [255, 255, 0], [0, 255, 255]]);
    assert_eq!(points.normals.unwrap()[3], Vec3::new(1.0, 1.0, 0.0).normalize());
    assert_eq!(read_known("assimp/float-color.ply").colors.unwrap(), [[0, 0, 255]; 3]);
    let color = read_known("open3d/color.ply");
    assert_eq!(color.colors.as_ref().unwrap()[0], [34, 33, 35]);
    assert_eq!(color.colors.as_ref().unwrap()[3016], [233, 46, 43]);
    assert!(color.normals.unwrap()[0].distance(Vec3::new(1.188_893_2, -6.030_208_6, 1.296_534_1).normalize()) < 1e-6);
    // The same shelf in both encodings, the faces before the vertices.
    assert_eq!(read_known("happly/platonic_shelf.ply"), read_known("happly/platonic_shelf_ascii.ply"));
}

#[test]
fn the_recordings_are_read() {
    let Some(data) = shared_data() else {
        eprintln!("skipped: ../shared/data is absent");
        return;
    };
    for index in 0..10 {
        let cloud = read(&std::fs::read(data.join(format!("laser/zju10/{index}.ply"))).unwrap()).unwrap();
        assert_eq!(cloud.len(), 180);
        assert!(cloud.is_planar());
    }
    let cloud = read(&std::fs::read(data.join("laser/zju10/0.ply")).unwrap()).unwrap();
    assert_eq!(cloud.positions[1], DVec3::new(1.979_695_057_658_993, 0.034_748_793_943_889, 0.0).as_vec3());
    let cloud = read(&std::fs::read(data.join("lidar/kitti_pair/source.ply")).unwrap()).unwrap();
    assert_eq!((cloud.len(), cloud.origin), (69_792, DVec3::ZERO));
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
            "line 1: This is no PLY file: it begins with \"These are my laser scans, see the other ...\". A PLY file \
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
fn points_that_are_no_numbers_are_kept() {
    let cloud = read(&own_data("nan.ply")).unwrap();
    let finite: Vec<bool> = cloud.positions.iter().map(|position| position.is_finite()).collect();
    assert_eq!(finite, [true, false, true, false, false, true]);
    assert_eq!(cloud.positions[4].y, f32::NEG_INFINITY);
    assert!(read(&own_data("empty_cloud.ply")).unwrap().is_empty());
    assert!(!read(&own_data("space.ply")).unwrap().is_planar());
}

/// A file in text of `header` lines and `body` lines.
fn text(header: &[&str], body: &[&str]) -> Vec<u8> {
    let lines = ["ply", "format ascii 1.0"].iter().chain(header).chain(&["end_header"]).chain(body);
    lines.flat_map(|line| [line, "\n"]).collect::<String>().into_bytes()
}

const XYZ: [&str; 4] = ["element vertex 1", "property float x", "property float y", "property float z"];

#[test]
fn rules_of_the_header() {
    let whole = |header: &str| read(header.as_bytes()).expect_err(header).to_string();
    for (header, expected) in [
        (
            "ply",
            "line 1: The header is cut off: the file ends before the line \"end_header\". Export the file again as PLY.",
        ),
        (
            "ply\nend_header\n",
            "The header has no format line. Add one, like \"format ascii 1.0\", after the first line.",
        ),
        (
            "ply\nformat ascii 2.0\n",
            "line 2: The version of the format is \"2.0\". Export the file as PLY 1.0, the only version there is.",
        ),
        (
            "ply\nformat binary 1.0\n",
            "line 2: \"binary\" is no format of a PLY file. Allowed are ascii, binary_little_endian and binary_big_endian.",
        ),
        (
            "ply\nformat ascii 1.0\nformat ascii 1.0\n",
            "line 3: This is a second format line. Export the file again as PLY.",
        ),
        (
            "ply\nelement face -3\n",
            "line 2: \"-3\" is no count of face. Write a whole number from 0 on, like \"element vertex 180\".",
        ),
        (
            "ply\nelement vertex 99999999999999999999\n",
            "line 2: \"99999999999999999999\" is no count of vertex. Write a whole number from 0 on, like \"element vertex \
             180\".",
        ),
        ("ply\nelement vertex 1\nelement vertex 2\n", "line 3: This is a second element called vertex. Merge the two."),
        ("ply\nproperty float x\n", "line 2: This property comes before any element. Export the file again as PLY."),
        (
            "ply\nelement vertex 1\nproperty flaot x\n",
            "line 3: \"flaot\" is no type of a PLY property. Allowed are char, uchar, short, ushort, int, uint, float, double \
             (int8 ... float64).",
        ),
        (
            "ply\nelement vertex 1\nproperty list float int a\n",
            "line 3: The length of a list is of the type float. Give it an integer type, like uchar.",
        ),
        (
            "ply\nelement vertex 1\nproperty float\n",
            "line 3: A property without a name. Write it like \"property float x\".",
        ),
        (
            "ply\r\nhello world\r\n",
            "line 2: \"hello\" begins no line of a PLY header. A header has format, comment, element, property and \
             end_header.",
        ),
        (
            "ply\nformat ascii 1.0\nelement face 0\nend_header\n",
            "The file has no vertices: its header has no element called vertex. Export points.",
        ),
        (
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty int x\nend_header\n",
            "line 6: This is a second property called x. Remove or rename one of the two.",
        ),
        (
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty list uchar float x\nproperty float y\nend_header\n",
            "line 3: The vertices have no number called x, only x, y. Points need x, y and z, or x and y for a scan in the \
             plane.",
        ),
    ] {
        assert_eq!(whole(header), expected);
    }
    let not_text = [b"ply\nformat ascii 1.0\nelement \xFF\xFE 3\n".as_slice(), b"end_header\n"].concat();
    assert_eq!(
        read(&not_text).unwrap_err().to_string(),
        "line 3: \"element \u{FFFD}\u{FFFD} 3\" is no line of a PLY header. Export the file again as PLY."
    );
    let latin_1 =
        [b"ply\nformat ascii 1.0\ncomment M\xFCller\nobj_info \xFF\n".as_slice(), &text(&XYZ, &["1 2 3"])[21..]];
    assert_eq!(read(&latin_1.concat()).unwrap().positions, [Vec3::new(1.0, 2.0, 3.0)]);
}

#[test]
fn rules_of_text() {
    let with = |property: &str, body: &[&str]| {
        let header: Vec<&str> = XYZ.into_iter().chain([property]).collect();
        read(&text(&header, body))
    };
    let message = |property, body| with(property, body).unwrap_err().to_string();
    assert_eq!(
        message("property int i", &["1 2 3 4 5"]),
        "line 9: In vertex 1 of 1 the line has more values than announced: x, y, z, i. Write one vertex a line."
    );
    assert_eq!(
        message("property uchar i", &["", "1 abc 3 4"]),
        "line 10: In vertex 1 of 1 y is \"abc\", not a number. Write decimal numbers."
    );
    assert_eq!(
        message("property list char int i", &["1 2 3 -1"]),
        "line 9: In vertex 1 of 1 the list i has a length of -1. Lengths are whole numbers from 0 on."
    );
    assert_eq!(
        message("property list uint int i", &["1 2 3 4000000000 1 2"]),
        "line 9: In vertex 1 of 1 the line ends before i. Write one vertex a line."
    );
    assert_eq!(
        message("property list uchar int i", &["1 2 3 0.5"]),
        "line 9: In vertex 1 of 1 i is \"0.5\", which is no uchar. Announce the property as double, or write whole numbers \
         that fit."
    );
    // What is stepped over is not judged.
    assert_eq!(with("property char i", &["1 2 3 wide"]).unwrap().positions, [Vec3::new(1.0, 2.0, 3.0)]);

    let color = ["property uchar red", "property uchar green", "property uchar blue"];
    let header: Vec<&str> = XYZ.into_iter().chain(color).collect();
    assert_eq!(
        read(&text(&header, &["1 2 3 255 256 0"])).unwrap_err().to_string(),
        "line 11: In vertex 1 of 1 green is \"256\", which is no uchar. Announce the property as double, or write whole \
         numbers that fit."
    );
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
fn any_line_ending_and_a_byte_order_mark() {
    let expected = read(&text(&XYZ, &["1 2 3"])).unwrap();
    let unix = String::from_utf8(text(&XYZ, &["1 2 3"])).unwrap();
    for text in [
        unix.replace('\n', "\r\n"),
        unix.replace('\n', "\r"),
        format!("\u{FEFF}{unix}"),
        unix.replace('\n', " \t\n"),
        unix.replace("1 2 3\n", "\n\n1\t2  3"),
        unix.replace("element", "\ncomment ply\nobj_info end_header\nelement"),
    ] {
        assert_eq!(read(text.as_bytes()).unwrap(), expected, "{text:?}");
    }
    // After a header with lone CRs the first byte may be that of a line feed; so may it after one with line feeds.
    for (ending, first) in [("\r", 0x0A), ("\r", 0x0D), ("\n", 0x0A), ("\n", 0x0D), ("\r\n", 0x0A), ("\r\n", 0x0D)] {
        let header = unix.replace("ascii", "binary_little_endian").replace("1 2 3\n", "").replace('\n', ending);
        let x = f32::from_le_bytes([first, 0, 0x80, 0x3F]);
        let bytes = [header.into_bytes(), [x, 2.0, 3.0].map(f32::to_le_bytes).concat()].concat();
        assert_eq!(read(&bytes).unwrap().positions, [Vec3::new(x, 2.0, 3.0)], "{ending:?} {first}");
    }
}

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
        assert_eq!(read(&write(&cloud, format)).unwrap(), cloud);
    }
    // Points up to 10 km away keep their own coordinates, and so does a scan with one far return.
    assert_eq!(read(&text(&header, &["9999 0 0", "0 1e9 0", "1 2 3"])).unwrap().origin, DVec3::ZERO);
}

/// Random numbers, the same every time (Steele and Vigna's `SplitMix64`).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.bits() % limit as u64) as usize
    }

    fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }
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
            origin: DVec3::ZERO,
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

/// A scalar type: its names, how a value is written in binary, and the largest whole value used of it.
type Type = ([&'static str; 2], fn(f64) -> Vec<u8>, usize);

const TYPES: [Type; 8] = [
    (["char", "int8"], |v| (v as i8).to_le_bytes().to_vec(), 127),
    (["uchar", "uint8"], |v| (v as u8).to_le_bytes().to_vec(), 255),
    (["short", "int16"], |v| (v as i16).to_le_bytes().to_vec(), 9999),
    (["ushort", "uint16"], |v| (v as u16).to_le_bytes().to_vec(), 9999),
    (["int", "int32"], |v| (v as i32).to_le_bytes().to_vec(), 9999),
    (["uint", "uint32"], |v| (v as u32).to_le_bytes().to_vec(), 9999),
    (["float", "float32"], |v| (v as f32).to_le_bytes().to_vec(), 9999),
    (["double", "float64"], |v| v.to_le_bytes().to_vec(), 9999),
];

/// A file under construction: the same content is written as text or as binary.
struct Builder {
    header: String,
    body: Vec<u8>,
    format: &'static str,
}

impl Builder {
    fn value(&mut self, (_, bytes, _): Type, value: f64) {
        match self.format {
            "ascii" => self.body.extend(format!("{value} ").bytes()),
            "binary_little_endian" => self.body.extend(bytes(value)),
            _ => self.body.extend(bytes(value).into_iter().rev()),
        }
    }

    fn end_instance(&mut self, random: &mut Random) {
        if self.format == "ascii" {
            self.body.extend(random.pick(&["\n", "\r\n", " \n", "\n\n"]).bytes());
        }
    }

    /// A list of up to three items.
    fn list(&mut self, random: &mut Random, count: Type, item: Type) {
        let length = random.below(4);
        self.value(count, length as f64);
        for _ in 0..length {
            self.value(item, random.below(100) as f64);
        }
    }

    /// An element that means nothing here.
    fn other_element(&mut self, random: &mut Random, name: &str) {
        let count = random.below(4);
        let (length, item) = (random.pick(&TYPES[..6]), random.pick(&TYPES));
        let has_list = random.chance(50);
        self.header += &format!("element {name} {count}\nproperty {} number\n", random.pick(&item.0));
        if has_list {
            self.header += &format!("property list {} {} items\n", random.pick(&length.0), random.pick(&item.0));
        }
        for _ in 0..count {
            self.value(item, random.below(100) as f64);
            if has_list {
                self.list(random, length, item);
            }
            self.end_instance(random);
        }
    }
}

/// A random file, and the positions in it.
fn random_file(random: &mut Random) -> (Vec<u8>, Vec<Vec3>) {
    let format = random.pick(&["ascii", "binary_little_endian", "binary_big_endian"]);
    let mut file = Builder { header: format!("ply\nformat {format} 1.0\n"), body: Vec::new(), format };
    if random.chance(40) {
        file.other_element(random, "face");
    }
    let count = random.below(8);
    file.header += &format!("element vertex {count}\n");
    let shared = random.pick(&TYPES);
    let is_shared = random.chance(50);
    let mut names = vec!["x", "y", "z"];
    if random.chance(30) {
        names.push("intensity");
    }
    if random.chance(30) {
        names.push("[]");
    }
    if random.chance(60) {
        for index in (1..names.len()).rev() {
            names.swap(index, random.below(index + 1));
        }
    }
    let properties: Vec<(&str, Type, Type)> = names
        .into_iter()
        .map(|name| (name, if is_shared { shared } else { random.pick(&TYPES) }, random.pick(&TYPES[..6])))
        .collect();
    for (name, item, length) in &properties {
        if *name == "[]" {
            file.header += &format!("property list {} {} neighbours\n", random.pick(&length.0), random.pick(&item.0));
        } else {
            file.header += &format!("property {} {name}\n", random.pick(&item.0));
        }
    }
    let mut positions = vec![Vec3::ZERO; count];
    for position in &mut positions {
        for &(name, item, length) in &properties {
            if name == "[]" {
                file.list(random, length, item);
                continue;
            }
            let whole = random.below(item.2 + 1) as f64;
            let value = if item.0[0] == "float" || item.0[0] == "double" { whole / 8.0 - 500.0 } else { whole };
            file.value(item, value);
            if let Some(axis) = ["x", "y", "z"].iter().position(|&axis| axis == name) {
                position[axis] = value as f32;
            }
        }
        file.end_instance(random);
    }
    if random.chance(40) {
        file.other_element(random, "edge");
    }
    let mut bytes = (file.header + "comment the end is near\nend_header\n").into_bytes();
    bytes.extend(file.body);
    (bytes, positions)
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
