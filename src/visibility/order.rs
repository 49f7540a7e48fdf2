//! Puts clusters in an order in which aligned groups lie close together and face the same way.
//!
//! A hierarchy takes eight consecutive clusters to a group, eight groups to a larger one, and so on. So the order *is*
//! the hierarchy. It comes from cutting in two again and again, always where the largest possible power of two divides
//! the position, so that groups of all sizes come out whole.
//!
//! A group costs time if the image's border or the silhouette goes through it. For a border that may be anywhere in
//! the scene, the odds are in proportion to the group's size; for the silhouette, to the angle between its normals. So
//! clusters are points in six dimensions, centres in units of the scene and axes of cones, and are cut across the
//! longest side of their box. The scene's size is that of its surface: room between objects is cut away soon, and
//! must not make the objects seem small. Backs that share their place with fronts part from them by their axes.
//!
//! What cannot turn away is kept apart, at the end: with it, no group can be dropped for facing away.

use super::block::LANES;
use super::bound::Bound;
use std::cmp::Ordering;

/// The size of the scene is worth this much of a difference between unit normals. There is not much science behind
/// it: with more, fewer blocks are visited at the image's border and more along silhouettes. For a teapot seen whole it
/// hardly matters between 2 and 20.
const SCENE_WEIGHT: f64 = 8.0;

/// A cluster's point, and its index, which breaks ties.
struct Item {
    point: [f64; 6],
    index: u32,
}

/// The indices of `bounds` in their new order.
pub(super) fn order(bounds: &[Bound]) -> Vec<u32> {
    let scale = SCENE_WEIGHT / size(bounds);
    let mut items: Vec<Item> = (0..)
        .zip(bounds)
        .map(|(index, bound)| {
            let [x, y, z] = bound.center.map(|c| f64::from(c) * scale);
            let [u, v, w] = bound.direction().to_array();
            Item {
                point: [x, y, z, u, v, w],
                index,
            }
        })
        .collect();
    items.sort_by_key(|item| !bounds[item.index as usize].can_turn_away);
    let turning = items.partition_point(|item| bounds[item.index as usize].can_turn_away);
    let (first, second) = items.split_at_mut(turning);
    cut(first, 0);
    cut(second, turning);
    items.iter().map(|item| item.index).collect()
}

/// About the size of a surface cut into these clusters, however far apart its parts are; 1 if it has none.
fn size(bounds: &[Bound]) -> f64 {
    let squares = bounds.iter().map(|bound| f64::from(bound.radius).powi(2));
    let size = squares
        .filter(|square| square.is_finite())
        .sum::<f64>()
        .sqrt();
    if size > 0.0 { size } else { 1.0 }
}

fn extent(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let min = values.clone().fold(f64::INFINITY, f64::min);
    values.fold(f64::NEG_INFINITY, f64::max) - min
}

/// Orders items that are to stand at `first` and after.
fn cut(items: &mut [Item], first: usize) {
    let end = first + items.len();
    if items.is_empty() || first / LANES == (end - 1) / LANES {
        return;
    }
    let middle = roundest(first, end) - first;
    let extents: [f64; 6] = std::array::from_fn(|k| extent(items.iter().map(|item| item.point[k])));
    let axis = (1..6).fold(
        0,
        |best, k| if extents[k] > extents[best] { k } else { best },
    );
    items.select_nth_unstable_by(middle, |a, b| -> Ordering {
        (a.point[axis].total_cmp(&b.point[axis])).then(a.index.cmp(&b.index))
    });
    let (left, right) = items.split_at_mut(middle);
    cut(left, first);
    cut(right, first + middle);
}

/// The number between `first` and `end` that the largest power of two divides.
fn roundest(first: usize, end: usize) -> usize {
    // The highest bit in which the last number differs from the first comes to be set between them.
    let highest = (first ^ (end - 1)).ilog2();
    (end - 1) >> highest << highest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_are_where_the_largest_power_of_two_is() {
        for (first, end, middle) in [(0, 16, 8), (0, 10, 8), (3, 20, 16), (8, 24, 16), (7, 9, 8)] {
            assert_eq!(roundest(first, end), middle, "{first} {end}");
        }
    }

    #[test]
    fn an_order_has_every_cluster_once() {
        for count in [0, 1, 8, 9, 100] {
            let bounds: Vec<Bound> = (0..count)
                .map(|i| {
                    Bound::of_cluster(&crate::geometry::Cluster {
                        triangles: 0..1,
                        center: [(i * 7 % 11) as f32, (i % 3) as f32, 0.0],
                        radius: 1.0,
                        cone_axis: [0.0, 0.0, 1.0],
                        cone_cos: if i % 4 == 0 { -1.0 } else { 0.9 },
                        min_altitude: 0.1,
                    })
                })
                .collect();
            let order = order(&bounds);
            // What cannot turn away comes last.
            assert!(order.is_sorted_by_key(|&i| !bounds[i as usize].can_turn_away));
            let mut sorted = order;
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..count as u32));
        }
    }
}
