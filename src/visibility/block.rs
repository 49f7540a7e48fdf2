//! Eight bounds side by side, and what tests find out about them.
//!
//! A test is a plain loop over the eight lanes, without branches, which the compiler turns into vector instructions.
//! All of it is `f64` arithmetic of one rounding per operation, so that results are the same whatever the instructions.

use super::bound::Bound;

/// Bounds in a block.
pub(super) const LANES: usize = 8;

/// What is known of everything within a bound, in bits.
pub(super) type State = u64;

/// A bit for each of the six half-spaces that it may stick out of.
pub(super) const CROSSING: State = 0b11_1111;
/// It is outside of the view.
pub(super) const OUTSIDE: State = 1 << 6;
/// All of it faces away and can be dropped.
pub(super) const AWAY: State = 1 << 7;
/// None of it can be proved to face away.
pub(super) const FRONT: State = 1 << 8;
/// Its corners come to be snapped unclipped.
pub(super) const UNCLIPPED: State = 1 << 9;

/// The states of a block.
pub(super) type States = [State; LANES];

/// Eight [`Bound`]s.
#[derive(Clone, Debug)]
pub(super) struct Block {
    center: [[f32; LANES]; 3],
    radius: [f32; LANES],
    pub(super) axis: [[f32; LANES]; 3],
    pub(super) cos: [f64; LANES],
    pub(super) sin: [f64; LANES],
    pub(super) altitude: [f32; LANES],
    /// [`FRONT`] where nothing can turn away.
    pub(super) known: States,
}

/// The balls of a block, in `f64`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Balls {
    pub(super) center: [[f64; LANES]; 3],
    pub(super) radius: [f64; LANES],
    /// Sum of the magnitudes of the centre's coordinates and of three radii.
    pub(super) reach: [f64; LANES],
}

impl Block {
    /// What lanes without a bound hold.
    pub(super) const EMPTY: Self = Self {
        center: [[0.0; LANES]; 3],
        radius: [0.0; LANES],
        axis: [[0.0; LANES]; 3],
        cos: [0.0; LANES],
        sin: [0.0; LANES],
        altitude: [0.0; LANES],
        known: [FRONT; LANES],
    };

    pub(super) fn set(&mut self, lane: usize, bound: &Bound) {
        for k in 0..3 {
            self.center[k][lane] = bound.center[k];
            self.axis[k][lane] = bound.axis[k];
        }
        self.radius[lane] = bound.radius;
        self.cos[lane] = bound.cos;
        self.sin[lane] = bound.sin;
        self.altitude[lane] = bound.altitude;
        self.known[lane] = if bound.can_turn_away { 0 } else { FRONT };
    }

    pub(super) fn get(&self, lane: usize) -> Bound {
        Bound {
            center: self.center.map(|c| c[lane]),
            radius: self.radius[lane],
            axis: self.axis.map(|c| c[lane]),
            cos: self.cos[lane],
            sin: self.sin[lane],
            altitude: self.altitude[lane],
            can_turn_away: self.known[lane] & FRONT == 0,
        }
    }

    pub(super) fn balls(&self) -> Balls {
        let wide = |values: &[f32; LANES]| values.map(f64::from);
        let [x, y, z] = [0, 1, 2].map(|k| wide(&self.center[k]));
        let radius = wide(&self.radius);
        let mut reach = [0.0; LANES];
        for i in 0..LANES {
            reach[i] = x[i].abs() + y[i].abs() + z[i].abs() + 3.0 * radius[i];
        }
        Balls {
            center: [x, y, z],
            radius,
            reach,
        }
    }
}

impl Balls {
    /// The centre of one ball.
    #[inline(always)]
    pub(super) fn center(&self, lane: usize) -> [f64; 3] {
        let [x, y, z] = &self.center;
        [x[lane], y[lane], z[lane]]
    }
}
