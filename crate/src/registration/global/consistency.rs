//! Consensus by consistency: matches that keep their mutual distances support each other, and those with the most common
//! support make the motion. Nothing is random.
//!
//! Chen et al., "SC2-PCR: a second order spatial compatibility for efficient and robust point cloud registration", CVPR
//! 2022: two matches of which both are wrong may agree in one distance, but hardly share many others that agree with both.

use nalgebra::Vector3;

use super::Consensus;
use crate::geometry::Pose3;
use crate::registration::factors::best_rigid_motion;

/// Most matches that are used, evenly spread; they form 1.1 million pairs.
const MAX_MATCHES: usize = 1500;
/// Most matches that are tried as the seed of a consensus.
const MAX_SEEDS: usize = 40;
/// Most supporters of a seed to which its first motion is fitted.
const SUPPORTERS: usize = 24;
/// Number of fits of a motion to its inliers.
const REFINEMENTS: usize = 4;

/// The motion that the most pairs (source, target) agree with to within `max_distance` (m), found from the pairs whose mutual
/// distances agree as well; `None` where no three do.
pub fn consistent_motion(pairs: &[(Vector3<f64>, Vector3<f64>)], max_distance: f64) -> Option<Consensus> {
    let stride = pairs.len().div_ceil(MAX_MATCHES).max(1);
    let looked_at: Vec<_> = pairs.iter().copied().step_by(stride).collect();
    let graph = Graph::new(&looked_at, max_distance);
    let mut best: Option<Consensus> = None;
    let mut tried = vec![false; looked_at.len()];
    let mut num_seeds = 0;
    for seed in graph.by_support() {
        if tried[seed] {
            continue;
        }
        num_seeds += 1;
        if num_seeds > MAX_SEEDS {
            break;
        }
        let chosen = graph.supporters(seed);
        for &member in &chosen {
            tried[member] = true;
        }
        let Some(consensus) = refined(&chosen, &looked_at, pairs, max_distance) else { continue };
        if best.as_ref().is_none_or(|best| consensus.is_better_than(best)) {
            best = Some(consensus);
        }
    }
    best
}

/// The motion of some of the pairs, refined by fits to the pairs that agree with it.
fn refined(
    chosen: &[usize],
    looked_at: &[(Vector3<f64>, Vector3<f64>)],
    pairs: &[(Vector3<f64>, Vector3<f64>)],
    max_distance: f64,
) -> Option<Consensus> {
    if chosen.len() < 3 {
        return None;
    }
    let members = chosen.iter().map(|&member| (looked_at[member].0, looked_at[member].1, 1.0));
    let T: Pose3 = best_rigid_motion(members)?;
    let mut consensus = Consensus::of(&T, pairs, max_distance);
    for _ in 0..REFINEMENTS {
        let T = consensus.T_target_source;
        let inliers = pairs.iter().filter(|(p, q)| (T * nalgebra::Point3::from(*p) - q).coords.norm() <= max_distance);
        let Some(T) = best_rigid_motion(inliers.map(|(p, q)| (*p, *q, 1.0))) else { break };
        let next = Consensus::of(&T, pairs, max_distance);
        if !next.is_better_than(&consensus) {
            break;
        }
        consensus = next;
    }
    Some(consensus)
}

/// The compatibility graph of the matches, as rows of bits: two matches are connected if their mutual distances agree.
struct Graph {
    words: usize,
    rows: Vec<u64>,
    num_matches: usize,
}

impl Graph {
    fn new(pairs: &[(Vector3<f64>, Vector3<f64>)], max_distance: f64) -> Self {
        let num_matches = pairs.len();
        let words = num_matches.div_ceil(64);
        let mut graph = Self { words, rows: vec![0; num_matches * words], num_matches };
        for (i, (p, q)) in pairs.iter().enumerate() {
            for (j, (other_p, other_q)) in pairs.iter().enumerate().skip(i + 1) {
                let (source, target) = ((p - other_p).norm(), (q - other_q).norm());
                // Points that are close in both clouds agree under every motion.
                let agrees = (source - target).abs() < max_distance && source.min(target) > 2.0 * max_distance;
                if agrees {
                    graph.rows[i * words + j / 64] |= 1 << (j % 64);
                    graph.rows[j * words + i / 64] |= 1 << (i % 64);
                }
            }
        }
        graph
    }

