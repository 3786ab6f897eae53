//! What happens to recordings: frames of elsewhere, blanks, blocks out of order, and depth that is not what it should be.

use scanstitch::camera::DepthImage;
use scanstitch::io::depth_image;
use scanstitch_scene::random::Random;

use super::recordings::{Recording, pgm};

/// One way to spoil a recording.
#[derive(Debug, Clone, Copy)]
pub enum Disturbance {
    /// Every seventh frame is one of another flat.
    Strangers,
    /// So are five in a row.
    RunOfStrangers,
    FirstIsStranger,
    FirstIsBlack,
    /// Every ninth frame is black but for a pixel.
    Black,
    /// Every fifth frame twice.
    Repeated,
    /// Twelve frames in reverse order.
    ReversedBlock,
    /// Ten frames twice.
    RepeatedBlock,
    /// Forty frames in any order.
    Shuffled,
    /// Every eighth frame is mirrored left to right.
    Mirrored,
    /// Every sixth frame has no depth in its left half.
    HalfMissing,
    /// Four frames with noise of 4 % of the depth.
    NoiseBurst,
}

impl Disturbance {
    pub const ALL: [(&'static str, Self); 12] = [
        ("strangers", Self::Strangers),
        ("five strangers in a row", Self::RunOfStrangers),
        ("the first a stranger", Self::FirstIsStranger),
        ("the first black", Self::FirstIsBlack),
        ("black", Self::Black),
        ("repeated", Self::Repeated),
        ("a block reversed", Self::ReversedBlock),
        ("a block repeated", Self::RepeatedBlock),
        ("shuffled", Self::Shuffled),
        ("mirrored", Self::Mirrored),
        ("half missing", Self::HalfMissing),
        ("noise burst", Self::NoiseBurst),
    ];

    /// The recording spoilt; `other` is one of another place.
    pub fn apply(self, recording: &Recording, other: &Recording) -> Recording {
        let num = recording.depth.len();
        match self {
            Self::Strangers => replaced(recording, every(7, num), other, |index| index % other.depth.len()),
            Self::RunOfStrangers => replaced(recording, (20..25).collect(), other, |index| index % other.depth.len()),
            Self::FirstIsStranger => replaced(recording, vec![0], other, |_| 7),
            Self::FirstIsBlack => broken(recording, vec![0], black),
            Self::Black => broken(recording, every(9, num), black),
            Self::Mirrored => broken(recording, every(8, num), mirror),
            Self::Repeated => {
                let order = (0..num).flat_map(|index| std::iter::repeat_n(index, 1 + usize::from(index % 5 == 4)));
                ordered(recording, &order.collect::<Vec<_>>())
            }
            Self::ReversedBlock => {
                ordered(recording, &(0..20).chain((20..32).rev()).chain(32..num).collect::<Vec<_>>())
            }
            Self::RepeatedBlock => ordered(recording, &(0..30).chain(20..num).collect::<Vec<_>>()),
            Self::Shuffled => {
                let mut order: Vec<usize> = (0..num).collect();
                let mut random = Random::new(num as u64);
                for index in (6..num.min(46)).rev() {
                    order.swap(index, random.uniform(5.0, (index + 1) as f64) as usize);
                }
                ordered(recording, &order)
            }
            Self::HalfMissing => spoilt(recording, &every(6, num), |_, image| {
                let width = image.width;
                image
                    .values
                    .iter_mut()
                    .enumerate()
                    .for_each(|(at, value)| *value *= u16::from(at % width >= width / 2));
            }),
            Self::NoiseBurst => spoilt(recording, &(22..26.min(num)).collect::<Vec<_>>(), |index, image| {
                let mut random = Random::new(index as u64);
                for value in &mut image.values {
                    let noisy = f64::from(*value) * (1.0 + 0.04 * random.normal());
                    *value = if *value == 0 { 0 } else { noisy.round().clamp(1.0, 255.0) as u16 };
                }
            }),
        }
    }
}

/// Every so many frames, not the first.
fn every(stride: usize, num: usize) -> Vec<usize> {
    (1..num).filter(|index| index % stride == stride - 1).collect()
}

/// Frames `strangers` are replaced by the other recording's frames of these numbers.
fn replaced(recording: &Recording, strangers: Vec<usize>, other: &Recording, by: impl Fn(usize) -> usize) -> Recording {
    let mut recording = recording.clone();
    for &index in &strangers {
        recording.depth[index].clone_from(&other.depth[by(index)]);
        if let Some(color) = recording.color.get_mut(index) {
            *color = other.color.get(by(index)).cloned().unwrap_or_default();
        }
    }
    Recording { strangers, ..recording }
}

/// Frames that show nothing, or nothing that can be right. Without their colours, where they are changed.
fn broken(recording: &Recording, strangers: Vec<usize>, change: impl Fn(&mut DepthImage)) -> Recording {
    let mut recording = spoilt(recording, &strangers, |_, image| change(image));
    for &index in &strangers {
        recording.color.get_mut(index).into_iter().for_each(Vec::clear);
    }
    Recording { strangers, ..recording }
}

fn spoilt(recording: &Recording, which: &[usize], spoil: impl Fn(usize, &mut DepthImage)) -> Recording {
    let mut recording = recording.clone();
    for &index in which {
        recording.depth[index] = changed(&recording.depth[index], |image| spoil(index, image));
    }
    recording
}

fn ordered(recording: &Recording, order: &[usize]) -> Recording {
    Recording {
        depth: order.iter().map(|&index| recording.depth[index].clone()).collect(),
        color: order.iter().filter_map(|&index| recording.color.get(index).cloned()).collect(),
        truth: order.iter().map(|&index| recording.truth[index]).collect(),
        ..recording.clone()
    }
}

fn changed(bytes: &[u8], change: impl FnOnce(&mut DepthImage)) -> Vec<u8> {
    let mut image = depth_image::read(bytes).expect("a depth image");
    change(&mut image);
    pgm(&image)
}

/// Black but for one pixel, which tells the number of bits.
fn black(image: &mut DepthImage) {
    image.values.fill(0);
    image.values[0] = 9;
}

fn mirror(image: &mut DepthImage) {
    let width = image.width;
    image.values.chunks_exact_mut(width).for_each(<[u16]>::reverse);
}
