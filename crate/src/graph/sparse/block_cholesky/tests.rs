//! Against dense matrices, in every pattern that estimation makes, and on systems that nothing determines.

use super::*;
use nalgebra::{DMatrix, SMatrix, SVector};

/// Uniform numbers in -1..1 from a constant seed (xorshift64*).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11
    }

    fn uniform(&mut self) -> f64 {
        self.next() as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn block<const B: usize>(&mut self) -> SMatrix<f64, B, B> {
        SMatrix::from_fn(|_, _| self.uniform())
    }
}

/// A sum of `J^T J` over the edges, each given either way round, and over a prior of each variable, as estimation
/// makes it.
fn accumulate<const B: usize>(H: &mut BlockMatrix<SMatrix<f64, B, B>>, edges: &[(usize, usize)], random: &mut Random) {
    for i in 0..H.num_variables() {
        let J = random.block::<B>();
        H.add(i, i, &(J.tr_mul(&J) + SMatrix::identity() * 0.1));
    }
    for &(i, j) in edges {
        let (J_i, J_j) = (random.block::<B>(), random.block::<B>());
        H.add(i, i, &J_i.tr_mul(&J_i));
        H.add(j, j, &J_j.tr_mul(&J_j));
        H.add(i, j, &J_i.tr_mul(&J_j));
    }
}

fn dense<const B: usize>(H: &BlockMatrix<SMatrix<f64, B, B>>) -> DMatrix<f64> {
    let n = H.num_variables();
    DMatrix::from_fn(n * B, n * B, |row, column| H.block(row / B, column / B)[(row % B, column % B)])
}

fn check_against_dense<const B: usize>(
    name: &str,
    cholesky: &mut BlockCholesky<SMatrix<f64, B, B>>,
    H: &BlockMatrix<SMatrix<f64, B, B>>,
) {
    let n = H.num_variables();
    let factor = cholesky.factor(H).unwrap_or_else(|error| panic!("{name}, B = {B}: {error}"));
    let inverse = dense(H).cholesky().expect("positive definite by construction").inverse();
    let rhs: Vec<_> = (0..n).map(|i| SVector::<f64, B>::from_fn(|row, _| ((i * B + row) as f64).sin())).collect();
    let expected = &inverse * DMatrix::from_fn(n * B, 1, |row, _| rhs[row / B][row % B]);
    let mut x = rhs;
    factor.solve(&mut x);
    for i in 0..n {
        for (j, block) in factor.inverse_columns(i).iter().enumerate() {
            let expected = inverse.fixed_view::<B, B>(j * B, i * B);
            assert!((block - expected).amax() < 1e-9 * inverse.amax(), "{name}, B = {B}: columns of {i} at {j}");
        }
        for row in 0..B {
            let error = (x[i][row] - expected[i * B + row]).abs();
            assert!(error < 1e-9 * inverse.amax(), "{name}, B = {B}: x at {i}");
        }
    }
}

type Edges = Vec<(usize, usize)>;

/// Name, number of variables and edges.
fn patterns() -> Vec<(&'static str, usize, Edges)> {
    let mut random = Random(1);
    let mut pairs = |n: usize, count: usize| -> Edges {
        let pair = |random: &mut Random| (random.next() as usize % n, random.next() as usize % n);
        (0..count).map(|_| pair(&mut random)).filter(|(i, j)| i != j).collect()
    };
    let chain = |n: usize| (1..n).map(|j| (j - 1, j)).collect::<Edges>();
    let star = |n: usize, hub: usize| (0..n).filter(|&i| i != hub).map(|i| (hub, i)).collect::<Vec<_>>();
    let window = |n: usize, width: usize| {
        (0..n).flat_map(|j| (j.saturating_sub(width)..j).map(move |i| (j, i))).collect::<Vec<_>>()
    };
    let mut patterns = vec![
        ("nothing", 0, vec![]),
        ("single", 1, vec![]),
        ("pair", 2, vec![(1, 0)]),
        ("no edges", 7, vec![]),
        ("chain", 20, chain(20)),
        ("chain backwards", 20, (1..20).map(|j| (20 - j, 19 - j)).collect()),
        ("chain with loops", 32, [chain(32), pairs(32, 10)].concat()),
        ("the same edge again and either way round", 5, [chain(5), vec![(3, 2), (2, 3), (4, 0), (0, 4)]].concat()),
        ("star", 24, star(24, 0)),
        ("star about a middle variable", 24, star(24, 17)),
        ("full", 12, window(12, 12)),
        ("window of 4", 24, window(24, 4)),
        ("disconnected chains", 20, chain(20).into_iter().filter(|(i, _)| i % 7 != 3).collect()),
    ];
    patterns.extend((0..12).map(|i| ("random", 5 + 2 * i, pairs(5 + 2 * i, 3 + i * i / 2))));
    patterns
}

