//! What has become of the world since a picture was drawn, as far as it tells what of the picture may be kept.

use std::ops::Range;

/// What has moved, and whether light is the same.
#[derive(Debug, Default)]
pub(super) struct Motion {
    /// Whether the picture's pixels have had their owners found, and nothing has moved since but `triangles`.
    is_known: bool,
    /// Triangles of the objects that have moved, ascending; each object's are always the same ranges.
    triangles: Vec<Range<u32>>,
    /// Whether lights, materials and background are those that the picture had when it got its colours.
    pub(super) has_its_light: bool,
}

impl Motion {
    /// Notes that nothing of the picture may be kept.
    pub(super) fn forget(&mut self) {
        self.is_known = false;
        self.has_its_light = false;
        self.triangles.clear();
    }

    /// Notes that the owners of all pixels have been found.
    pub(super) fn begin(&mut self) {
        self.is_known = true;
        self.triangles.clear();
    }

    /// Adds triangles of objects that have moved, ascending.
    pub(super) fn add(&mut self, moved: &[Range<u32>]) {
        if !self.is_known {
            return;
        }
        if self.triangles.is_empty() {
            self.triangles.extend_from_slice(moved);
            return;
        }
        for range in moved {
            let place = (self.triangles).binary_search_by_key(&range.start, |known| known.start);
            match place {
                // An object without triangles starts where the next does.
                Ok(at) if self.triangles[at].end < range.end => self.triangles[at] = range.clone(),
                Ok(_) => {}
                Err(at) => self.triangles.insert(at, range.clone()),
            }
        }
    }

    /// All that has moved, if nothing else has become of the picture's pixels.
    pub(super) fn moved(&self) -> Option<&[Range<u32>]> {
        self.is_known.then_some(&self.triangles[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_moved_adds_up_until_it_is_drawn() {
        let mut motion = Motion::default();
        let (a, empty, b, c) = (0..5, 5..5, 5..9, 20..30_u32);
        motion.add(std::slice::from_ref(&a));
        assert_eq!(motion.moved(), None, "nothing has been drawn");
        motion.begin();
        assert_eq!(motion.moved(), Some(&[][..]));
        motion.add(&[empty.clone(), c.clone()]);
        motion.add(&[a.clone(), b.clone()]);
        motion.add(&[empty, c.clone()]);
        assert_eq!(motion.moved(), Some(&[a, b, c][..]));
        motion.begin();
        assert_eq!(motion.moved(), Some(&[][..]));
        motion.forget();
        assert_eq!(motion.moved(), None);
    }
}
