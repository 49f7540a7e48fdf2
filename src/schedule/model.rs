//! What work takes on this machine, learned while running.
//!
//! Every [`Kind`] of work has a [`Rate`]: how much real time a nominal nanosecond takes. A rate has two parts, because some kinds grow
//! with the number of triangles as well as with the number of pixels, and how these compare differs from machine to machine:
//!
//! ```text
//! predicted time = a * (nominal time of the items) + b * (nominal time of the pixels)
//! ```
//!
//! **Learning** is the normalized least mean squares rule (Widrow and Hoff 1960; Nagumo and Noda 1967): each measurement moves `(a, b)`
//! a share [`STEP`] of the way to the nearest pair that would have predicted it. So what a measurement says nothing about, stays as it
//! was. The first measurement multiplies both parts, and the next few move further, so that they count alike. Later ones that are more than
//! [`MOST_SURPRISE`] times off count as that far off: on a shared machine that is as a rule the time that something else took.
//!
//! The model tells whether work fits into the time that is left, and at which resolution an image does. It never decides what is
//! refined, or in which order: nominal costs do that.

use serde::{Deserialize, Serialize};

/// Share of the difference that one measurement makes up for.
const STEP: f64 = 0.25;

/// Measurements that are believed whatever they say.
const FIRST: u32 = 4;

/// A measurement counts as at most this many times the prediction, or this fraction of it.
const MOST_SURPRISE: f64 = 2.0;

/// Weight of a measurement in the typical deviation.
const SPREAD_STEP: f64 = 0.1;

/// Measurements of less nominal work say more about what it takes to begin with any.
const LEAST_NS: f64 = 10_000.0;

/// What is left of a rate that was doubted.
const DOUBT: f64 = 0.8;

/// A part of a rate is never lower: the next measurement could not raise it by multiplication.
const LEAST_RATE: f64 = 1e-3;

/// What is not likely to be exceeded lies this many typical deviations above what is predicted.
const CAUTION: f64 = 2.0;

/// A kind of work whose time is predicted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Finding the clusters in view.
    Cull,
    /// Finding the owner of every pixel.
    Raster,
    /// Illuminating vertices.
    Shade,
    /// Colouring the first image.
    Resolve,
    /// Shading pixels by the illumination equation while they get their first colours: what that takes beyond interpolation.
    Light,
    /// Illuminating nodes of triangles that will have curved colours.
    Curve,
    /// Collecting what could be refined.
    Collect,
    /// Planning refinement.
    Plan,
    /// Painting what was planned.
    Paint,
    /// Handing pixels over.
    Present,
    /// Enlarging an image of lower resolution while it is handed over.
    Enlarge,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 11] = [
        Self::Cull,
        Self::Raster,
        Self::Shade,
        Self::Resolve,
        Self::Light,
        Self::Curve,
        Self::Collect,
        Self::Plan,
        Self::Paint,
        Self::Present,
        Self::Enlarge,
    ];

    /// The name used in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Cull => "cull",
            Self::Raster => "raster",
            Self::Shade => "shade",
            Self::Resolve => "resolve",
            Self::Light => "light",
            Self::Curve => "curve",
            Self::Collect => "collect",
            Self::Plan => "plan",
            Self::Paint => "paint",
            Self::Present => "present",
            Self::Enlarge => "enlarge",
        }
    }
}

/// How much work there is, in nominal nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// What grows with triangles, vertices, or whatever the items are.
    pub items_ns: f64,
    /// What grows with pixels.
    pub pixels_ns: f64,
}

impl Load {
    /// Work on items only.
    #[must_use]
    pub fn of_items(ns: f64) -> Self {
        Self {
            items_ns: ns,
            pixels_ns: 0.0,
        }
    }

    /// Work on pixels only.
    #[must_use]
    pub fn of_pixels(ns: f64) -> Self {
        Self {
            items_ns: 0.0,
            pixels_ns: ns,
        }
    }
}

impl Load {
    /// Both parts in milliseconds.
    fn millis(self) -> [f64; 2] {
        [self.items_ns * 1e-6, self.pixels_ns * 1e-6]
    }

    fn square(self) -> f64 {
        self.millis().map(|ms| ms * ms).iter().sum()
    }
}