    fn row(&self, index: usize) -> &[u64] {
        &self.rows[index * self.words..(index + 1) * self.words]
    }

    fn neighbors(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        self.row(index).iter().enumerate().flat_map(|(word, &bits)| {
            std::iter::successors(Some(bits), |bits| Some(bits & bits.wrapping_sub(1)))
                .take_while(|bits| *bits != 0)
                .map(move |bits| 64 * word + bits.trailing_zeros() as usize)
        })
    }

    /// Number of other matches that are compatible with both of two matches.
    fn common(&self, i: usize, j: usize) -> u32 {
        self.row(i).iter().zip(self.row(j)).map(|(a, b)| (a & b).count_ones()).sum()
    }

    /// The matches, sorted by the support that they share with their neighbours in the graph, the largest first.
    fn by_support(&self) -> Vec<usize> {
        let support = |i: usize| -> u64 { self.neighbors(i).map(|j| u64::from(self.common(i, j))).sum() };
        let support: Vec<u64> = (0..self.num_matches).map(support).collect();
        let mut order: Vec<usize> = (0..self.num_matches).collect();
        order.sort_by_key(|&index| (std::cmp::Reverse(support[index]), index));
        order
    }

    /// A clique grown greedily from a match, by those that share the most support with it.
    fn supporters(&self, seed: usize) -> Vec<usize> {
        let mut candidates: Vec<(u32, usize)> = self.neighbors(seed).map(|j| (self.common(seed, j), j)).collect();
        candidates.sort_by_key(|&(common, index)| (std::cmp::Reverse(common), index));
        let mut chosen = vec![seed];
        let mut open = self.row(seed).to_vec();
        for (_, candidate) in candidates {
            if open[candidate / 64] >> (candidate % 64) & 1 == 1 {
                chosen.push(candidate);
                for (open, row) in open.iter_mut().zip(self.row(candidate)) {
                    *open &= row;
                }
                if chosen.len() == SUPPORTERS {
                    break;
                }
            }
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigidMotion;
    use crate::geometry::scalar::wave;
    use nalgebra::Vector6;

    fn somewhere(i: usize) -> Vector3<f64> {
        Vector3::new(5.0 * wave(i, 12.9898), 4.0 * wave(i, 78.233), 2.0 * wave(i, 37.719))
    }

    #[test]
    fn the_motion_is_found_among_nineteen_wrong_matches_of_twenty() {
        let T = Pose3::exp(&Vector6::new(0.4, -2.0, 0.9, 3.0, -1.0, 0.5));
        let pairs: Vec<_> = (0..800)
            .map(|i| {
                let p = somewhere(i);
                let q = if i % 20 == 7 { T.act(&p) + somewhere(3 * i + 1) * 0.002 } else { somewhere(5000 + 7 * i) };
                (p, q)
            })
            .collect();
        let found = consistent_motion(&pairs, 0.05).unwrap();
        let error = T.inverse() * found.T_target_source;
        assert!(
            found.num_inliers >= 38 && error.translation_norm() < 0.01 && error.rotation_angle() < 0.005,
            "{error}"
        );
    }

    #[test]
    fn too_few_pairs_make_no_motion() {
        assert!(consistent_motion(&[], 0.1).is_none());
        let pair = (Vector3::x(), Vector3::y());
        assert!(consistent_motion(&[pair, pair, pair, pair], 0.1).is_none());
    }

    #[test]
    fn neighbours_are_the_set_bits() {
        let pairs: Vec<_> = (0..130).map(|i| (somewhere(i), somewhere(i))).collect();
        let graph = Graph::new(&pairs, 0.01);
        for i in [0, 63, 64, 129] {
            let far = (0..130).filter(|&j| (pairs[i].0 - pairs[j].0).norm() > 0.02).collect::<Vec<_>>();
            assert_eq!(graph.neighbors(i).collect::<Vec<_>>(), far);
        }
    }
}
