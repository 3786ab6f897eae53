//! Recordings with their truth: those of ../shared/data/rgbd, whole, thinned out or walked to and fro, and generated ones.

use std::fs;
use std::path::{Path, PathBuf};

use jpeg_encoder::{ColorType, Encoder};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use scanstitch::camera::{DepthImage, Pinhole};
use scanstitch::geometry::Pose3;
use scanstitch::io::trajectory;
use scanstitch_scene::apartment::{Apartment, Tour, WalkOptions};
use scanstitch_scene::random::Random;
use scanstitch_scene::ring::Ring;
use scanstitch_scene::space::{DepthSensor, RenderedFrame, Space};

/// The folder of the real recordings.
pub const DATA: &str = "../shared/data/rgbd";

/// Whether they are at hand; says so where they are not.
pub fn are_there() -> bool {
    let are_there = std::path::Path::new(DATA).is_dir();
    if !are_there {
        eprintln!("skipped: ../shared/data is absent");
    }
    are_there
}

/// Depth images and where they were taken.
#[derive(Clone)]
pub struct Recording {
    pub name: String,
    /// The files' bytes.
    pub depth: Vec<Vec<u8>>,
    /// The colour images' bytes, one a frame, or none at all.
    pub color: Vec<Vec<u8>>,
    /// fx, fy, cx, cy where the default is not right.
    pub intrinsics: Option<[f64; 4]>,
    /// Raw values per metre where the default is not right.
    pub depth_scale: Option<f64>,
    /// `T_world_camera`, x right, y down, z forward.
    pub truth: Vec<Pose3>,
    /// Frames that belong nowhere, so that no pose of theirs is right.
    pub strangers: Vec<usize>,
}

impl Recording {
    /// Its first frames.
    pub fn first(mut self, frames: usize) -> Self {
        self.depth.truncate(frames);
        self.color.truncate(frames);
        self.truth.truncate(frames);
        self
    }
}

/// Which frames of a recording are run.
#[derive(Debug, Clone, Copy)]
pub enum Choice {
    Every(usize),
    TwoThirds(u64),
    /// All, walked to and fro so many times.
    ToAndFro(usize),
}