/// Real milliseconds per nominal millisecond of a kind of work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    items: f64,
    pixels: f64,
    /// Typical deviation of measurements from predictions, as a share of those.
    spread: f64,
    /// Measurements so far.
    seen: u32,
}

impl Default for Rate {
    fn default() -> Self {
        Self {
            items: 1.0,
            pixels: 1.0,
            spread: 0.1,
            seen: 0,
        }
    }
}

impl Rate {
    /// Milliseconds that the work will probably take.
    #[must_use]
    pub fn predict_ms(&self, load: Load) -> f64 {
        (self.items * load.items_ns + self.pixels * load.pixels_ns) * 1e-6
    }

    /// Milliseconds that it will probably not exceed.
    #[must_use]
    pub fn predict_at_most_ms(&self, load: Load) -> f64 {
        self.predict_ms(load) * (1.0 + CAUTION * self.spread)
    }

    /// The rate of something that takes as long as pixels do.
    fn as_of_pixels(&self) -> Self {
        Self {
            items: self.pixels,
            ..*self
        }
    }

    /// Whether both parts are positive numbers of a sensible size, which those of a file need not be.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let is_rate = |value: f64| (LEAST_RATE..=1.0 / LEAST_RATE).contains(&value);
        is_rate(self.items) && is_rate(self.pixels) && (0.0..=1.0).contains(&self.spread)
    }

    /// Takes note that the work took `ms` milliseconds. What is no positive number is ignored, and so is too little work.
    pub fn learn(&mut self, load: Load, ms: f64) {
        let predicted = self.predict_ms(load);
        let is_measurement = |value: f64| value > 0.0 && value.is_finite();
        let is_enough = load.items_ns + load.pixels_ns >= LEAST_NS;
        if !(is_enough && is_measurement(ms) && is_measurement(predicted)) {
            return;
        }
        let ratio = ms / predicted;
        let seen = self.seen;
        self.seen = seen.saturating_add(1);
        if seen == 0 {
            self.set(self.items * ratio, self.pixels * ratio);
            return;
        }
        if seen < FIRST {
            // What was guessed says nothing about how well predictions fit.
            return self.step(load, predicted * (ratio - 1.0) / f64::from(seen + 1));
        }
        let surprise = ratio.clamp(1.0 / MOST_SURPRISE, MOST_SURPRISE);
        self.note_surprise(surprise);
        self.step(load, STEP * predicted * (surprise - 1.0));
    }

    /// Lowers the rate. What is thought to take too long for any frame is never measured again, so nothing else would.
    pub fn doubt(&mut self) {
        self.set(self.items * DOUBT, self.pixels * DOUBT);
    }

    fn set(&mut self, items: f64, pixels: f64) {
        self.items = items.clamp(LEAST_RATE, 1.0 / LEAST_RATE);
        self.pixels = pixels.clamp(LEAST_RATE, 1.0 / LEAST_RATE);
    }

    /// Changes the rate as little as possible, so that the load is predicted to take `ms` more.
    fn step(&mut self, load: Load, ms: f64) {
        self.add(load, ms / load.square());
    }

    /// Adds a multiple of the load, in milliseconds, to both parts.
    fn add(&mut self, load: Load, scale: f64) {
        // Loads of some picoseconds have no square in f64.
        if scale.is_finite() {
            let [x, y] = load.millis();
            self.set(self.items + scale * x, self.pixels + scale * y);
        }
    }

    /// Takes a measurement that was `surprise` times what was predicted into account as far as the typical deviation is concerned.
    fn note_surprise(&mut self, surprise: f64) {
        self.spread += SPREAD_STEP * ((surprise - 1.0).abs() - self.spread);
    }
}

/// The rates of all kinds of work. It can be saved, and a later engine started from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostModel {
    cull: Rate,
    raster: Rate,
    shade: Rate,
    resolve: Rate,
    #[serde(default)]
    light: Rate,
    #[serde(default)]
    curve: Rate,
    collect: Rate,
    plan: Rate,
    paint: Rate,
    present: Rate,
    enlarge: Rate,
}

