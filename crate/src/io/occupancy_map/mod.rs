//! Occupancy maps from files: a picture with the YAML file of ROS's map_server, a picture with a scale, CMU's `wean.dat`.
//!
//! | files | read by |
//! |---|---|
//! | `map.yaml` and its picture (PGM, PNG, PPM or JPEG) | [`MapYaml::read`], then [`of_picture`] |
//! | a picture and the side of a pixel | [`MapYaml::of_scale`], then [`of_picture`] |
//! | CMU 16-831's `wean.dat` | [`read_probabilities`] |
//!
//! Source: the code of ROS's map_server and of nav2_map_server (`map_io.cpp`), which agree in all but the borders of the thresholds.

mod picture;
mod probabilities;
mod yaml;

use nalgebra::Vector2;

use crate::error::Result;
use crate::geometry::Pose2;
use picture::GreyPicture;
pub use probabilities::{looks_like_probabilities, read_probabilities};
pub(crate) use yaml::{FREE_THRESH, OCCUPIED_THRESH};
pub use yaml::{MapYaml, Mode};

/// A map of square cells, each with the probability that it is occupied.
#[derive(Debug, Clone, PartialEq)]
pub struct OccupancyMap {
    /// Side of a cell (m).
    pub resolution: f64,
    /// The grid in the world: its corner, and the turn of its rows from the x axis.
    pub T_world_grid: Pose2,
    /// Cells along the grid's x.
    pub width: usize,
    /// Cells along the grid's y.
    pub height: usize,
    /// Probability that a cell is occupied, row by row from the smallest y; NaN where it is not known.
    pub occupancy: Vec<f32>,
    /// What else is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

/// The map of a picture by what its YAML file says of it.
///
/// # Errors
/// No picture that can be read; one that is cut off or larger than its file can hold.
pub fn of_picture(yaml: &MapYaml, picture: &[u8]) -> Result<OccupancyMap> {
    let GreyPicture { width, height, shades } = picture::read(picture)?;
    let rows = shades.chunks_exact(width).rev();
    Ok(OccupancyMap {
        resolution: yaml.resolution,
        T_world_grid: Pose2::new(Vector2::new(yaml.origin[0], yaml.origin[1]), yaml.origin[2]),
        width,
        height,
        occupancy: rows.flatten().map(|shade| yaml.occupancy(*shade)).collect(),
        notes: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;

    const YAML: &str = "image: map.pgm\nresolution: 0.1\norigin: [-1.0, 2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\n\
                        free_thresh: 0.196\n";

    fn cells(yaml: &str, picture: &[u8]) -> Vec<f32> {
        of_picture(&MapYaml::read(yaml.as_bytes()).unwrap(), picture).unwrap().occupancy
    }

    fn problem<T>(result: Result<T>) -> String {
        result.err().expect("it is refused").to_string()
    }

    /// Each value against what nav2's `map_io.cpp` computes of it by hand.
    #[test]
    fn values_mean_what_ros_means_by_them_in_every_mode() {
        let plain = b"P2\n# made by hand\n3 2\n255\n0 254 205\n100 230 50\n";
        let binary = b"P5 3 2 255\n\x00\xFE\xCD\x64\xE6\x32";
        let with = |line: &str| format!("{YAML}{line}\n");
        let shown = |values: Vec<f32>| {
            values.iter().map(|v| if v.is_nan() { -1 } else { (100.0 * v).round() as i32 }).collect::<Vec<_>>()
        };
        for picture in [&plain[..], binary] {
            // The row at the bottom comes first.
            assert_eq!(shown(cells(YAML, picture)), [-1, 0, 100, 100, 0, -1]);
            assert_eq!(shown(cells(&with("mode: trinary"), picture)), [-1, 0, 100, 100, 0, -1]);
            // (0.6078 - 0.196) / 0.454 = 0.907; 205 is 0.0001.
            assert_eq!(shown(cells(&with("mode: scale"), picture)), [91, 0, 100, 100, 0, 0]);
            assert_eq!(shown(cells(&with("mode: raw"), picture)), [100, -1, 50, 0, -1, -1]);
            assert_eq!(shown(cells(&YAML.replace("negate: 0", "negate: 1"), picture)), [-1, 100, -1, 0, 100, 100]);
        }
    }

    #[test]
    fn an_origin_has_a_turn_and_may_be_written_as_a_list_of_lines() {
        let map = |yaml: &str| of_picture(&MapYaml::read(yaml.as_bytes()).unwrap(), b"P5 1 1 255\n\0").unwrap();
        let expected = Pose2::new(Vector2::new(-1.0, 2.0), 0.5);
        assert_eq!(map(YAML).T_world_grid, expected);
        let listed = YAML.replace("[-1.0, 2.0, 0.5]", "\r\n  - -1.0\n  - 2.0 # m\n- 0.5");
        assert_eq!(map(&listed).T_world_grid, expected);
        assert_eq!(MapYaml::read(YAML.replace("map.pgm", "\"my map.pgm\"").as_bytes()).unwrap().image, "my map.pgm");
    }

    #[test]
    fn each_fault_of_a_yaml_file_has_its_own_message() {
        for (from, to, said) in [
            ("image: map.pgm", "", "names no image"),
            ("resolution: 0.1", "resolution: -0.1", "resolution is -0.1"),
            ("resolution: 0.1", "resolution: 0", "resolution is 0"),
            ("resolution: 0.1", "resolution: nan", "resolution is NaN"),
            ("resolution: 0.1", "resolution: five", "\"five\" is no number"),
            ("resolution: 0.1", "", "has no resolution"),
            ("[-1.0, 2.0, 0.5]", "[-1.0, 2.0]", "2 numbers"),
            ("[-1.0, 2.0, 0.5]", "[-1.0, inf, 0.5]", "origin"),
            ("free_thresh: 0.196", "free_thresh: 0.7", "free_thresh"),
            ("occupied_thresh: 0.65", "occupied_thresh: 65", "occupied_thresh"),
            ("negate: 0", "negate: maybe", "negate"),
            ("negate: 0", "mode: ternary", "mode"),
        ] {
            let message = problem(MapYaml::read(YAML.replace(from, to).as_bytes()));
            assert!(message.contains(said), "{to}: {message}");
        }
        assert!(problem(MapYaml::of_scale(-0.05)).contains("-0.05"));
    }

    #[test]
    fn no_header_makes_memory_be_taken() {
        let yaml = MapYaml::read(YAML.as_bytes()).unwrap();
        let refused = |picture: &[u8]| problem(of_picture(&yaml, picture));
        assert!(refused(b"P5 30000 30000 255\n\0\0\0").contains("30000 x 30000 pixels, more than the file can hold"));
        assert!(refused(b"P5 3 2 255\n\0\0\0").contains("value 4 of 6"));
        assert!(refused(b"P2 3 2 255\n0 0 0       ").contains("cut off"));
        assert!(refused(b"P5 0 2 255\n").contains("empty"));
        assert!(refused(b"").contains("empty"));
        assert!(refused(b"image: map.pgm").contains("neither"));
    }

    /// A white PNG of 30,000 x 30,000 pixels takes less than a megabyte.
    #[test]
    fn a_picture_that_unfolds_to_more_cells_than_a_map_may_have_is_refused() {
        let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
        let mut header = b"IHDR".to_vec();
        header.extend([30_000u32.to_be_bytes(), 30_000u32.to_be_bytes()].concat());
        header.extend([8, 0, 0, 0, 0]);
        bytes.extend(13u32.to_be_bytes());
        bytes.extend(&header);
        bytes.extend(crc32(&header).to_be_bytes());
        bytes.resize(2_000_000, 0);
        let yaml = MapYaml::read(YAML.as_bytes()).unwrap();
        assert!(problem(of_picture(&yaml, &bytes)).contains("30000 x 30000"));
    }

    fn crc32(bytes: &[u8]) -> u32 {
        let step = |crc: u32, byte: &u8| {
            (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 })
        };
        !bytes.iter().fold(!0, step)
    }

    #[test]
    fn a_map_of_probabilities_is_read_with_its_size_in_its_header() {
        let text = "robot_specifications->resolution  10\nglobal_map[0]: 2 3\n-1 0.25 1\n0 0.5 -1\n";
        assert!(looks_like_probabilities(text.as_bytes()));
        let map = read_probabilities(text.as_bytes()).unwrap();
        assert_eq!((map.width, map.height, map.resolution), (2, 3, 0.1));
        let refused = |from: &str, to: &str| problem(read_probabilities(text.replace(from, to).as_bytes()));
        assert!(refused("2 3", "30000 30000").contains("30000 x 30000"));
        assert!(refused("2 3", "2 4").contains("cut off"));
        assert!(refused("0.25", "abc").contains("\"abc\""));
        assert!(refused("0.25", "3").contains('3'));
        assert!(refused("->resolution  10", "->resolution  -10").contains("resolution is -0.1"));
        assert!(refused("global_map", "nothing").contains("global_map"));
    }

    /// In the file that CMU gave out, 1 is free, against its description; in others 1 is occupied.
    #[test]
    fn which_way_round_probabilities_are_is_told_by_rooms_being_wider_than_walls() {
        let room = |wall: f32, free: f32| {
            let mut text = String::from("robot_specifications->resolution 10\nglobal_map[0]: 12 12\n");
            for i in 0..144 {
                let (x, y) = (i / 12, i % 12);
                let value = if [x, y].iter().any(|v| [0, 11].contains(v)) {
                    -1.0
                } else if [x, y].iter().any(|v| [1, 10].contains(v)) {
                    wall
                } else {
                    free
                };
                let _ = write!(text, "{value} ");
            }
            read_probabilities(text.as_bytes()).unwrap()
        };
        let (described, inverted) = (room(1.0, 0.0), room(0.0, 1.0));
        assert_eq!(described.occupancy[13], 1.0);
        assert_eq!(described.occupancy[5 * 12 + 5], 0.0);
        let known =
            |map: &OccupancyMap| map.occupancy.iter().map(|v| if v.is_nan() { -1.0 } else { *v }).collect::<Vec<f32>>();
        assert_eq!(known(&described), known(&inverted));
        assert!(described.notes.is_empty() && inverted.notes[0].contains("free"), "{:?}", inverted.notes);
    }
}
