//! Puts clusters in the order of the leaves of bounding volume hierarchies, which `obvhs` builds.
//!
//! Eight consecutive clusters are taken to a set, eight sets to a larger one, and so on. So sets are good if clusters
//! that follow each other are near each other and face the same way. A hierarchy of boxes cares for the first: depth
//! first, consecutive leaves mostly have a small ancestor in common. Where they have not, it helps that of two children
//! the one nearer to the leaf before comes first.
//!
//! Of directions a box knows nothing; backs even share their boxes with fronts. So there are six hierarchies, one for
//! each direction along a coordinate axis, of clusters that face that way more than any other. Those that cannot turn
//! away have one of their own, at the end: with them, no set can be dropped for facing away. Unbounded ones, which have
//! no box, come last, in no hierarchy.
//!
//! Any order gives the same results, and is kept while clusters move.

use super::bound::Bound;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// How many kinds of clusters have hierarchies of their own: one for each direction along a coordinate axis, and those
/// that cannot turn away.
const KINDS: usize = 7;

/// By how much of its radius a box is moved at most, ...
const JITTER: f32 = 1.0 / 4096.0;

/// ... or by how much of the largest coordinate of its centre, if that is more: several steps of `f32`, ...
const RELATIVE_JITTER: f32 = 1.0 / (1 << 21) as f32;

/// ... or this, whose square is well above the smallest `f32`.
const SMALLEST_JITTER: f32 = 1e-16;

/// The indices of `bounds` in their new order.
pub(super) fn order(bounds: &[Bound]) -> Vec<u32> {
    let mut kinds: [Vec<u32>; KINDS] = Default::default();
    let mut unbounded = Vec::new();
    for (index, bound) in (0..).zip(bounds) {
        if bound.is_bounded() {
            kinds[kind(bound)].push(index);
        } else {
            unbounded.push(index);
        }
    }
    let mut order = Vec::with_capacity(bounds.len());
    let mut builder = PlocBuilder::new();
    for indices in kinds.into_iter().filter(|indices| !indices.is_empty()) {
        push_leaves(&hierarchy(&mut builder, bounds, indices), &mut order);
    }
    order.append(&mut unbounded);
    order
}

/// The number of the direction that a cluster faces most, or the one after them if it cannot turn away.
fn kind(bound: &Bound) -> usize {
    if !bound.can_turn_away {
        return KINDS - 1;
    }
    let axis = Vec3A::from(bound.axis);
    let largest = axis.abs().max_position();
    2 * largest + usize::from(axis[largest] < 0.0)
}

/// The hierarchy of those bounds that have the given indices, all bounded; a leaf holds one, by its index.
fn hierarchy(builder: &mut PlocBuilder, bounds: &[Bound], indices: Vec<u32>) -> Bvh2 {
    let boxes: Vec<Aabb> = indices
        .iter()
        .map(|&index| jittered_box(&bounds[index as usize], index))
        .collect();
    let (distance, precision) = (PlocSearchDistance::Medium, SortPrecision::U64);
    builder.build(distance, &boxes, indices, precision, 0)
}

/// The box about a ball, moved by a little that depends on the index.
///
/// In one pass the builder joins all pairs of boxes of which each is the other's best partner. In a row of equal boxes,
/// and of boxes at one place, the best partner of each is a later one: there is one pair, and as many passes as boxes.
fn jittered_box(bound: &Bound, index: u32) -> Aabb {
    let (center, radius) = (Vec3A::from(bound.center), bound.radius);
    let most = (radius * JITTER)
        .max(center.abs().max_element() * RELATIVE_JITTER)
        .max(SMALLEST_JITTER);
    let center = center + unit_noise(index) * most;
    Aabb::new(center - radius, center + radius)
}

/// Three numbers between 0 and 1, unlike those of other indices.
fn unit_noise(index: u32) -> Vec3A {
    let bits = index.wrapping_mul(0x9e37_79b1);
    let bits = (bits ^ (bits >> 15)).wrapping_mul(0x85eb_ca77);
    let bits = bits ^ (bits >> 13);
    Vec3A::from([0, 10, 20].map(|shift| (bits >> shift & 0x3ff) as f32 / 1024.0))
}