impl CostModel {
    /// Milliseconds that the work will probably take.
    #[must_use]
    pub fn predict_ms(&self, kind: Kind, load: Load) -> f64 {
        self.best_guess(kind).predict_ms(load)
    }

    /// Milliseconds that it will probably not exceed.
    #[must_use]
    pub fn predict_at_most_ms(&self, kind: Kind, load: Load) -> f64 {
        self.best_guess(kind).predict_at_most_ms(load)
    }

    /// Takes note that the work took `ms` milliseconds.
    pub fn learn(&mut self, kind: Kind, load: Load, ms: f64) {
        self.rate_mut(kind).learn(load, ms);
    }

    /// Takes note that work of two kinds took `ms` milliseconds together. The second kind is the one that is less well known: while nothing
    /// has been measured of it alone, it gets all that the first is not predicted to take. Where there is no load of it, only the first learns.
    pub fn learn_both(&mut self, [first, second]: [(Kind, Load); 2], ms: f64) {
        if !(ms > 0.0 && ms.is_finite()) {
            return;
        }
        let predicted = [first, second].map(|(kind, load)| self.predict_ms(kind, load));
        let total = predicted[0] + predicted[1];
        if second.1.square() == 0.0 {
            return self.learn(first.0, first.1, ms);
        }
        if self.rate(first.0).seen == 0 {
            // Nothing is known of either, so both are off by the same.
            self.learn(first.0, first.1, ms * predicted[0] / total);
            return self.learn(second.0, second.1, ms * predicted[1] / total);
        }
        if self.rate(second.0).seen == 0 {
            // Not less than a fraction: what is left may be no more than noise.
            let rest = (ms - predicted[0]).max(predicted[1] / (MOST_SURPRISE * MOST_SURPRISE));
            return self.learn(second.0, second.1, rest);
        }
        let ratio = ms / total;
        if !ratio.is_finite() {
            return;
        }
        // As for a kind alone: the first measurements count alike, whatever they say.
        let seen = self.rate(second.0).seen;
        let is_new = seen < FIRST;
        let (surprise, share) = if is_new {
            (ratio, 1.0 / f64::from(seen + 1))
        } else {
            (ratio.clamp(1.0 / MOST_SURPRISE, MOST_SURPRISE), STEP)
        };
        let square = first.1.square() + second.1.square();
        let scale = share * total * (surprise - 1.0) / square;
        for (kind, load) in [first, second] {
            let rate = self.rate_mut(kind);
            rate.seen = rate.seen.saturating_add(1);
            if !is_new {
                rate.note_surprise(surprise);
            }
            rate.add(load, scale);
        }
    }

    /// Lowers the rate of work that was not admitted though a whole frame was there for it.
    pub fn doubt(&mut self, kind: Kind) {
        self.rate_mut(kind).doubt();
    }

    /// Whether all rates are [valid](Rate::is_valid).
    #[must_use]
    pub fn is_valid(&self) -> bool {
        Kind::ALL.into_iter().all(|kind| self.rate(kind).is_valid())
    }

    /// The rate of a kind of work.
    #[must_use]
    pub fn rate(&self, kind: Kind) -> &Rate {
        match kind {
            Kind::Cull => &self.cull,
            Kind::Raster => &self.raster,
            Kind::Shade => &self.shade,
            Kind::Resolve => &self.resolve,
            Kind::Light => &self.light,
            Kind::Curve => &self.curve,
            Kind::Collect => &self.collect,
            Kind::Plan => &self.plan,
            Kind::Paint => &self.paint,
            Kind::Present => &self.present,
            Kind::Enlarge => &self.enlarge,
        }
    }

    /// The rate of a kind of work, or of a similar one as long as it has not been measured.
    fn best_guess(&self, kind: Kind) -> Rate {
        let rate = *self.rate(kind);
        match kind {
            Kind::Light if rate.seen == 0 => self.resolve.as_of_pixels(),
            Kind::Curve if rate.seen == 0 => self.plan,
            _ => rate,
        }
    }

