//! Pieces of surface into the cells of a view, the nearest of each cell.

use super::eye::{Eye, LANES, MIN_DEPTH, Transform, single};
use super::packed::PackedSurfel;
use super::{NOTHING, Piece, ProjectiveTarget};
use crate::camera::Pinhole;
use crate::geometry::Pose3;

/// A view that is being drawn.
///
/// What is far away or has been seen closely has many pieces in a cell. So all that is done of most of them is to find the
/// nearest, without a branch that could be guessed wrong; what it looks like is fetched in the end, once a cell.
pub struct Drawing<'a> {
    camera: Pinhole,
    T_world_view: Pose3,
    /// Of each cell the depth of the nearest piece and, in the lower half, its place among all that were added: bits of
    /// positive floats are ordered as they are, so the nearest is the least, and of those as near the first. Behind the
    /// cells some for what is not in view.
    nearest: Vec<u64>,
    sheets: Vec<Sheet<'a>>,
    /// Which of them so many places ([`LANES`]) belong to.
    sheet_of: Vec<u32>,
}

/// Pieces that were added together.
struct Sheet<'a> {
    surfels: &'a [PackedSurfel],
    /// The caller's number of the first.
    first_number: u64,
    /// Its place.
    start: usize,
    T_world_sheet: Option<Transform>,
}

/// Where nothing has been drawn.
const NONE: u64 = u64::MAX;
/// What is seen from nowhere.
const NOWHERE: PackedSurfel = PackedSurfel { point: [f32::NAN; 3], deviation: 0.0, normal: [0.0; 3], tag: 0 };

impl<'a> Drawing<'a> {
    /// Nothing yet, as seen from `T_world_view` by a camera whose pixels are the cells.
    pub fn new(camera: &Pinhole, T_world_view: &Pose3) -> Self {
        Self {
            camera: *camera,
            T_world_view: *T_world_view,
            nearest: vec![NONE; camera.width * camera.height + LANES],
            sheets: Vec::new(),
            sheet_of: Vec::new(),
        }
    }

    /// Draws pieces of surface in the world's frame that have consecutive numbers, from `first_number` on.
    pub fn add(&mut self, first_number: u64, surfels: &'a [PackedSurfel]) {
        let start = self.put(surfels, &self.T_world_view.clone());
        self.sheets.push(Sheet { surfels, first_number, start, T_world_sheet: None });
    }

    /// The same in a frame of their own.
    pub fn add_moved(&mut self, first_number: u64, surfels: &'a [PackedSurfel], T_world_sheet: &Pose3) {
        let start = self.put(surfels, &(T_world_sheet.inverse() * self.T_world_view));
        let T_world_sheet = Some(Transform::new(T_world_sheet));
        self.sheets.push(Sheet { surfels, first_number, start, T_world_sheet });
    }

    /// Puts pieces that the view sees from a pose in their frame to their cells, where they are the nearest; the place of the
    /// first.
    fn put(&mut self, surfels: &[PackedSurfel], T_sheet_view: &Pose3) -> usize {
        let start = LANES * self.sheet_of.len();
        self.sheet_of.resize(self.sheet_of.len() + surfels.len().div_ceil(LANES), self.sheets.len() as u32);
        let (eye, viewpoint) = (Eye::new(&self.camera, T_sheet_view), single(&T_sheet_view.translation.vector));
        let (chunks, rest) = surfels.as_chunks::<LANES>();
        let mut place = start;
        for chunk in chunks {
            self.put_chunk(&eye, &viewpoint, chunk, place);
            place += LANES;
        }
        if !rest.is_empty() {
            let mut chunk = [NOWHERE; LANES];
            chunk[..rest.len()].copy_from_slice(rest);
            self.put_chunk(&eye, &viewpoint, &chunk, place);
        }
        start
    }

