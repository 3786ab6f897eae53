//! An order of elimination that keeps the factor of a sparse matrix sparse: approximate minimum degree.
//!
//! Amestoy, Davis and Duff, "An approximate minimum degree ordering algorithm", SIAM J. Matrix Anal. Appl. 17 (1996).
//! The elimination of a variable connects all its neighbours to each other; in place of all these edges the graph keeps one
//! element, named after the eliminated variable. The paper's sets: a variable i has the remaining edges `A_i` of the matrix
//! and is a member of the elements `E_i`; an element e has the members `L_e`. Variables with the same neighbours are merged
//! into one that represents all of them, so sizes of sets are sums of weights.

/// No variable.
const NONE: u32 = u32::MAX;

/// Orders the variables `0..num_variables` of the graph with these edges (each given once, no loops) for elimination.
pub(super) fn minimum_degree(num_variables: usize, edges: &[(u32, u32)]) -> Vec<u32> {
    let mut num_edges = vec![0; num_variables];
    for &(i, j) in edges {
        num_edges[i as usize] += 1;
        num_edges[j as usize] += 1;
    }
    // Variables with very many neighbours are eliminated last: they cost much bookkeeping and fill the factor at any time.
    let dense = ((10.0 * (num_variables as f64).sqrt()) as usize).max(16);
    let is_sparse = |i: u32| num_edges[i as usize] <= dense;
    let (sparse, last): (Vec<u32>, Vec<u32>) = (0..num_variables as u32).partition(|&i| is_sparse(i));
    let sparse_edges = edges.iter().copied().filter(|&(i, j)| is_sparse(i) && is_sparse(j));
    let mut graph = QuotientGraph::new(num_variables, sparse.len(), sparse_edges);
    for &i in sparse.iter().rev() {
        graph.queue.insert(i, graph.degree[i as usize]);
    }
    let mut order = Vec::with_capacity(num_variables);
    while let Some(pivot) = graph.queue.pop() {
        graph.eliminate(pivot);
        order.extend(graph.merged_into(pivot));
    }
    order.extend(last);
    order
}

struct QuotientGraph {
    /// `A_i`.
    edges: Vec<Vec<u32>>,
    /// `E_i`.
    elements: Vec<Vec<u32>>,
    /// `L_e`; empty for an element that another one has absorbed.
    members: Vec<Vec<u32>>,
    /// Number of variables that a variable represents; 0 when it is eliminated or represented by another one.
    weight: Vec<u32>,
    /// Linked lists of the variables that one represents, each beginning at that one.
    next_merged: Vec<u32>,
    last_merged: Vec<u32>,
    /// For a variable an upper bound of the weight of its neighbours, `d_i`; for an element the weight of its members.
    degree: Vec<u32>,
    queue: DegreeQueue,
    /// Weight of the variables that are not eliminated yet.
    weight_left: u32,
    /// Number of the current elimination; marks with another number are void.
    step: u32,
    /// Marks the members of the new element.
    marked_in: Vec<u32>,
    /// `|L_e \ L_p|`: weight of the members of an element that are not members of the new element p.
    weight_outside: Vec<u32>,
    measured_in: Vec<u32>,
}

impl QuotientGraph {
    fn new(num_variables: usize, weight_left: usize, pairs: impl Iterator<Item = (u32, u32)>) -> Self {
        let mut edges = vec![Vec::new(); num_variables];
        for (i, j) in pairs {
            edges[i as usize].push(j);
            edges[j as usize].push(i);
        }
        Self {
            degree: edges.iter().map(|edges| edges.len() as u32).collect(),
            edges,
            elements: vec![Vec::new(); num_variables],
            members: vec![Vec::new(); num_variables],
            weight: vec![1; num_variables],
            next_merged: vec![NONE; num_variables],
            last_merged: (0..num_variables as u32).collect(),
            queue: DegreeQueue::new(num_variables),
            weight_left: weight_left as u32,
            step: 0,
            marked_in: vec![0; num_variables],
            weight_outside: vec![0; num_variables],
            measured_in: vec![0; num_variables],
        }
    }

    /// Replaces `pivot` by an element, together with the variables that can be eliminated right after it without more fill.
    fn eliminate(&mut self, pivot: u32) {
        self.step += 1;
        let mut members = self.form_element(pivot);
        self.measure_elements(&members);
        let mut hashes = Vec::with_capacity(members.len());
        for &i in &members {
            match self.detach_covered(i, pivot) {
                Some(hash) => hashes.push((hash, i)),
                None => self.merge(pivot, i),
            }
        }
        self.merge_indistinguishable(hashes);
        members.retain(|&i| self.weight[i as usize] > 0);
        let element_weight: u32 = members.iter().map(|&i| self.weight[i as usize]).sum();
        self.weight_left -= self.weight[pivot as usize];
        self.weight[pivot as usize] = 0;
        for &i in &members {
            let own = self.weight[i as usize];
            let degree = &mut self.degree[i as usize];
            *degree = (*degree + element_weight - own).min(self.weight_left - own);
            self.queue.insert(i, *degree);
        }
        self.degree[pivot as usize] = element_weight;
        self.members[pivot as usize] = members;
    }

