//! The connected parts of a graph, by disjoint sets (Galler and Fischer, "An improved equivalence algorithm", CACM 7, 1964).

/// For each of `count` nodes the first node of the part that the edges join it with.
pub(crate) fn connected_parts(count: usize, edges: impl IntoIterator<Item = [usize; 2]>) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..count).collect();
    for edge in edges {
        let [a, b] = edge.map(|node| first_of(&mut parent, node));
        parent[a.max(b)] = a.min(b);
    }
    (0..count).map(|node| first_of(&mut parent, node)).collect()
}

/// The first node of the part; the way there is halved for later calls.
fn first_of(parent: &mut [usize], mut node: usize) -> usize {
    while parent[node] != node {
        parent[node] = parent[parent[node]];
        node = parent[node];
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_named_after_its_first_node() {
        assert_eq!(connected_parts(7, [[5, 3], [6, 5], [1, 2]]), [0, 1, 1, 3, 4, 3, 3]);
        let backwards = (0..10_000).rev().map(|node| [node, node + 1]);
        assert!(connected_parts(10_001, backwards).iter().all(|&part| part == 0));
    }
}
