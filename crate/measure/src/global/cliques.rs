//! Cliques of matches that keep their mutual distances: the largest one, and many maximal ones.

use nalgebra::{Point3, Vector3};
use scanstitch::geometry::Pose3;
use scanstitch::registration::factors::best_rigid_motion;

type Pair = (Vector3<f64>, Vector3<f64>);

/// Matches looked at; of more, every so many are.
const MAX_MATCHES: usize = 1500;
/// Steps of the search for the largest clique.
const MAX_STEPS: usize = 20_000;
/// Steps of the search for maximal cliques, shared by all matches.
const MAX_CLIQUE_STEPS: usize = 30_000;
/// Motions that are tried.
const MAX_MOTIONS: usize = 400;

/// Which matches agree with which, as rows of bits.
struct Graph {
    words: usize,
    rows: Vec<u64>,
    len: usize,
}

impl Graph {
    fn new(pairs: &[Pair], max_distance: f64) -> Self {
        let (len, words) = (pairs.len(), pairs.len().div_ceil(64));
        let mut rows = vec![0u64; len * words];
        for i in 0..len {
            for j in i + 1..len {
                let (source, target) = ((pairs[i].0 - pairs[j].0).norm(), (pairs[i].1 - pairs[j].1).norm());
                if (source - target).abs() < max_distance && source.min(target) > 2.0 * max_distance {
                    rows[i * words + j / 64] |= 1 << (j % 64);
                    rows[j * words + i / 64] |= 1 << (i % 64);
                }
            }
        }
        Self { words, rows, len }
    }

    fn row(&self, index: usize) -> &[u64] {
        &self.rows[index * self.words..(index + 1) * self.words]
    }

    fn degree(&self, index: usize) -> u32 {
        count(self.row(index))
    }

    fn common(&self, i: usize, j: usize) -> u32 {
        self.row(i).iter().zip(self.row(j)).map(|(a, b)| (a & b).count_ones()).sum()
    }
}

fn count(bits: &[u64]) -> u32 {
    bits.iter().map(|word| word.count_ones()).sum()
}

fn members(bits: &[u64]) -> Vec<usize> {
    let of_word =
        |(word, &bits): (usize, &u64)| (0..64).filter(move |bit| bits >> bit & 1 == 1).map(move |bit| 64 * word + bit);
    bits.iter().enumerate().flat_map(of_word).collect()
}

fn and(a: &[u64], b: &[u64]) -> Vec<u64> {
    a.iter().zip(b).map(|(a, b)| a & b).collect()
}

fn every_so_many(pairs: &[Pair]) -> Vec<Pair> {
    pairs.iter().copied().step_by(pairs.len().div_ceil(MAX_MATCHES).max(1)).collect()
}

/// The pairs of the largest clique that a bounded search finds: branch and bound by a greedy colouring (Tomita and
/// Seki, "An efficient branch-and-bound algorithm for finding a maximum clique", DMTCS 2003), as TEASER prunes its
/// matches (Yang, Shi and Carlone, "TEASER: fast and certifiable point cloud registration", T-RO 2021).
pub fn largest_clique(pairs: &[Pair], max_distance: f64) -> Vec<Pair> {
    let pairs = every_so_many(pairs);
    let graph = Graph::new(&pairs, max_distance);
    let mut search = Largest { graph: &graph, best: Vec::new(), steps: 0 };
    let mut order: Vec<usize> = (0..graph.len).collect();
    order.sort_by_key(|&index| (std::cmp::Reverse(graph.degree(index)), index));
    // A large one to begin with, greedily from the best connected.
    for &first in order.iter().take(20) {
        let mut clique = vec![first];
        let mut open = graph.row(first).to_vec();
        while let Some(next) = members(&open).into_iter().max_by_key(|&next| count(&and(&open, graph.row(next)))) {
            clique.push(next);
            open = and(&open, graph.row(next));
        }
        if clique.len() > search.best.len() {
            search.best = clique;
        }
    }
    let all = graph.rows.chunks(graph.words.max(1)).take(1).map(|_| full(graph.len)).next().unwrap_or_default();
    search.expand(&mut Vec::new(), all);
    search.best.iter().map(|&index| pairs[index]).collect()
}

fn full(len: usize) -> Vec<u64> {
    let mut bits = vec![0u64; len.div_ceil(64)];
    for index in 0..len {
        bits[index / 64] |= 1 << (index % 64);
    }
    bits
}

struct Largest<'a> {
    graph: &'a Graph,
    best: Vec<usize>,
    steps: usize,
}

impl Largest<'_> {
    fn expand(&mut self, clique: &mut Vec<usize>, candidates: Vec<u64>) {
        self.steps += 1;
        if self.steps > MAX_STEPS {
            return;
        }
        // Colour classes are independent sets: a clique takes one of each at the most.
        let mut colored: Vec<(usize, usize)> = Vec::new();
        let mut left = candidates.clone();
        let mut color = 0;
        while left.iter().any(|word| *word != 0) {
            color += 1;
            let mut class = left.clone();
            while let Some(word) = class.iter().position(|word| *word != 0) {
                let vertex = 64 * word + class[word].trailing_zeros() as usize;
                class[vertex / 64] &= !(1 << (vertex % 64));
                left[vertex / 64] &= !(1 << (vertex % 64));
                for (class, row) in class.iter_mut().zip(self.graph.row(vertex)) {
                    *class &= !row;
                }
                colored.push((vertex, color));
            }
        }
        let mut candidates = candidates;
        for &(vertex, color) in colored.iter().rev() {
            if clique.len() + color <= self.best.len() || self.steps > MAX_STEPS {
                return;
            }
            clique.push(vertex);
            let next = and(&candidates, self.graph.row(vertex));
            if next.iter().all(|word| *word == 0) {
                if clique.len() > self.best.len() {
                    self.best.clone_from(clique);
                }
            } else {
                self.expand(clique, next);
            }
            clique.pop();
            candidates[vertex / 64] &= !(1 << (vertex % 64));
        }
    }
}