impl Choice {
    fn keeps(self, index: usize) -> bool {
        match self {
            Self::Every(stride) => index.is_multiple_of(stride),
            Self::ToAndFro(_) => true,
            Self::TwoThirds(seed) => {
                let mixed = (index as u64 + 1000 * seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                index == 0 || (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 33 & 0xFFFF < 43_690
            }
        }
    }

    fn of<T: Clone>(self, all: &[T]) -> Vec<T> {
        let kept = all.iter().enumerate().filter(|(index, _)| self.keeps(*index)).map(|(_, item)| item.clone());
        let mut kept: Vec<T> = kept.collect();
        if let Self::ToAndFro(times) = self {
            let there = kept.clone();
            for time in 1..times {
                let way: Vec<T> = if time % 2 == 1 { there.iter().rev().cloned().collect() } else { there.clone() };
                kept.extend(way);
            }
        }
        kept
    }

    /// The recording with the chosen frames.
    pub fn apply(self, recording: &Recording) -> Recording {
        Recording {
            depth: self.of(&recording.depth),
            color: self.of(&recording.color),
            truth: self.of(&recording.truth),
            ..recording.clone()
        }
    }
}

fn numbered(folder: &Path, suffix: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
        .unwrap_or_default();
    files.retain(|path| path.to_string_lossy().ends_with(suffix));
    let number = |path: &PathBuf| -> u64 {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.chars().filter(char::is_ascii_digit).collect::<String>().parse().unwrap_or(0)
    };
    files.sort_by_key(number);
    files
}

fn bytes(files: &[PathBuf]) -> Vec<Vec<u8>> {
    files.iter().map(|path| fs::read(path).expect("readable")).collect()
}

fn matrix_pose(rows: &[f64]) -> Pose3 {
    let matrix = Matrix3::from_fn(|row, column| rows[4 * row + column]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    Isometry3::from_parts(Translation3::new(rows[3], rows[7], rows[11]), rotation)
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().filter_map(|token| token.parse().ok()).collect()
}

/// A floor of the homework's flat: `first` or `second`.
pub fn floor(which: &str) -> Recording {
    let folder = Path::new(DATA).join(format!("apartment_{which}_floor"));
    let truth = trajectory::read(&fs::read(folder.join("GT_pose.npy")).unwrap()).unwrap();
    let flip = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let truth = truth.poses().unwrap().iter().map(|pose| pose * flip).collect();
    let depth = bytes(&numbered(&folder.join("depth"), ".png"));
    let color = bytes(&numbered(&folder.join("rgb"), ".png"));
    Recording {
        name: format!("{which} floor"),
        depth,
        color,
        intrinsics: None,
        depth_scale: None,
        truth,
        strangers: Vec::new(),
    }
}

/// 50 frames of a Kinect.
pub fn fusion_demo() -> Recording {
    let folder = Path::new(DATA).join("fusion_demo50/rgbd-frames");
    let depth = bytes(&numbered(&folder, ".depth.png"));
    let color = bytes(&numbered(&folder, ".color.png"));
    let truth = numbered(&folder, ".pose.txt")
        .iter()
        .map(|path| matrix_pose(&numbers(&fs::read_to_string(path).unwrap())))
        .collect();
    Recording {
        name: "fusion_demo50".into(),
        depth,
        color,
        intrinsics: Some([585.0, 585.0, 320.0, 240.0]),
        depth_scale: None,
        truth,
        strangers: Vec::new(),
    }
}

/// Five frames of another depth camera.
pub fn redwood() -> Recording {
    let folder = Path::new(DATA).join("redwood5");
    let log = numbers(&fs::read_to_string(folder.join("odometry.log")).unwrap());
    let truth = log.chunks_exact(19).map(|pose| matrix_pose(&pose[3..])).collect();
    let depth = bytes(&numbered(&folder.join("depth"), ".png"));
    let color = bytes(&numbered(&folder.join("color"), ".jpg"));
    Recording {
        name: "redwood5".into(),
        depth,
        color,
        intrinsics: Some([525.0, 525.0, 319.5, 239.5]),
        depth_scale: None,
        truth,
        strangers: Vec::new(),
    }
}

/// The images of a real camera in the folder of recordings; without truth but for `kinect_office`.
pub fn camera(name: &str) -> Recording {
    let folder = Path::new(DATA).join(name);
    let (depth, color) = match name {
        "kinect_office" => (numbered(&folder, ".depth.png"), numbered(&folder, ".color.jpg")),
        _ => (numbered(&folder.join("depth"), ".png"), numbered(&folder.join("rgb"), ".jpg")),
    };
    let poses = numbered(&folder, ".pose.txt");
    let (intrinsics, depth_scale) = match name {
        "kinect_office" => ([585.0, 585.0, 320.0, 240.0], None),
        "kinect_pioneer" => ([521.0, 521.0, 325.0, 249.0], Some(5000.0)),
        "habitat_16bit" => ([256.0, 256.0, 256.0, 256.0], Some(6553.5)),
        _ => ([384.0, 384.0, 320.0, 237.0], None),
    };
    Recording {
        name: name.into(),
        depth: bytes(&depth),
        color: bytes(&color),
        intrinsics: Some(intrinsics),
        depth_scale,
        truth: poses.iter().map(|path| matrix_pose(&numbers(&fs::read_to_string(path).unwrap()))).collect(),
        strangers: Vec::new(),
    }
}

/// Where a generated walk goes.
#[derive(Debug, Clone, Copy)]
pub enum Way {
    /// Through a generated flat.
    Flat(Tour),
    /// Round a corridor and so many metres further.
    Ring(f64),
}

/// A walk through a generated world.
#[derive(Debug, Clone, Copy)]
pub struct Walk {
    pub way: Way,
    /// m
    pub step: f64,
    /// degrees
    pub turn: f64,
    /// 8 or 16.
    pub bits: u8,
    /// Standard deviation of 16-bit depth over its square (1/m).
    pub noise: f64,
    /// Frames at the most.
    pub frames: usize,
    /// Ratio of the focal length given to the engine to the true one.
    pub focal: f64,
    /// Whether there are colour images.
    pub has_color: bool,
}

impl Walk {
    /// The recording of the flat with this seed; images are kept in the folder `cache` for the next time, colours apart from
    /// depth: they are the same for every depth camera.
    pub fn recording(&self, seed: u64, cache: Option<&Path>) -> Recording {
        let camera = Pinhole::from_field_of_view(512, 512, std::f64::consts::FRAC_PI_2).expect("a camera");
        let sensor =
            if self.bits > 8 { DepthSensor::Millimetres { square_noise: self.noise } } else { DepthSensor::HOMEWORK };
        let (space, truth) = self.world(seed);
        let Self { step, turn, bits, noise, .. } = self;
        let way = match self.way {
            Way::Flat(tour) => format!("{tour:?}"),
            Way::Ring(beyond) => format!("Ring{beyond}"),
        };
        let walk = format!("{seed}_{way}_{step}_{turn}");
        let cached = |name: String, suffix: &'static str, render: &dyn Fn(usize, &Pose3) -> Vec<u8>| -> Vec<Vec<u8>> {
            let folder = cache.map(|cache| cache.join(name));
            if let Some(folder) = &folder {
                fs::create_dir_all(folder).expect("a folder for the cache");
            }
            let image = |(index, pose): (usize, &Pose3)| {
                let file = folder.as_ref().map(|folder| folder.join(format!("{index}.{suffix}")));
                if let Some(bytes) = file.as_ref().and_then(|file| fs::read(file).ok()) {
                    return bytes;
                }
                let bytes = render(index, pose);
                if let Some(file) = file {
                    fs::write(file, &bytes).expect("room in the cache");
                }
                bytes
            };
            truth.iter().enumerate().map(image).collect()
        };
        let depth = cached(format!("{walk}_{bits}_{noise}"), "pgm", &|index, pose| {
            let depth = space.depth(pose, &camera);
            let mut random = Random::new(seed * 1000 + index as u64);
            pgm(&sensor.measure(&depth, camera.width, &mut random))
        });
        let color = |_: usize, pose: &Pose3| jpeg(&space.render(pose, &camera));
        let color = if self.has_color { cached(format!("{walk}_color"), "jpg", &color) } else { Vec::new() };
        let told = [camera.fx * self.focal, camera.fy * self.focal, camera.cx, camera.cy];
        let intrinsics = (self.focal != 1.0).then_some(told);
        Recording {
            name: format!("seed {seed}"),
            depth,
            color,
            intrinsics,
            depth_scale: None,
            truth,
            strangers: Vec::new(),
        }
    }

    fn world(&self, seed: u64) -> (Space, Vec<Pose3>) {
        match self.way {
            Way::Flat(tour) => {
                let apartment = Apartment::generate(seed);
                let options = WalkOptions {
                    tour,
                    step: self.step,
                    turn: self.turn.to_radians(),
                    num_frames: Some(self.frames),
                    ..WalkOptions::default()
                };
                let walk = apartment.walk(&options);
                (apartment.space, walk)
            }
            Way::Ring(beyond) => {
                let ring = Ring::generate(seed);
                let mut walk = ring.walk(self.step, self.turn.to_radians(), beyond);
                walk.truncate(self.frames);
                (ring.space, walk)
            }
        }
    }
}

fn jpeg(frame: &RenderedFrame) -> Vec<u8> {
    jpeg_of(&frame.rgb, frame.width, frame.height)
}

/// A colour picture as a file; three bytes a pixel.
pub fn jpeg_of(rgb: &[u8], width: usize, height: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = Encoder::new(&mut bytes, 90);
    encoder.encode(rgb, width as u16, height as u16, ColorType::Rgb).expect("a picture");
    bytes
}

/// A depth image as a file.
pub fn pgm(image: &DepthImage) -> Vec<u8> {
    let largest = if image.bits == 8 { 255 } else { 65_535 };
    let mut bytes = format!("P5 {} {} {largest}\n", image.width, image.height).into_bytes();
    if image.bits == 8 {
        bytes.extend(image.values.iter().map(|&value| value as u8));
    } else {
        bytes.extend(image.values.iter().flat_map(|value| value.to_be_bytes()));
    }
    bytes
}
