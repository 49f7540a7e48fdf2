//! Where in the list of visible triangles a triangle is.
//!
//! A bit for each triangle of the world says whether it is on the list, which is ascending; for each word of bits it is known how
//! many there are before it, and those inside are counted. That is a twentieth of the memory of a list by triangle, hence written
//! and read much faster where a few of very many triangles are visible.

/// Triangles of a word.
const WORD: usize = 64;

/// The places of triangles on an ascending list.
#[derive(Clone, Debug, Default)]
pub(super) struct Places {
    words: Vec<u64>,
    /// How many triangles come before each word; undefined for words without any.
    before: Vec<u32>,
    len: u32,
}

impl Places {
    /// Begins an empty list of some of a world's `triangles` triangles.
    pub(super) fn reset(&mut self, triangles: usize) {
        let words = triangles.div_ceil(WORD);
        self.words.clear();
        self.words.resize(words, 0);
        self.before.resize(words, 0);
        self.len = 0;
    }

    /// Puts a triangle at the end of the list.
    ///
    /// # Panics
    /// When it is not one of the world's.
    #[inline]
    pub(super) fn push(&mut self, triangle: u32) {
        let word = triangle as usize / WORD;
        let bits = &mut self.words[word];
        if *bits == 0 {
            self.before[word] = self.len;
        }
        debug_assert_eq!(*bits >> (triangle as usize % WORD), 0, "not ascending");
        *bits |= 1 << (triangle as usize % WORD);
        self.len += 1;
    }

    /// The place of a triangle, if it is on the list.
    #[inline]
    pub(super) fn get(&self, triangle: u32) -> Option<u32> {
        let word = triangle as usize / WORD;
        let (bits, bit) = (*self.words.get(word)?, 1 << (triangle as usize % WORD));
        let below: u64 = bits & (bit - 1);
        (bits & bit != 0).then(|| self.before[word] + below.count_ones())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_of_the_list_last_begun() {
        let mut places = Places::default();
        assert_eq!(places.get(0), None);
        for list in [
            vec![],
            vec![0, 1, 63, 64, 199],
            (3..190).step_by(7).collect(),
        ] {
            places.reset(200);
            for &triangle in &list {
                places.push(triangle);
            }
            for triangle in 0..300 {
                let want = list.iter().position(|&t| t == triangle);
                assert_eq!(places.get(triangle), want.map(|place| place as u32));
            }
        }
    }
}