    /// `L_p`: all neighbours of the pivot, by edges and through elements, which the new element absorbs.
    fn form_element(&mut self, pivot: u32) -> Vec<u32> {
        self.marked_in[pivot as usize] = self.step;
        let edges = std::mem::take(&mut self.edges[pivot as usize]);
        let absorbed = std::mem::take(&mut self.elements[pivot as usize]);
        let mut members = Vec::new();
        let through_elements = absorbed.iter().map(|&e| std::mem::take(&mut self.members[e as usize]));
        for i in std::iter::once(edges).chain(through_elements).flatten() {
            if self.weight[i as usize] > 0 && self.marked_in[i as usize] != self.step {
                self.marked_in[i as usize] = self.step;
                self.queue.remove(i, self.degree[i as usize]);
                members.push(i);
            }
        }
        members
    }

    /// `|L_e \ L_p|` of every element that shares a member with the new one (the paper's algorithm 2).
    fn measure_elements(&mut self, members: &[u32]) {
        for &i in members {
            for &e in &self.elements[i as usize] {
                let e = e as usize;
                if self.measured_in[e] != self.step {
                    self.measured_in[e] = self.step;
                    self.weight_outside[e] = self.degree[e];
                }
                self.weight_outside[e] -= self.weight[i as usize];
            }
        }
    }

    /// Removes from `A_i` and `E_i` what the new element covers, adds that element to `E_i`, and bounds `d_i` without it (the
    /// last two terms of the paper's eq. 4). Returns a hash of both sets, or `None` where only the new element is left.
    fn detach_covered(&mut self, i: u32, pivot: u32) -> Option<u64> {
        let i = i as usize;
        let (mut weight_outside, mut hash) = (0, 0u64);
        self.elements[i].retain(|&e| {
            let outside = self.weight_outside[e as usize];
            if outside == 0 {
                // Aggressive absorption: the new element holds all of its members.
                self.members[e as usize] = Vec::new();
            }
            let keep = !self.members[e as usize].is_empty();
            if keep {
                weight_outside += outside;
                hash += u64::from(e);
            }
            keep
        });
        self.edges[i].retain(|&j| {
            let keep = self.weight[j as usize] > 0 && self.marked_in[j as usize] != self.step;
            if keep {
                weight_outside += self.weight[j as usize];
                hash += u64::from(j);
            }
            keep
        });
        self.degree[i] = self.degree[i].min(weight_outside);
        self.elements[i].push(pivot);
        (weight_outside > 0).then_some(hash)
    }

    /// Merges members of the new element that have the same neighbours and elements.
    fn merge_indistinguishable(&mut self, mut hashes: Vec<(u64, u32)>) {
        hashes.sort_unstable();
        for same_hash in hashes.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
            for &(_, i) in same_hash {
                self.edges[i as usize].sort_unstable();
                self.elements[i as usize].sort_unstable();
            }
            for (place, &(_, i)) in same_hash.iter().enumerate() {
                if self.weight[i as usize] == 0 {
                    continue;
                }
                for &(_, j) in &same_hash[place + 1..] {
                    if self.weight[j as usize] > 0
                        && self.edges[i as usize] == self.edges[j as usize]
                        && self.elements[i as usize] == self.elements[j as usize]
                    {
                        self.merge(i, j);
                    }
                }
            }
        }
    }

    /// Makes `i` represent `j` as well.
    fn merge(&mut self, i: u32, j: u32) {
        let (i, j) = (i as usize, j as usize);
        self.weight[i] += self.weight[j];
        self.weight[j] = 0;
        self.edges[j] = Vec::new();
        self.elements[j] = Vec::new();
        self.next_merged[self.last_merged[i] as usize] = j as u32;
        self.last_merged[i] = self.last_merged[j];
    }

    fn merged_into(&self, i: u32) -> impl Iterator<Item = u32> {
        std::iter::successors(Some(i), |&i| Some(self.next_merged[i as usize]).filter(|&next| next != NONE))
    }
}

/// Variables by degree; of equal degrees the one inserted last comes first.
struct DegreeQueue {
    /// First variable of each degree.
    first: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// No variable has a smaller degree.
    smallest: usize,
}

impl DegreeQueue {
    fn new(num_variables: usize) -> Self {
        Self {
            first: vec![NONE; num_variables],
            next: vec![NONE; num_variables],
            previous: vec![NONE; num_variables],
            smallest: num_variables,
        }
    }

