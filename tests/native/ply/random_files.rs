//! Files of random layouts, and what they hold.
#![allow(clippy::format_push_string)] // Headers are put together line by line; here speed does not matter.

use glam::Vec3;

/// Random numbers, the same every time (Steele and Vigna's `SplitMix64`).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.bits() % limit as u64) as usize
    }

    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    pub fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }
}

/// A scalar type: its names, how a value is written in binary, and the largest whole value used of it.
pub type Type = ([&'static str; 2], fn(f64) -> Vec<u8>, usize);

pub const TYPES: [Type; 8] = [
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
pub struct Builder {
    pub header: String,
    pub body: Vec<u8>,
    pub format: &'static str,
}

impl Builder {
    pub fn value(&mut self, (_, bytes, _): Type, value: f64) {
        match self.format {
            "ascii" => self.body.extend(format!("{value} ").bytes()),
            "binary_little_endian" => self.body.extend(bytes(value)),
            _ => self.body.extend(bytes(value).into_iter().rev()),
        }
    }

    pub fn end_instance(&mut self, random: &mut Random) {
        if self.format == "ascii" {
            self.body.extend(random.pick(&["\n", "\r\n", " \n", "\n\n"]).bytes());
        }
    }

    /// A list of up to three items.
    pub fn list(&mut self, random: &mut Random, count: Type, item: Type) {
        let length = random.below(4);
        self.value(count, length as f64);
        for _ in 0..length {
            self.value(item, random.below(100) as f64);
        }
    }

    /// An element that means nothing here.
    pub fn other_element(&mut self, random: &mut Random, name: &str) {
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
pub fn random_file(random: &mut Random) -> (Vec<u8>, Vec<Vec3>) {
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