/// Motions of maximal cliques, the one that most pairs agree with: Zhang et al., "3D registration with maximal
/// cliques", CVPR 2023. Of every match, the clique with the most second-order support is tried.
pub fn maximal_clique_motion(pairs: &[Pair], max_distance: f64) -> Option<(Pose3, usize)> {
    let looked_at = every_so_many(pairs);
    let graph = Graph::new(&looked_at, max_distance);
    let mut search = Maximal { graph: &graph, found: Vec::new(), steps: 0 };
    let mut order: Vec<usize> = (0..graph.len).collect();
    order.sort_by_key(|&index| (std::cmp::Reverse(graph.degree(index)), index));
    // Every match has its share of the work: a large component must not use it up.
    let (mut done, budget) = (vec![0u64; graph.words], (MAX_CLIQUE_STEPS / graph.len.max(1)).max(20));
    for &vertex in &order {
        let open: Vec<u64> = graph.row(vertex).iter().zip(&done).map(|(row, done)| row & !done).collect();
        let excluded = and(graph.row(vertex), &done);
        search.steps = budget;
        search.expand(&mut vec![vertex], open, excluded);
        done[vertex / 64] |= 1 << (vertex % 64);
    }
    let weight = |clique: &Vec<usize>| -> u64 {
        let pairs = clique.iter().enumerate().flat_map(|(at, &i)| clique[at + 1..].iter().map(move |&j| (i, j)));
        pairs.map(|(i, j)| u64::from(graph.common(i, j))).sum()
    };
    let mut best_of: Vec<Option<(u64, usize)>> = vec![None; graph.len];
    for (number, clique) in search.found.iter().enumerate() {
        let weight = weight(clique);
        for &member in clique {
            if best_of[member].is_none_or(|(best, _)| weight > best) {
                best_of[member] = Some((weight, number));
            }
        }
    }
    let mut kept: Vec<(u64, usize)> = best_of.into_iter().flatten().collect();
    kept.sort_unstable_by(|a, b| b.cmp(a));
    kept.dedup();
    kept.truncate(MAX_MOTIONS);
    let motions = kept.iter().filter_map(|&(_, number)| {
        let clique = search.found[number].iter().map(|&member| (looked_at[member].0, looked_at[member].1, 1.0));
        let T: Pose3 = best_rigid_motion(clique)?;
        Some((T, num_inliers(&T, pairs, max_distance)))
    });
    let mut best = motions.max_by_key(|(_, inliers)| *inliers)?;
    for _ in 0..4 {
        let inliers = pairs.iter().filter(|(p, q)| (best.0 * Point3::from(*p) - q).coords.norm() <= max_distance);
        let Some(T) = best_rigid_motion(inliers.map(|(p, q)| (*p, *q, 1.0))) else { break };
        let inliers = num_inliers(&T, pairs, max_distance);
        if inliers <= best.1 {
            break;
        }
        best = (T, inliers);
    }
    Some(best)
}

pub fn num_inliers(T: &Pose3, pairs: &[Pair], max_distance: f64) -> usize {
    pairs.iter().filter(|(p, q)| (T * Point3::from(*p) - q).coords.norm() <= max_distance).count()
}

struct Maximal<'a> {
    graph: &'a Graph,
    found: Vec<Vec<usize>>,
    /// That are left.
    steps: usize,
}

impl Maximal<'_> {
    /// Bron and Kerbosch, "Finding all cliques of an undirected graph", CACM 16 (1973), with a pivot, as far as
    /// the steps go.
    fn expand(&mut self, clique: &mut Vec<usize>, mut open: Vec<u64>, mut excluded: Vec<u64>) {
        if self.steps == 0 {
            return;
        }
        self.steps -= 1;
        if open.iter().all(|word| *word == 0) {
            if clique.len() >= 3 && excluded.iter().all(|word| *word == 0) {
                self.found.push(clique.clone());
            }
            return;
        }
        let pivot = members(&open).into_iter().max_by_key(|&pivot| count(&and(&open, self.graph.row(pivot))));
        let Some(pivot) = pivot else { return };
        let branches: Vec<u64> = open.iter().zip(self.graph.row(pivot)).map(|(open, row)| open & !row).collect();
        for vertex in members(&branches) {
            clique.push(vertex);
            let row = self.graph.row(vertex);
            self.expand(clique, and(&open, row), and(&excluded, row));
            clique.pop();
            open[vertex / 64] &= !(1 << (vertex % 64));
            excluded[vertex / 64] |= 1 << (vertex % 64);
            if self.steps == 0 {
                return;
            }
        }
    }
}
