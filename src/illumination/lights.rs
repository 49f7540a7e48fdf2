//! Sets of lights.

pub use crate::scene::limits::MAX_LIGHTS;

/// A set of lights, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightMask(pub u128);

impl LightMask {
    /// No light.
    pub const NONE: Self = Self(0);

    /// The first `count` lights.
    #[must_use]
    pub fn first(count: usize) -> Self {
        if count >= MAX_LIGHTS {
            Self(u128::MAX)
        } else {
            Self((1 << count) - 1)
        }
    }

    /// Whether light `index` is in the set.
    #[inline]
    #[must_use]
    pub fn contains(self, index: usize) -> bool {
        self.0 >> index & 1 == 1
    }

    /// Adds light `index`.
    pub fn insert(&mut self, index: usize) {
        self.0 |= 1 << index;
    }

    /// How many lights are in the set.
    #[must_use]
    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// True when no light is in the set.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The lights in the set, ascending.
    #[inline]
    pub fn iter(self) -> impl Iterator<Item = usize> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            let index = left.trailing_zeros() as usize;
            (left != 0).then(|| {
                left &= left - 1;
                index
            })
        })
    }
}

/// Which terms of which lights are evaluated; `specular` is a subset of `diffuse`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActiveLights {
    /// Lights whose diffuse term is evaluated.
    pub diffuse: LightMask,
    /// Lights whose specular term is evaluated too.
    pub specular: LightMask,
}

impl ActiveLights {
    /// Both terms of the first `count` lights.
    #[must_use]
    pub fn all(count: usize) -> Self {
        let mask = LightMask::first(count);
        Self {
            diffuse: mask,
            specular: mask,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_hold_what_was_put_in() {
        let mut mask = LightMask::NONE;
        for index in [0, 5, 127] {
            mask.insert(index);
        }
        assert_eq!(mask.iter().collect::<Vec<_>>(), [0, 5, 127]);
        assert_eq!(mask.len(), 3);
        assert!(mask.contains(127) && !mask.contains(126));
        assert_eq!(LightMask::first(MAX_LIGHTS).len(), MAX_LIGHTS);
        assert!(LightMask::first(0).is_empty());
    }
}
