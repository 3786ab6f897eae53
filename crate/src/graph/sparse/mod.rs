//! Large symmetric systems made of small dense blocks, as joint estimation of many poses gives them: one block row per
//! pose, one off-diagonal block per pair of poses that a measurement ties together, and few of those.
//!
//! Kept beside faer 0.24 (`npm run bench -- cholesky_`; one thread; faer's time over ours, natively / in WebAssembly under Node):
//!
//! | pose graph | order, factor and solve | factor and solve again |
//! |---|---|---|
//! | 1,000 poses in the plane | 2.8 / 2.4 | 3.6 / 3.6 |
//! | 7,000 poses in the plane | 1.4 / 4.3 | 1.9 / 4.1 |
//! | 1,000 poses in space | 4.0 / 3.5 | 2.8 / 2.5 |
//!
//! Blocks of fixed size and an order of elimination of the poses, not of single entries, make the difference. In WebAssembly faer
//! adds 218 kB, against 38 kB, and its results depend on the instructions that it finds on a machine; ours do not.

pub(crate) mod block_cholesky;
pub(crate) mod block_matrix;
mod dense_block;
mod factor_pattern;
mod ordering;

pub use block_cholesky::{BlockCholesky, Factor, NotPositiveDefinite};
pub use block_matrix::BlockMatrix;