    fn rate_mut(&mut self, kind: Kind) -> &mut Rate {
        match kind {
            Kind::Cull => &mut self.cull,
            Kind::Raster => &mut self.raster,
            Kind::Shade => &mut self.shade,
            Kind::Resolve => &mut self.resolve,
            Kind::Light => &mut self.light,
            Kind::Curve => &mut self.curve,
            Kind::Collect => &mut self.collect,
            Kind::Plan => &mut self.plan,
            Kind::Paint => &mut self.paint,
            Kind::Present => &mut self.present,
            Kind::Enlarge => &mut self.enlarge,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A generator of numbers in [0, 1).
    fn noise(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (*state >> 40) as f64 / f64::from(1 << 24)
    }

    #[test]
    fn both_parts_are_learned_from_loads_of_different_kinds() {
        let mut rate = Rate::default();
        let mut state = 1;
        let truth = |load: Load| (0.3 * load.items_ns + 2.5 * load.pixels_ns) * 1e-6;
        let mut total = 0.0;
        for round in 0..400 {
            let load = Load {
                items_ns: 1e6 * noise(&mut state),
                pixels_ns: 1e6 * noise(&mut state),
            };
            if round >= 300 {
                total += (rate.predict_ms(load) / truth(load) - 1.0).abs();
            }
            // Up to a tenth of noise, and now and then ten times the time.
            let hiccup = if round % 50 == 7 { 10.0 } else { 1.0 };
            rate.learn(
                load,
                truth(load) * (0.95 + 0.1 * noise(&mut state)) * hiccup,
            );
        }
        assert!(total / 100.0 < 0.08, "{total} with {rate:?}");
    }

    #[test]
    fn two_kinds_are_told_apart_by_what_they_take_together() {
        let mut model = CostModel::default();
        let pixels = Load::of_pixels(1e6);
        model.learn_both([(Kind::Resolve, pixels), (Kind::Light, pixels)], 0.0);
        assert_eq!(model, CostModel::default(), "no time is no measurement");
        let (first, second) = (Load::of_pixels(1e6), |part| Load::of_pixels(2e6 * part));
        let truth = |part: f64| 0.5 * 1.0 + 3.0 * 2.0 * part;
        let mut state = 3;
        for round in 0..300 {
            let part = match round % 3 {
                0 => 0.0,
                _ => noise(&mut state),
            };
            let loads = [(Kind::Resolve, first), (Kind::Light, second(part))];
            model.learn_both(loads, truth(part) * (0.97 + 0.06 * noise(&mut state)));
        }
        let rates = [Kind::Resolve, Kind::Light].map(|kind| model.predict_ms(kind, first));
        assert!((rates[0] - 0.5).abs() < 0.05, "{rates:?}");
        assert!((rates[1] - 3.0).abs() < 0.3, "{rates:?}");
    }

    #[test]
    fn what_is_no_measurement_changes_nothing() {
        let mut rate = Rate::default();
        let load = Load::of_items(1e6);
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            rate.learn(load, odd);
        }
        rate.learn(Load::default(), 1.0);
        rate.learn(Load::of_pixels(f64::NAN), 1.0);
        rate.learn(Load::of_pixels(1e-300), 1e-306);
        assert_eq!(rate.predict_ms(load), 1.0);
        // Nor does a part that there was no load of, but for the first time.
        rate.learn(load, 1.0);
        rate.learn(load, 1.5);
        assert!(rate.predict_ms(load) > 1.0);
        assert_eq!(rate.predict_ms(Load::of_pixels(1e6)), 1.0);
    }

    #[test]
    fn the_first_measurement_replaces_the_guess() {
        let mut rate = Rate::default();
        let load = Load {
            items_ns: 1e6,
            pixels_ns: 2e6,
        };
        rate.learn(load, 0.05);
        assert!((rate.predict_ms(load) - 0.05).abs() < 0.01, "{rate:?}");
    }

    #[test]
    fn a_single_hiccup_is_soon_forgotten() {
        let mut rate = Rate::default();
        let load = Load::of_pixels(2e6);
        for _ in 0..10 {
            rate.learn(load, 2.0);
        }
        rate.learn(load, 1000.0);
        assert!(rate.predict_ms(load) < 2.6);
        for _ in 0..20 {
            rate.learn(load, 2.0);
        }
        assert!((rate.predict_ms(load) - 2.0).abs() < 0.01);
        assert!(rate.predict_at_most_ms(load) < 2.6);
    }
}
