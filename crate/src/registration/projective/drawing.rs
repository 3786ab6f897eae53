//! Pieces of surface into the cells of a view, the nearest of each cell.

use super::eye::{Eye, LANES, between, dot, single};
use super::{EMPTY, NOTHING, Piece, ProjectiveTarget};
use crate::camera::Pinhole;
use crate::geometry::Pose3;

/// Columns of numbers of pieces of surface, world frame, all of one length.
#[derive(Clone, Copy)]
pub struct Columns<'a> {
    /// x, y and z of the points (m).
    pub points: [&'a [f32]; 3],
    /// x, y and z of the unit normals.
    pub normals: [&'a [f32]; 3],
    /// Standard deviations along the normals (m).
    pub deviations: &'a [f32],
}

/// A view that is being drawn.
pub struct Drawing {
    eye: Eye,
    viewpoint: [f32; 3],
    /// The nearest depth of each cell.
    depths: Vec<f32>,
    /// Index into `pieces` by cell; [`EMPTY`] where nothing is seen.
    cells: Vec<u32>,
    pieces: Vec<Piece>,
    numbers: Vec<u64>,
}

impl Drawing {
    /// Nothing yet, as seen from `T_world_view` by a camera whose pixels are the cells.
    pub fn new(camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let num_cells = camera.width * camera.height;
        Self {
            eye: Eye::new(camera, T_world_view),
            viewpoint: single(&T_world_view.translation.vector),
            depths: vec![f32::INFINITY; num_cells],
            cells: vec![EMPTY; num_cells],
            pieces: Vec::with_capacity(num_cells / 2),
            numbers: Vec::with_capacity(num_cells / 2),
        }
    }

    /// Draws pieces of surface that have consecutive numbers, from `first` on.
    pub fn add(&mut self, first: u64, columns: Columns<'_>) {
        let Columns { points, normals, deviations } = columns;
        let lanes = |columns: [&[f32]; 3], start: usize| -> Option<[[f32; LANES]; 3]> {
            let [x, y, z] = columns.map(|column| column.get(start..)?.first_chunk::<LANES>().copied());
            Some([x?, y?, z?])
        };
        let mut start = 0;
        while let (Some(p), Some(n)) = (lanes(points, start), lanes(normals, start)) {
            let [x, y, z] = self.viewpoint;
            let facing: [f32; LANES] = std::array::from_fn(|lane| {
                (p[0][lane] - x) * n[0][lane] + (p[1][lane] - y) * n[1][lane] + (p[2][lane] - z) * n[2][lane]
            });
            let seen = self.eye.T_view_world.act_on_all(&p);
            let [u, v] = self.eye.project_all(&seen);
            for lane in 0..LANES {
                let depth = seen[2][lane];
                if facing[lane] < 0.0
                    && let Some(cell) = self.eye.inside(u[lane], v[lane], depth)
                {
                    let index = start + lane;
                    let (point, normal) = (p.map(|axis| axis[lane]), n.map(|axis| axis[lane]));
                    let piece = || Piece { point, deviation: deviations[index], normal, depth };
                    self.put(first + index as u64, cell, depth, piece);
                }
            }
            start += LANES;
        }
        for index in start..deviations.len() {
            let (point, normal) = (points.map(|axis| axis[index]), normals.map(|axis| axis[index]));
            self.add_one(first + index as u64, point, normal, deviations[index]);
        }
    }

    pub(super) fn add_one(&mut self, number: u64, point: [f32; 3], normal: [f32; 3], deviation: f32) {
        let seen = self.eye.T_view_world.act(&point);
        if dot(&between(&self.viewpoint, &point), &normal) < 0.0
            && let Some(cell) = self.eye.cell(&seen)
        {
            let depth = seen[2];
            self.put(number, cell, depth, || Piece { point, deviation, normal, depth });
        }
    }

    #[inline]
    fn put(&mut self, number: u64, (column, row): (usize, usize), depth: f32, piece: impl FnOnce() -> Piece) {
        let cell = row * self.eye.camera.width + column;
        if depth >= self.depths[cell] {
            return;
        }
        self.depths[cell] = depth;
        if let Some(hidden) = self.pieces.get_mut(self.cells[cell] as usize) {
            *hidden = piece();
            self.numbers[self.cells[cell] as usize] = number;
        } else {
            self.cells[cell] = self.pieces.len() as u32;
            self.pieces.push(piece());
            self.numbers.push(number);
        }
    }

    /// What has come to be seen.
    pub fn finish(self) -> ProjectiveTarget {
        let Self { eye, mut cells, pieces: drawn, numbers: drawn_numbers, .. } = self;
        let (mut pieces, mut numbers) = (Vec::with_capacity(drawn.len() + 1), Vec::with_capacity(drawn.len()));
        // Neighbours are looked at together.
        for cell in &mut cells {
            if *cell == EMPTY {
                *cell = drawn.len() as u32;
            } else {
                let place = *cell as usize;
                *cell = pieces.len() as u32;
                pieces.push(drawn[place]);
                numbers.push(drawn_numbers[place]);
            }
        }
        pieces.push(NOTHING);
        ProjectiveTarget { eye, cells, pieces, numbers }
    }
}