fn check<const B: usize>() {
    let mut random = Random(2);
    for (name, n, edges) in patterns() {
        let mut H = BlockMatrix::<SMatrix<f64, B, B>>::new(n);
        accumulate(&mut H, &edges, &mut random);
        let mut cholesky = BlockCholesky::new(&H);
        check_against_dense(name, &mut cholesky, &H);
        // The same pattern with new numbers.
        H.clear();
        assert_eq!(dense(&H).amax(), 0.0);
        accumulate(&mut H, &edges, &mut random);
        check_against_dense(name, &mut cholesky, &H);
        // Another pattern, and another size.
        if n > 2 {
            accumulate(&mut H, &[(0, n - 1), (n / 2, 0)], &mut random);
            check_against_dense(name, &mut cholesky, &H);
        }
        let mut larger = BlockMatrix::new(n + 1);
        accumulate(&mut larger, &[], &mut random);
        check_against_dense(name, &mut cholesky, &larger);
    }
}

#[test]
fn agrees_with_dense_for_blocks_of_1() {
    check::<1>();
}

#[test]
fn agrees_with_dense_for_blocks_of_3() {
    check::<3>();
}

#[test]
fn agrees_with_dense_for_blocks_of_6() {
    check::<6>();
}

#[test]
fn order_is_a_permutation_and_its_inverse() {
    for (name, n, edges) in patterns() {
        let places: Vec<_> = edges.iter().map(|&(i, j)| (i.min(j) as u32, i.max(j) as u32)).collect();
        let pattern = FactorPattern::new(n, &places);
        for (position, &variable) in pattern.variables.iter().enumerate() {
            assert_eq!(pattern.positions[variable as usize] as usize, position, "{name}");
        }
        assert_eq!(pattern.variables.len(), n, "{name}");
        assert!(pattern.rows.len() <= n * n.saturating_sub(1) / 2, "{name}");
    }
}

#[test]
fn refuses_what_is_not_positive_definite_and_recovers() {
    let edges: Vec<_> = (1..6).map(|j| (j - 1, j)).collect();
    let mut good = BlockMatrix::<SMatrix<f64, 3, 3>>::new(6);
    accumulate(&mut good, &edges, &mut Random(3));
    let mut cholesky = BlockCholesky::new(&good);
    let strong: SMatrix<f64, 3, 3> = SMatrix::identity() * 1e3;
    let cases: [(&str, usize, usize, SMatrix<f64, 3, 3>); 6] = [
        ("a negative diagonal block", 4, 4, -strong),
        ("a coupling stronger than the diagonal", 2, 3, strong),
        ("NaN on the diagonal", 4, 4, SMatrix::repeat(f64::NAN)),
        ("NaN off the diagonal", 1, 2, SMatrix::repeat(f64::NAN)),
        ("infinity on the diagonal", 5, 5, SMatrix::repeat(f64::INFINITY)),
        ("infinity off the diagonal", 1, 0, SMatrix::repeat(f64::NEG_INFINITY)),
    ];
    for (name, i, j, block) in cases {
        let mut bad = good.clone();
        bad.add(i, j, &block);
        let error = cholesky.factor(&bad).map(|_| ()).expect_err(name);
        assert!(error.variable < 6, "{name}: {error}");
        if i == j && block[(0, 0)] < 0.0 {
            assert_eq!(error.variable, i, "{name}");
        }
        check_against_dense(name, &mut cholesky, &good);
    }
}

#[test]
fn refuses_variables_that_nothing_determines() {
    // Differences alone leave a common offset free.
    let mut H = BlockMatrix::<SMatrix<f64, 1, 1>>::new(4);
    for j in 1..4 {
        H.add(j - 1, j - 1, &SMatrix::identity());
        H.add(j, j, &SMatrix::identity());
        H.add(j - 1, j, &-SMatrix::identity());
    }
    let error = BlockCholesky::new(&H).factor(&H).map(|_| ()).expect_err("singular");
    assert!(error.to_string().ends_with(&format!("at variable {}", error.variable)));
    H.add(2, 2, &SMatrix::identity());
    assert!(BlockCholesky::new(&H).factor(&H).is_ok());
    // One that no measurement names.
    let mut H = BlockMatrix::<SMatrix<f64, 3, 3>>::new(3);
    H.add(0, 0, &SMatrix::identity());
    H.add(2, 2, &SMatrix::identity());
    let error = BlockCholesky::new(&H).factor(&H).map(|_| ()).expect_err("zero block");
    assert_eq!(error, NotPositiveDefinite { variable: 1 });
}
