//! What moves in a scene, and where everything is at a time.
//!
//! All motion is turning at a constant rate: the camera and the lights orbit a point, objects spin about one. After `t`
//! seconds at `w` degrees a second about the unit axis `a` through `c`, a vector `v` has changed by (Rodrigues)
//!
//! ```text
//! D v = sin(w t) a x v + (1 - cos(w t)) a x (a x v)
//! ```
//!
//! and a point that rests at `p` is at `p + D (p - c)`. Written so, with a sine and cosine that are exact at right
//! angles, everything is back at rest, to the bit, after whole turns.
//!
//! Everything is computed from the state of rest, which the animation holds, never from the state before: a time gives the
//! same scene whatever the times before it were, and errors do not add up.

use super::{Camera, Light, LightKind, Scene, unit};
use crate::math::sin_cos_degrees;
use crate::output::Timing;
use glam::{DMat4, DVec3, DVec4};

/// Fastest turn, in degrees a second: a hundred turns.
pub const MAX_DEGREES_PER_SECOND: f64 = 36_000.0;

/// A steady turn about an axis through a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Direction of the axis in author space, of any length. Without a direction nothing turns.
    pub axis: DVec3,
    /// A point of the axis, in author space. Directions do not depend on it.
    pub center: DVec3,
    /// Speed, counter-clockwise seen from the tip of the axis.
    pub degrees_per_second: f64,
}

impl Turn {
    /// How far everything has turned after `seconds`.
    fn after(&self, seconds: f64) -> Rotation {
        let degrees = self.degrees_per_second * seconds;
        let (sine, cosine) = match degrees.is_finite() {
            true => sin_cos_degrees(degrees),
            false => (0.0, 1.0),
        };
        Rotation {
            axis: unit(self.axis).unwrap_or(DVec3::ZERO),
            center: self.center,
            sine,
            versine: 1.0 - cosine,
        }
    }
}

/// A rotation about an axis through a point.
#[derive(Clone, Copy, Debug)]
struct Rotation {
    /// A unit vector, or zero for no rotation.
    axis: DVec3,
    center: DVec3,
    sine: f64,
    /// One less the cosine.
    versine: f64,
}

impl Rotation {
    /// By how much a vector changes.
    fn change(&self, v: DVec3) -> DVec3 {
        let across = self.axis.cross(v);
        self.sine * across + self.versine * self.axis.cross(across)
    }

    fn vector(&self, v: DVec3) -> DVec3 {
        v + self.change(v)
    }

    fn point(&self, p: DVec3) -> DVec3 {
        p + self.change(p - self.center)
    }

    /// The camera turned as a whole: a picture as if the scene stood on a turntable.
    fn camera(&self, rest: &Camera) -> Camera {
        Camera {
            position: self.point(rest.position),
            target: self.point(rest.target),
            up: self.vector(rest.up),
            ..*rest
        }
    }

    fn light(&self, rest: &Light) -> Light {
        Light {
            kind: match rest.kind {
                LightKind::Point { position } => LightKind::Point {
                    position: self.point(position),
                },
                LightKind::Directional { direction } => LightKind::Directional {
                    direction: self.vector(direction),
                },
            },
            ..*rest
        }
    }

    fn transform(&self, rest: &DMat4) -> DMat4 {
        let column = |column: DVec4| self.vector(column.truncate()).extend(column.w);
        DMat4::from_cols(
            column(rest.x_axis),
            column(rest.y_axis),
            column(rest.z_axis),
            self.point(rest.w_axis.truncate()).extend(rest.w_axis.w),
        )
    }
}

/// What moves in a scene, for how long, and at how many frames a second it is filmed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Animation {
    timing: Timing,
    camera: Option<(Camera, Turn)>,
    /// By index.
    lights: Vec<(usize, Light, Turn)>,
    /// By index.
    objects: Vec<(usize, DMat4, Turn)>,
}

impl Animation {
    /// An animation in which nothing moves yet.
    #[must_use]
    pub fn new(timing: Timing) -> Self {
        Self {
            timing,
            ..Self::default()
        }
    }

    /// The camera goes once around its target in the whole time, about the direction that is up in the image.
    #[must_use]
    pub fn turntable(camera: Camera, timing: Timing) -> Self {
        let turn = Turn {
            axis: camera.up,
            center: camera.target,
            degrees_per_second: 360.0 / timing.duration_s(),
        };
        Self::new(timing).orbit_camera(camera, turn)
    }

    /// Moves the camera, `rest` being where it is at time 0.
    #[must_use]
    pub fn orbit_camera(mut self, rest: Camera, turn: Turn) -> Self {
        self.camera = Some((rest, turn));
        self
    }

    /// Moves the light of that index, `rest` being where it is at time 0. The last motion given counts.
    #[must_use]
    pub fn orbit_light(mut self, index: usize, rest: Light, turn: Turn) -> Self {
        self.lights.retain(|&(i, ..)| i != index);
        self.lights.push((index, rest, turn));
        self
    }

    /// Moves the object of that index, `rest` being its transform at time 0. The last motion given counts.
    #[must_use]
    pub fn spin(mut self, index: usize, rest: DMat4, turn: Turn) -> Self {
        self.objects.retain(|&(i, ..)| i != index);
        self.objects.push((index, rest, turn));
        self
    }

    /// Length and frame rate.
    #[must_use]
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    /// Whether anything has a motion.
    #[must_use]
    pub fn is_moving(&self) -> bool {
        self.camera.is_some() || !self.lights.is_empty() || !self.objects.is_empty()
    }
}

impl Scene {
    /// What moves in the scene, and for how long; `None` when its file says nothing of it.
    #[must_use]
    pub fn animation(&self) -> Option<&Animation> {
        self.animation.as_ref()
    }

    /// Changes what [`set_time`](Self::set_time) moves. Nothing moves yet.
    pub fn set_animation(&mut self, animation: Option<Animation>) {
        self.animation = animation;
    }

    /// Brings everything that the [animation](Self::animation) moves to where it is after `seconds`, which may be beyond its
    /// end, or negative; NaN and infinity count as 0. What is there already keeps its revision, as does what does not move.
    ///
    /// ```
    /// # use specula::Scene;
    /// let mut scene = Scene::parse("(objects: [(shape: Teapot(), spin: ())])", "spinning.ron")?;
    /// let rest = scene.objects()[0].author_from_mesh;
    /// scene.set_time(1.5);
    /// assert_ne!(scene.objects()[0].author_from_mesh, rest);
    /// # Ok::<(), specula::scene::SceneError>(())
    /// ```
    ///
    /// Time overrides what was set by hand: whoever replaces a camera, light or object that moves replaces the animation
    /// too.
    pub fn set_time(&mut self, seconds: f64) {
        let seconds = if seconds.is_finite() { seconds } else { 0.0 };
        // Taken out while the scene changes; put back below.
        let Some(animation) = self.animation.take() else {
            return;
        };
        if let Some((rest, turn)) = &animation.camera {
            self.set_camera(turn.after(seconds).camera(rest));
        }
        for (index, rest, turn) in &animation.lights {
            // There may be fewer lights or objects by now.
            if *index < self.lights.len() {
                self.set_light(*index, turn.after(seconds).light(rest));
            }
        }
        for (index, rest, turn) in &animation.objects {
            if *index < self.objects.len() {
                self.set_transform(*index, turn.after(seconds).transform(rest));
            }
        }
        self.animation = Some(animation);
    }
}
