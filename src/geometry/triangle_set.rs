//! Some of a world's triangles, one bit each.

/// Triangles of a word.
const WORD: usize = 64;

/// A set of a world's triangles.
#[derive(Clone, Debug, Default)]
pub struct TriangleSet {
    words: Vec<u64>,
    len: usize,
}

impl TriangleSet {
    /// Takes all triangles out, and makes room for those of a world that has `triangles`.
    pub fn clear(&mut self, triangles: usize) {
        let words = triangles.div_ceil(WORD);
        if self.len > 0 || self.words.len() != words {
            self.words.clear();
            self.words.resize(words, 0);
            self.len = 0;
        }
    }

    /// Adds a triangle.
    ///
    /// # Panics
    /// When it is none of the world's, as far as there is no room for it.
    #[inline]
    pub fn insert(&mut self, triangle: u32) {
        let index = triangle as usize;
        let (word, bit) = (&mut self.words[index / WORD], 1 << (index % WORD));
        self.len += usize::from(*word & bit == 0);
        *word |= bit;
    }

    /// Whether a triangle is in the set.
    #[inline]
    #[must_use]
    pub fn contains(&self, triangle: u32) -> bool {
        let index = triangle as usize;
        let word = self.words.get(index / WORD);
        word.is_some_and(|word| word >> (index % WORD) & 1 == 1)
    }

    /// How many triangles are in it.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True when it has none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_was_put_into_it_until_it_is_cleared() {
        let mut set = TriangleSet::default();
        assert!(!set.contains(0) && set.is_empty());
        set.clear(130);
        for triangle in [0, 63, 64, 129, 64] {
            set.insert(triangle);
        }
        let held: Vec<u32> = (0..1000).filter(|&t| set.contains(t)).collect();
        assert_eq!(held, [0, 63, 64, 129]);
        assert_eq!(set.len(), 4);
        set.clear(130);
        assert!((0..1000).all(|t| !set.contains(t)) && set.is_empty());
        set.insert(5);
        set.clear(6);
        assert!(set.is_empty() && !set.contains(5));
    }
}
