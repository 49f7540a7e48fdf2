//! `animation:` of a scene file, `orbit:` of its lights and `spin:` of its objects.

use super::super::animation::{Animation, MAX_DEGREES_PER_SECOND, Turn};
use super::super::error::SceneError;
use super::super::source::{Raw, Source};
use super::super::syntax::{AnimationEntry, TurnEntry};
use super::super::{Extent, LightKind, Scene, defaults};
use crate::output::timing::{FPS_RANGE, FrameRate, MAX_DURATION_S, Timing};
use glam::DVec3;

/// The motions that lights and objects ask for, by their index.
#[derive(Debug, Default)]
pub(super) struct Motions<'a> {
    pub(super) lights: Vec<(usize, Raw<'a>)>,
    pub(super) objects: Vec<(usize, Raw<'a>)>,
}

/// Reads what moves in `scene`, which is otherwise complete: `None` when nothing does and there is no such entry.
pub(super) fn animation<'a>(
    source: &Source<'a>,
    raw: Option<Raw<'a>>,
    motions: &Motions<'a>,
    scene: &Scene,
    extent: &Extent,
) -> Result<Option<Animation>, SceneError> {
    let entry: Option<AnimationEntry<'a>> = raw.map(|raw| source.parse(raw)).transpose()?;
    let timing = match (&entry, raw) {
        (Some(entry), Some(raw)) => timing(source, raw, entry)?,
        _ => Timing::default(),
    };
    let mut animation = Animation::new(timing);
    if let Some(orbit) = entry.and_then(|entry| entry.orbit) {
        let center = scene.camera.target;
        let turn = turn(source, orbit, "animation.orbit", center, &timing)?;
        animation = animation.orbit_camera(scene.camera, turn);
    }
    for &(index, raw) in &motions.lights {
        let light = scene.lights[index];
        let name = format!("lights[{index}].orbit");
        if let (LightKind::Directional { .. }, Some(center)) =
            (light.kind, source.parse::<TurnEntry<'_>>(raw)?.center)
        {
            let field = source.field(center, format_args!("{name}.center"));
            return Err(field.fail("has no meaning for a directional light, which has no place"));
        }
        let turn = turn(source, raw, &name, extent.center, &timing)?;
        animation = animation.orbit_light(index, light, turn);
    }
    for &(index, raw) in &motions.objects {
        let place = scene.objects[index].author_from_mesh;
        let center = place.w_axis.truncate();
        let turn = turn(
            source,
            raw,
            &format!("objects[{index}].spin"),
            center,
            &timing,
        )?;
        animation = animation.spin(index, place, turn);
    }
    Ok((raw.is_some() || animation.is_moving()).then_some(animation))
}

/// Length and frame rate of the animation whose entry is `whole`.
fn timing<'a>(
    source: &Source<'a>,
    whole: Raw<'a>,
    entry: &AnimationEntry<'a>,
) -> Result<Timing, SceneError> {
    let default = Timing::default();
    let duration_s = match entry.duration {
        Some(raw) => {
            let field = source.field(raw, "animation.duration");
            let seconds = field.length()?;
            if seconds > MAX_DURATION_S {
                return Err(field.fail(format_args!(
                    "must be at most {MAX_DURATION_S} seconds, but is {}",
                    field.excerpt()
                )));
            }
            seconds
        }
        None => default.duration_s(),
    };
    let rate = match entry.fps {
        Some(raw) => {
            let field = source.field(raw, "animation.fps");
            FrameRate::from_fps(field.number()?).ok_or_else(|| {
                field.fail(format_args!(
                    "must be from {} to {}, but is {}",
                    FPS_RANGE.start(),
                    FPS_RANGE.end(),
                    field.excerpt()
                ))
            })?
        }
        None => default.rate(),
    };
    Timing::new(duration_s, rate).map_err(|error| {
        let at = entry.duration.or(entry.fps).unwrap_or(whole);
        source.error(at, format_args!("`animation` is too long: {error}"))
    })
}

/// A turn, by default about the vertical through `center`, once around in the length of the animation.
fn turn<'a>(
    source: &Source<'a>,
    raw: Raw<'a>,
    name: &str,
    center: DVec3,
    timing: &Timing,
) -> Result<Turn, SceneError> {
    let entry: TurnEntry<'a> = source.parse(raw)?;
    let field = |raw, part: &str| source.field(raw, format_args!("{name}.{part}"));
    let degrees_per_second = match entry.degrees_per_second {
        Some(raw) => {
            let field = field(raw, "degrees_per_second");
            let speed = field.number()?;
            if speed.abs() > MAX_DEGREES_PER_SECOND {
                return Err(field.fail(format_args!(
                    "must be at most {MAX_DEGREES_PER_SECOND} in magnitude, but is {}",
                    field.excerpt()
                )));
            }
            speed
        }
        None => 360.0 / timing.duration_s(),
    };
    Ok(Turn {
        axis: entry
            .axis
            .map_or(Ok(defaults::UP), |raw| field(raw, "axis").direction())?,
        center: entry
            .center
            .map_or(Ok(center), |raw| field(raw, "center").vector())?,
        degrees_per_second,
    })
}