    #[inline]
    fn put_chunk(&mut self, eye: &Eye, viewpoint: &[f32; 3], chunk: &[PackedSurfel; LANES], place: usize) {
        let (width, height) = (self.camera.width, self.camera.height);
        let (last_column, last_row, beyond) = (width as f32, height as f32, (width * height) as u32);
        let p: [[f32; LANES]; 3] = std::array::from_fn(|axis| std::array::from_fn(|lane| chunk[lane].point[axis]));
        let n: [[f32; LANES]; 3] = std::array::from_fn(|axis| std::array::from_fn(|lane| chunk[lane].normal[axis]));
        let [x, y, z] = *viewpoint;
        let facing: [f32; LANES] = std::array::from_fn(|lane| {
            (p[0][lane] - x) * n[0][lane] + (p[1][lane] - y) * n[1][lane] + (p[2][lane] - z) * n[2][lane]
        });
        let seen = eye.T_view_world.act_on_all(&p);
        let [u, v] = eye.project_all(&seen);
        let cells: [u32; LANES] = std::array::from_fn(|lane| {
            let (u, v) = (u[lane], v[lane]);
            // Not a number fails all of these.
            let is_seen = (facing[lane] < 0.0)
                & (seen[2][lane] >= MIN_DEPTH)
                & (u >= 0.0)
                & (v >= 0.0)
                & (u < last_column)
                & (v < last_row);
            let cell = floor(v).wrapping_mul(width as u32).wrapping_add(floor(u));
            if is_seen { cell } else { beyond + lane as u32 }
        });
        for (lane, &cell) in cells.iter().enumerate() {
            let nearest = &mut self.nearest[cell as usize];
            *nearest = (*nearest).min(u64::from(seen[2][lane].to_bits()) << 32 | (place + lane) as u64);
        }
    }

    /// What has come to be seen.
    pub fn finish(self) -> ProjectiveTarget {
        let nearest = &self.nearest[..self.camera.width * self.camera.height];
        let num_seen = nearest.iter().filter(|nearest| **nearest != NONE).count();
        let (mut pieces, mut numbers) = (Vec::with_capacity(num_seen + 1), Vec::with_capacity(num_seen));
        let cell_of = |&nearest: &u64| {
            if nearest == NONE {
                return num_seen as u32;
            }
            let (depth, place) = (f32::from_bits((nearest >> 32) as u32), nearest as u32 as usize);
            let sheet = &self.sheets[self.sheet_of[place / LANES] as usize];
            let index = place - sheet.start;
            pieces.push(sheet.piece(index, depth));
            numbers.push(sheet.first_number + index as u64);
            pieces.len() as u32 - 1
        };
        let cells = nearest.iter().map(cell_of).collect();
        pieces.push(NOTHING);
        ProjectiveTarget { eye: Eye::new(&self.camera, &self.T_world_view), cells, pieces, numbers }
    }
}

impl Sheet<'_> {
    fn piece(&self, index: usize, depth: f32) -> Piece {
        let PackedSurfel { point, deviation, normal, .. } = self.surfels[index];
        match &self.T_world_sheet {
            None => Piece { point, deviation, normal, depth },
            Some(T) => Piece { point: T.act(&point), deviation, normal: T.turn(&normal), depth },
        }
    }
}

/// The whole number below one from 0 to four millions. A vector unit can do this with many, which it could not if numbers
/// out of that were to be seen to.
#[inline]
fn floor(x: f32) -> u32 {
    // From here on, floats are whole numbers, and so are their bits.
    const WHOLE: f32 = 8_388_608.0;
    let nearest = x + WHOLE;
    let is_above = u32::from(nearest - WHOLE > x);
    nearest.to_bits().wrapping_sub(WHOLE.to_bits()).wrapping_sub(is_above)
}

#[cfg(test)]
mod tests {
    use super::floor;

    #[test]
    fn the_whole_number_below_is_that() {
        for whole in [0u32, 1, 2, 63, 64, 255, 1023, 4_000_000] {
            let x = whole as f32;
            assert_eq!(floor(x), whole);
            assert_eq!(floor(x.next_up()), whole);
            assert_eq!(floor(x + 0.5), (x + 0.5) as u32);
            assert!(whole == 0 || floor(x.next_down()) == whole - 1);
        }
    }
}
