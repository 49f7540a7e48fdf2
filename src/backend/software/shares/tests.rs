use super::*;
use crate::scene::{Eye, View, World};
use glam::DMat4;

fn scene(triangles: usize) -> (World, View) {
    let world = World {
        triangles: vec![[0; 3]; triangles],
        // Of 1000 triangles each, so that shares are.
        object_starts: (0..triangles as u32).step_by(1000).collect(),
        ..World::default()
    };
    let view = View {
        width: 1,
        height: 1,
        pixel_from_world: DMat4::IDENTITY,
        eye: Eye::Point([0.0; 3]),
        encoding: Default::default(),
    };
    (world, view)
}

#[test]
#[expect(clippy::reversed_empty_ranges, reason = "such a range holds nothing")]
fn shares_hold_every_visible_triangle_once_and_in_order() {
    let (world, view) = scene(200_000);
    // One after the other in the same memory.
    let mut shares = Shares::default();
    let many = (0..5000).map(|i| i * 10..i * 10 + i % 4).collect();
    let (none, few, large) = (3..3, 0..5, 0..200_000);
    for visible in [
        vec![],
        vec![none],
        vec![few],
        vec![0..1000, 1000..1024, 2000..2001, 7..3, 3000..9000],
        vec![large],
        many,
    ] {
        let geometry = Geometry {
            world: &world,
            view: &view,
            visible: &visible,
        };
        shares.cut(geometry);
        let mut got = Vec::new();
        for share in shares.used_mut() {
            while let Some(ids) = share.take(300) {
                assert!((1..=300).contains(&ids.len()), "{ids:?}");
                got.extend(ids);
            }
        }
        let want: Vec<_> = visible
            .iter()
            .cloned()
            .flatten()
            .map(|t| t as usize)
            .collect();
        assert_eq!(got, want);
    }
}

#[test]
fn shares_are_kept_unless_something_in_them_moves_appears_or_vanishes() {
    let (world, view) = scene(10_000);
    let mut shares = Shares::default();
    let mut new = |visible: &[Range<u32>], moved: Option<&[Range<u32>]>| {
        let geometry = Geometry {
            world: &world,
            view: &view,
            visible,
        };
        match moved {
            None => shares.cut(geometry),
            Some(moved) => shares.keep_unmoved(geometry, moved),
        }
        let new = shares.used().iter().filter(|share| share.is_new);
        new.map(|share| share.all.start / 1000).collect::<Vec<_>>()
    };
    let all: [Range<u32>; 2] = [0..1500, 2500..10_000];
    assert_eq!(new(&all, None).len(), 10);
    assert!(new(&all, Some(&[])).is_empty());
    // Whether it is visible or not.
    let (first, hidden, both) = (0..1, 1600..1700, 3999..4001);
    assert_eq!(new(&all, Some(&[first, hidden, both])), [0, 1, 3, 4]);
    // The same triangles in other ranges.
    let split = [0..1000, 1000..1500, 2500..4000, 4000..10_000];
    assert!(new(&split, Some(&[])).is_empty());
    assert_eq!(new(&[0..1500, 2501..9999], Some(&[])), [2, 9]);
    assert_eq!(new(&all, Some(&[])), [2, 9]);
}
