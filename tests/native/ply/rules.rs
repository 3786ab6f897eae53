//! What the format allows in its header and in its text, and what not.

use glam::Vec3;
use scanstitch::io::ply::read;

use super::texts::{XYZ, text};

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
            "line 2: \"binary\" is not a PLY format. Allowed are ascii, binary_little_endian and binary_big_endian.",
        ),
        (
            "ply\nformat ascii 1.0\nformat ascii 1.0\n",
            "line 3: This is a second format line. Export the file again as PLY.",
        ),
        (
            "ply\nelement face -3\n",
            "line 2: \"-3\" is not a count of face. Write a whole number from 0 on, like \"element vertex 180\".",
        ),
        (
            "ply\nelement vertex 99999999999999999999\n",
            "line 2: \"99999999999999999999\" is not a count of vertex. Write a whole number from 0 on, like \"element vertex \
             180\".",
        ),
        ("ply\nelement vertex 1\nelement vertex 2\n", "line 3: This is a second element called vertex. Merge the two."),
        ("ply\nproperty float x\n", "line 2: This property comes before any element. Export the file again as PLY."),
        (
            "ply\nelement vertex 1\nproperty flaot x\n",
            "line 3: \"flaot\" is not a type of a PLY property. Allowed are char, uchar, short, ushort, int, uint, float, double \
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
        "line 3: \"element \u{FFFD}\u{FFFD} 3\" is not a line of a PLY header. Export the file again as PLY."
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