/// Appends the leaves of a hierarchy that is not empty, depth first.
fn push_leaves(hierarchy: &Bvh2, order: &mut Vec<u32>) {
    let center = |node: usize| hierarchy.nodes[node].aabb().center();
    let mut last = hierarchy.nodes[0].aabb().min;
    let mut stack = vec![0];
    while let Some(index) = stack.pop() {
        let node = &hierarchy.nodes[index];
        let first = node.first_index as usize;
        if node.is_leaf() {
            last = center(index);
            order.push(node.first_index);
        } else {
            let [a, b] = [first, first + 1].map(|child| center(child).distance_squared(last));
            let near = usize::from(b < a);
            stack.extend([first + 1 - near, first + near]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Cluster;

    fn bound(center: [f32; 3], radius: f32, cone_axis: [f32; 3], cone_cos: f32) -> Bound {
        Bound::of_cluster(&Cluster {
            triangles: 0..1,
            center,
            radius,
            cone_axis,
            cone_cos,
            min_altitude: 0.1,
        })
    }

    #[test]
    fn an_order_has_every_cluster_once_and_kinds_apart() {
        for count in [0, 1, 8, 9, 100] {
            let bounds: Vec<Bound> = (0..count)
                .map(|i| {
                    let center = match i % 10 {
                        8 => [0.0, 1e16, 0.0],
                        9 => [f32::NAN, 0.0, 0.0],
                        _ => [(i * 7 % 11) as f32, (i % 3) as f32, 0.0],
                    };
                    let axis = [0.0, 0.0, if i % 2 == 0 { 1.0 } else { -1.0 }];
                    bound(center, 1.0, axis, if i % 3 == 0 { -1.0 } else { 0.9 })
                })
                .collect();
            let order = order(&bounds);
            // Fronts, backs, what cannot turn away, what is unbounded.
            assert!(order.is_sorted_by_key(|&index| {
                let bound = &bounds[index as usize];
                let is_back = bound.can_turn_away && bound.axis[2] < 0.0;
                (!bound.is_bounded(), !bound.can_turn_away, is_back)
            }));
            let mut sorted = order;
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..count as u32));
        }
    }

    #[test]
    fn consecutive_clusters_are_near() {
        let bounds: Vec<Bound> = (0..64)
            .map(|i| bound([(i * 13 % 64) as f32, 0.0, 0.0], 0.5, [0.0, 0.0, 1.0], 0.9))
            .collect();
        let x = |index: u32| bounds[index as usize].center[0];
        let order = order(&bounds);
        let way: f32 = (order.windows(2))
            .map(|pair| (x(pair[0]) - x(pair[1])).abs())
            .sum();
        assert!(way < 1.5 * 63.0, "{way}");
    }

    #[test]
    fn equal_boxes_are_joined_in_few_passes() {
        type Place = fn(u32) -> ([f32; 3], f32);
        let places: [Place; 5] = [
            |i| ([i as f32, 0.0, 3.0], 1.0),
            |i| ([(i % 50) as f32, (i / 50) as f32, 3.0], 1.0),
            |_| ([1.0, 2.0, 3.0], 1.0),
            |_| ([-100.0, 7.0, 1e3], 1e-6),
            |_| ([0.0; 3], 0.0),
        ];
        for place in places {
            let bounds: Vec<Bound> = (0..2500)
                .map(|i| {
                    let (center, radius) = place(i);
                    bound(center, radius, [0.0, 0.0, 1.0], 0.9)
                })
                .collect();
            // The builder counts passes, but never less than 96.
            let hierarchy = hierarchy(&mut PlocBuilder::new(), &bounds, (0..2500).collect());
            assert!(hierarchy.max_depth < 100, "{}", hierarchy.max_depth);
        }
    }
}
