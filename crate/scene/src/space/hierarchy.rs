//! A bounding-volume hierarchy of the solids, so that a ray is tested against few of them.

use nalgebra::Vector3;

use super::Hit;
use super::solid::Solid;

/// As many solids may share a leaf.
const LEAF: usize = 1;
/// Rays that start on a surface leave it first (lengths of the ray).
const START: f64 = 1e-9;
/// Levels of the tree: it is halved somewhere at each, and never has as many solids.
const MAX_DEPTH: usize = 64;

#[derive(Debug, Clone)]
struct Node {
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// The first of its solids in `order`, or the node of its second half; the first half follows the node itself.
    next: u32,
    /// Solids of a leaf; 0 where there are halves.
    count: u32,
}

/// A tree of boxes, halved where the surface area heuristic says (Goldsmith and Salmon, "Automatic creation of object
/// hierarchies for ray tracing", IEEE CG&A 7 (1987)).
#[derive(Debug, Clone, Default)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// Box around a solid.
#[derive(Clone, Copy)]
struct Bounds {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Bounds {
    fn joined(self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    fn area(&self) -> f64 {
        let d = self.high - self.low;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

impl Hierarchy {
    pub fn new(solids: &[Solid]) -> Self {
        let bounds: Vec<Bounds> = solids
            .iter()
            .map(|solid| {
                let (low, high) = solid.bounds();
                // Rounding must not let a ray slip past a face that is its own box.
                Bounds { low: low.add_scalar(-1e-9), high: high.add_scalar(1e-9) }
            })
            .collect();
        let mut tree = Self { nodes: Vec::new(), order: (0..solids.len() as u32).collect() };
        if !solids.is_empty() {
            let mut order = std::mem::take(&mut tree.order);
            tree.add(&bounds, &mut order, 0, 0);
            tree.order = order;
        }
        tree
    }

    fn add(&mut self, bounds: &[Bounds], order: &mut [u32], first: usize, depth: usize) {
        let of = |index: u32| bounds[index as usize];
        let all = order.iter().fold(of(order[0]), |all, &index| all.joined(&of(index)));
        let node = self.nodes.len();
        self.nodes.push(Node { low: all.low, high: all.high, next: first as u32, count: order.len() as u32 });
        if order.len() <= LEAF || depth + 1 >= MAX_DEPTH {
            return;
        }
        let middle = halve(bounds, order);
        let (near, far) = order.split_at_mut(middle);
        self.add(bounds, near, first, depth + 1);
        self.nodes[node].next = self.nodes.len() as u32;
        self.nodes[node].count = 0;
        self.add(bounds, far, first + middle, depth + 1);
    }

    /// The first solid that a ray meets; of two at the same distance the one given first. A solid that is `likely` to be met is tried
    /// before the others: what lies behind it need not be.
    pub fn cast(
        &self,
        solids: &[Solid],
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        likely: Option<usize>,
    ) -> Option<Hit> {
        let distance_to = |solid: usize| solids[solid].enter(origin, direction).filter(|distance| *distance > START);
        let mut best = likely.and_then(|solid| Some(Hit { solid, distance: distance_to(solid)? }));
        let reach = best.map_or(f64::INFINITY, |hit| hit.distance);
        self.visit(origin, direction, reach, |index, reach| {
            let solid = index as usize;
            match distance_to(solid) {
                Some(distance) => {
                    let nearer = best
                        .is_none_or(|hit| distance < hit.distance || (distance == hit.distance && solid < hit.solid));
                    if nearer {
                        best = Some(Hit { solid, distance });
                    }
                    Some(reach.min(distance))
                }
                None => Some(reach),
            }
        });
        best
    }

    /// A solid that `counts` and lies on the way to `origin + direction`, not always the first.
    pub fn meets(
        &self,
        solids: &[Solid],
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        counts: impl Fn(&Solid) -> bool,
    ) -> Option<usize> {
        let mut met = None;
        self.visit(origin, direction, 1.0, |index, reach| {
            let solid = &solids[index as usize];
            if lies_between(solid, origin, direction) && counts(solid) {
                met = Some(index as usize);
                return None;
            }
            Some(reach)
        });
        met
    }

    /// Calls `meet` with the solids whose boxes the ray passes, nearer boxes first, and how far the ray still matters; it
    /// gives how far from then on, or `None` to end.
    fn visit(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        mut reach: f64,
        mut meet: impl FnMut(u32, f64) -> Option<f64>,
    ) {
        let inverse = direction.map(|d| 1.0 / d);
        let enter = |node: &Node| -> f64 {
            let (mut near, mut far) = (0.0f64, f64::INFINITY);
            for axis in 0..3 {
                let a = (node.low[axis] - origin[axis]) * inverse[axis];
                let b = (node.high[axis] - origin[axis]) * inverse[axis];
                let (low, high) = if a < b { (a, b) } else { (b, a) };
                near = if low > near { low } else { near };
                far = if high < far { high } else { far };
            }
            if near <= far { near } else { f64::INFINITY }
        };
        let mut stack = [(0u32, 0.0f64); MAX_DEPTH + 1];
        let mut height = 0;
        let Some(root) = self.nodes.first() else { return };
        let mut current = (0u32, enter(root));
        loop {
            let (index, near) = current;
            if near <= reach && near < f64::INFINITY {
                let node = &self.nodes[index as usize];
                if node.count == 0 {
                    let (a, b) = (index + 1, node.next);
                    let (a, b) = ((a, enter(&self.nodes[a as usize])), (b, enter(&self.nodes[b as usize])));
                    let (nearer, farther) = if b.1 < a.1 { (b, a) } else { (a, b) };
                    if farther.1 <= reach && farther.1 < f64::INFINITY {
                        stack[height] = farther;
                        height += 1;
                    }
                    current = nearer;
                    continue;
                }
                let first = node.next as usize;
                for &solid in &self.order[first..first + node.count as usize] {
                    match meet(solid, reach) {
                        Some(left) => reach = left,
                        None => return,
                    }
                }
            }
            if height == 0 {
                return;
            }
            height -= 1;
            current = stack[height];
        }
    }
}

/// Whether a solid lies on the way to `origin + direction`.
pub fn lies_between(solid: &Solid, origin: &Vector3<f64>, direction: &Vector3<f64>) -> bool {
    solid.enter(origin, direction).is_some_and(|distance| distance > START && distance < 1.0)
}

/// Sorts along the best axis and gives where to cut: the sum over both halves of area times solids is the least.
fn halve(bounds: &[Bounds], order: &mut [u32]) -> usize {
    let of = |index: u32| bounds[index as usize];
    let sort = |order: &mut [u32], axis: usize| {
        let middle = |index: u32| of(index).low[axis] + of(index).high[axis];
        order.sort_by(|&a, &b| middle(a).total_cmp(&middle(b)).then(a.cmp(&b)));
    };
    let mut best = (f64::INFINITY, 0, order.len() / 2);
    let mut behind = vec![0.0; order.len()];
    for axis in 0..3 {
        sort(order, axis);
        let mut all = of(order[order.len() - 1]);
        for cut in (1..order.len()).rev() {
            all = all.joined(&of(order[cut]));
            behind[cut] = all.area() * (order.len() - cut) as f64;
        }
        let mut all = of(order[0]);
        for cut in 1..order.len() {
            all = all.joined(&of(order[cut - 1]));
            let cost = all.area() * cut as f64 + behind[cut];
            if cost < best.0 {
                best = (cost, axis, cut);
            }
        }
    }
    sort(order, best.1);
    best.2
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::super::super::random::Random;
    use super::super::solid::Shape;
    use super::*;

    fn solids(count: usize, random: &mut Random) -> Vec<Solid> {
        let mut vector = |reach: f64| Vector3::from_fn(|_, _| random.uniform(-reach, reach));
        let solid = |_| {
            let half = vector(0.3).abs().add_scalar(0.02);
            let shape = Shape::Cuboid { half };
            Solid { shape, R_world_solid: Matrix3::identity(), center: vector(4.0), material: 0 }
        };
        (0..count).map(solid).collect()
    }

    #[test]
    fn the_tree_finds_what_trying_every_solid_finds() {
        let mut random = Random::new(2);
        for count in [0, 1, 4, 300] {
            let solids = solids(count, &mut random);
            let tree = Hierarchy::new(&solids);
            for attempt in 0..500 {
                let mut vector = |reach: f64| Vector3::from_fn(|_, _| random.uniform(-reach, reach));
                let (origin, mut direction) = (vector(5.0), vector(2.0));
                direction.x *= f64::from(u8::from(direction.y > 0.0)); // some along a plane of the axes
                let hits = solids
                    .iter()
                    .enumerate()
                    .filter_map(|(solid, s)| s.enter(&origin, &direction).map(|distance| Hit { solid, distance }));
                let expected = hits.min_by(|a, b| a.distance.total_cmp(&b.distance));
                let likely = (count > 0).then_some(attempt % count.max(1));
                assert_eq!(tree.cast(&solids, &origin, &direction, likely), expected);
                assert_eq!(tree.cast(&solids, &origin, &direction, None), expected);
                let met = expected.is_some_and(|hit| hit.distance < 1.0);
                assert_eq!(tree.meets(&solids, &origin, &direction, |_| true).is_some(), met);
                assert_eq!(tree.meets(&solids, &origin, &direction, |_| false), None);
            }
        }
    }
}