    fn insert(&mut self, i: u32, degree: u32) {
        let first = std::mem::replace(&mut self.first[degree as usize], i);
        if first != NONE {
            self.previous[first as usize] = i;
        }
        self.next[i as usize] = first;
        self.previous[i as usize] = NONE;
        self.smallest = self.smallest.min(degree as usize);
    }

    fn remove(&mut self, i: u32, degree: u32) {
        let (previous, next) = (self.previous[i as usize], self.next[i as usize]);
        if next != NONE {
            self.previous[next as usize] = previous;
        }
        if previous == NONE {
            self.first[degree as usize] = next;
        } else {
            self.next[previous as usize] = next;
        }
    }

    fn pop(&mut self) -> Option<u32> {
        while *self.first.get(self.smallest)? == NONE {
            self.smallest += 1;
        }
        let i = self.first[self.smallest];
        self.remove(i, self.smallest as u32);
        Some(i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of entries below the diagonal of the factor for this order, by eliminating set by set.
    fn num_entries(num_variables: usize, edges: &[(u32, u32)], order: &[u32]) -> usize {
        let mut neighbors = vec![std::collections::BTreeSet::new(); num_variables];
        for &(i, j) in edges {
            neighbors[i as usize].insert(j);
            neighbors[j as usize].insert(i);
        }
        let mut sum = 0;
        for &pivot in order {
            let clique = std::mem::take(&mut neighbors[pivot as usize]);
            sum += clique.len();
            for &i in &clique {
                neighbors[i as usize].extend(clique.iter().filter(|&&j| j != i));
                neighbors[i as usize].remove(&pivot);
            }
        }
        sum
    }

    fn check(name: &str, num_variables: usize, edges: &[(u32, u32)], max_entries: usize) {
        let order = minimum_degree(num_variables, edges);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..num_variables as u32), "{name}: not a permutation: {order:?}");
        let entries = num_entries(num_variables, edges, &order);
        assert!(entries <= max_entries, "{name}: {entries} entries");
    }

    fn chain(num_variables: u32) -> Vec<(u32, u32)> {
        (1..num_variables).map(|j| (j - 1, j)).collect()
    }

    #[test]
    fn trees_and_cliques_do_not_fill() {
        check("nothing", 0, &[], 0);
        check("single", 1, &[], 0);
        check("disconnected", 9, &[], 0);
        check("chain", 1000, &chain(1000), 999);
        check("star", 1000, &(1..1000).map(|j| (0, j)).collect::<Vec<_>>(), 999);
        check("small star", 12, &(0..11).map(|j| (11, j)).collect::<Vec<_>>(), 11);
        check("binary tree", 1000, &(1..1000).map(|j| ((j - 1) / 2, j)).collect::<Vec<_>>(), 999);
        let full = |first: u32, end: u32| (first..end).flat_map(move |j| (first..j).map(move |i| (i, j)));
        check("full", 40, &full(0, 40).collect::<Vec<_>>(), 40 * 39 / 2);
        check("full and large", 300, &full(0, 300).collect::<Vec<_>>(), 300 * 299 / 2);
        let two_cliques: Vec<_> = full(0, 15).chain(full(14, 30)).collect();
        check("cliques that share a variable", 30, &two_cliques, 15 * 14 / 2 + 16 * 15 / 2);
    }

    #[test]
    fn loops_fill_little() {
        let mut ring = chain(1000);
        ring.push((0, 999));
        check("ring", 1000, &ring, 2 * 1000 - 3);
        // A band eliminated from its end does not fill.
        let band = |width: u32| (0..1000).flat_map(move |j: u32| (j.saturating_sub(width)..j).map(move |i| (i, j)));
        check("band of 5", 1000, &band(5).collect::<Vec<_>>(), 6000);
        check("band of 10", 1000, &band(10).collect::<Vec<_>>(), 13_000);
        // Row by row this grid would have 900 * 30 entries; nested dissection would have about 7,500.
        let grid: Vec<_> = (0..900u32)
            .flat_map(|i| [(i % 30 < 29).then_some((i, i + 1)), (i < 870).then_some((i, i + 30))])
            .flatten()
            .collect();
        check("grid of 30 by 30", 900, &grid, 10_000);
    }

    /// A long drive with loops: what is quadratic in the number of poses takes a minute here.
    #[test]
    fn ten_thousand_poses_with_three_thousand_loops_are_no_trap() {
        let start = std::time::Instant::now();
        let mut edges = chain(10_000);
        edges.extend((0..3000u32).map(|k| (k * 7919 % 4999, 5000 + k * 104_729 % 4999)));
        assert_eq!(minimum_degree(10_000, &edges).len(), 10_000);
        // A hub that is tied to everything, on top.
        edges.extend((0..9_999).map(|i| (i, 10_000)));
        assert_eq!(minimum_degree(10_001, &edges).last(), Some(&10_000));
        assert!(start.elapsed() < std::time::Duration::from_secs(10), "took {:?}", start.elapsed());
    }
}
