//! Large symmetric systems made of small dense blocks, as joint estimation of many poses gives them: one block row per
//! pose, one off-diagonal block per pair of poses that a measurement ties together, and few of those.

pub mod block_cholesky;
pub mod block_matrix;
mod dense_block;
mod factor_pattern;
mod ordering;

pub use block_cholesky::{BlockCholesky, Factor, NotPositiveDefinite};
pub use block_matrix::BlockMatrix;
