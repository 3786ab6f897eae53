//! Our sparse Cholesky factorisation beside faer's, on the normal equations of pose graphs.

use std::collections::HashMap;
use std::hint::black_box;

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Col, Side};
use scanstitch::geometry::{RigidMotion, SquareMatrix, Vector};
use scanstitch::graph::sparse::{BlockCholesky, BlockMatrix};

use crate::benchmark::Prepared;

#[derive(Clone, Copy, PartialEq)]
pub enum Work {
    All,
    Numbers,
}

/// Steps (m) between two turns; streets lie as far apart.
const BLOCK: i32 = 20;
/// The town is a torus of so many blocks either way.
const BLOCKS: i32 = 5;
/// Every so many poses a loop is closed with the last visit to the same place.
const LOOP_EVERY: usize = 3;

/// The pairs of poses that a measurement ties together: a walk along the streets of a town, with its loops.
fn edges(num_poses: usize) -> Vec<(usize, usize)> {
    let (mut place, mut heading, mut state) = ([0_i32; 2], 0, 1_u32);
    let mut last_visits = HashMap::new();
    let mut edges = Vec::new();
    for pose in 0..num_poses {
        if pose > 0 {
            edges.push((pose - 1, pose));
        }
        let last_visit = last_visits.insert(place, pose);
        edges.extend(last_visit.filter(|_| pose % LOOP_EVERY == 0).map(|earlier| (earlier, pose)));
        if pose % BLOCK as usize == 0 {
            // A generator by Knuth and Lewis; its upper bits. Left, straight on or right.
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            heading = (heading + 3 + (state >> 24) as usize % 3) % 4;
        }
        let step = [[1, 0], [0, 1], [-1, 0], [0, -1]][heading];
        place = std::array::from_fn(|axis| (place[axis] + step[axis]).rem_euclid(BLOCKS * BLOCK));
    }
    edges
}

/// Calls `add(i, j, block)` with each block of the sum of the measurements' information, i >= j.
fn for_each_block<M: RigidMotion>(num_poses: usize, mut add: impl FnMut(usize, usize, &M::Matrix)) {
    for (measurement, (i, j)) in edges(num_poses).into_iter().enumerate() {
        // About 1 cm and 1 degree; not the same for all, so that no two blocks are.
        let mut information = M::Matrix::identity() * (1e4 + (measurement % 7) as f64);
        information[(1, 0)] += 100.0;
        information[(0, 1)] += 100.0;
        add(i, i, &information);
        add(j, j, &information);
        add(j, i, &-information);
    }
    add(0, 0, &(M::Matrix::identity() * 1e6));
}

fn block_matrix<M: RigidMotion>(num_poses: usize) -> BlockMatrix<M::Matrix> {
    let mut H = BlockMatrix::new(num_poses);
    for_each_block::<M>(num_poses, |i, j, block| H.add(i, j, block));
    H
}

/// The lower triangle, entry by entry: faer has no blocks.
fn lower_triangle<M: RigidMotion>(num_poses: usize) -> SparseColMat<usize, f64> {
    let size = M::Tangent::LEN;
    let mut triplets = Vec::new();
    for_each_block::<M>(num_poses, |i, j, block| {
        for (row, column) in (0..size).flat_map(|column| (0..size).map(move |row| (row, column))) {
            if i > j || row >= column {
                triplets.push(Triplet::new(size * i + row, size * j + column, block[(row, column)]));
            }
        }
    });
    let length = size * num_poses;
    SparseColMat::try_new_from_triplets(length, length, &triplets).expect("indices within the matrix")
}

fn right_side<M: RigidMotion>(num_poses: usize) -> Vec<M::Tangent> {
    let mut b = vec![M::Tangent::zeros(); num_poses];
    for (variable, entry) in b.iter_mut().enumerate() {
        for axis in 0..M::Tangent::LEN {
            entry[axis] = ((variable + axis) as f64 * 0.37).sin();
        }
    }
    b
}

fn work(num_poses: usize) -> Option<(f64, &'static str)> {
    Some((num_poses as f64, "poses"))
}

pub fn ours<M: RigidMotion>(num_poses: usize, work_done: Work) -> Result<Prepared, String> {
    let (H, b) = (block_matrix::<M>(num_poses), right_side::<M>(num_poses));
    let mut solver = BlockCholesky::new(&H);
    let expected = by_faer::<M>(num_poses);
    let mut x = b.clone();
    solver.factor(&H).map_err(|error| error.to_string())?.solve(&mut x);
    let found = x.iter().flat_map(|block| block.as_slice()).copied();
    let largest = expected.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    if !found.zip(&expected).all(|(x, y)| (x - y).abs() <= 1e-6 * largest) {
        return Err("our factorisation has another solution than faer's".into());
    }
    Ok(Prepared {
        work: work(num_poses),
        run: Box::new(move || {
            if work_done == Work::All {
                solver = BlockCholesky::new(black_box(&H));
            }
            let mut x = b.clone();
            solver.factor(black_box(&H)).expect("it was factored before").solve(&mut x);
            black_box(x);
        }),
    })
}

fn faer_problem<M: RigidMotion>(num_poses: usize) -> (SparseColMat<usize, f64>, Col<f64>) {
    let H = lower_triangle::<M>(num_poses);
    let b: Vec<f64> = right_side::<M>(num_poses).iter().flat_map(|block| block.as_slice().to_vec()).collect();
    faer::set_global_parallelism(faer::Par::Seq);
    (H, Col::from_fn(b.len(), |row| b[row]))
}

fn by_faer<M: RigidMotion>(num_poses: usize) -> Vec<f64> {
    let (H, b) = faer_problem::<M>(num_poses);
    let symbolic = SymbolicLlt::try_new(H.symbolic(), Side::Lower).expect("a square matrix");
    let llt = Llt::try_new_with_symbolic(symbolic, H.as_ref(), Side::Lower).expect("positive definite");
    llt.solve(&b).iter().copied().collect()
}

pub fn faer<M: RigidMotion>(num_poses: usize, work_done: Work) -> Result<Prepared, String> {
    let (H, b) = faer_problem::<M>(num_poses);
    let symbolic = || SymbolicLlt::try_new(black_box(&H).symbolic(), Side::Lower);
    let mut prepared = symbolic().map_err(|error| format!("{error:?}"))?;
    Ok(Prepared {
        work: work(num_poses),
        run: Box::new(move || {
            if work_done == Work::All {
                prepared = SymbolicLlt::try_new(black_box(&H).symbolic(), Side::Lower).expect("a square matrix");
            }
            let llt = Llt::try_new_with_symbolic(prepared.clone(), black_box(&H).as_ref(), Side::Lower);
            black_box(llt.expect("positive definite").solve(&b));
        }),
    })
}
