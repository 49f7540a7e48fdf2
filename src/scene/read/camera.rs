//! `camera:` of a scene file.

use super::super::error::SceneError;
use super::super::source::{Field, Raw, Source};
use super::super::syntax::CameraEntry;
use super::super::{Camera, Extent, Projection, defaults, unit};
use glam::DVec3;

/// Below this sine of the angle between them, `up` counts as parallel to the viewing direction.
const PARALLEL: f64 = 1e-6;

/// Reads the camera; what it leaves out is fitted to the objects.
pub(super) fn camera(
    source: &Source<'_>,
    raw: Raw<'_>,
    extent: &Extent,
) -> Result<Camera, SceneError> {
    let field = |raw, name: &str| source.field(raw, format_args!("camera.{name}"));
    let (axes, planes, projection) = match source.parse_kind(raw, CameraEntry::KINDS, &[])? {
        CameraEntry::Perspective {
            position,
            target,
            up,
            near,
            far,
            fov_degrees,
        } => {
            let fov_degrees = fov_degrees.map_or(Ok(defaults::FOV_DEGREES), |raw| {
                opening_angle(&field(raw, "fov_degrees"))
            })?;
            let projection = Projection::Perspective { fov_degrees };
            ([position, target, up], [near, far], projection)
        }
        CameraEntry::Orthographic {
            position,
            target,
            up,
            near,
            far,
            height,
        } => {
            let height = height.map_or_else(
                || Ok(defaults::orthographic_height(extent)),
                |raw| field(raw, "height").length(),
            )?;
            let projection = Projection::Orthographic { height };
            ([position, target, up], [near, far], projection)
        }
    };
    let [near, far] = depth_range(source, planes, projection)?;
    let [position, target, up] = aim(source, raw, axes, projection, extent)?;
    Ok(Camera {
        position,
        target,
        up,
        projection,
        near,
        far,
    })
}

fn opening_angle(field: &Field<'_>) -> Result<f64, SceneError> {
    let degrees = field.number()?;
    if degrees > 0.0 && degrees < 180.0 {
        Ok(degrees)
    } else {
        Err(field.fail(format_args!(
            "must be between 0 and 180, but is {}",
            field.excerpt()
        )))
    }
}

/// The near and far planes, as far as they are given.
fn depth_range(
    source: &Source<'_>,
    planes: [Option<Raw<'_>>; 2],
    projection: Projection,
) -> Result<[Option<f64>; 2], SceneError> {
    let fields = [
        planes[0].map(|raw| source.field(raw, "camera.near")),
        planes[1].map(|raw| source.field(raw, "camera.far")),
    ];
    let distance = |field: &Field<'_>| match projection {
        // In perspective nothing can be seen at or behind the eye.
        Projection::Perspective { .. } => field.length(),
        Projection::Orthographic { .. } => field.number(),
    };
    let near = fields[0].as_ref().map(distance).transpose()?;
    let far = fields[1].as_ref().map(distance).transpose()?;
    if let ([Some(near_field), Some(far_field)], true) = (&fields, near >= far) {
        return Err(near_field.fail(format_args!(
            "is {} and must be less than `camera.far`, which is {}",
            near_field.excerpt(),
            far_field.excerpt()
        )));
    }
    Ok([near, far])
}

/// Position, target and up of a camera whose entry is `whole`, such that they define a view.
fn aim(
    source: &Source<'_>,
    whole: Raw<'_>,
    [position, target, up]: [Option<Raw<'_>>; 3],
    projection: Projection,
    extent: &Extent,
) -> Result<[DVec3; 3], SceneError> {
    let field = |raw, name: &str| source.field(raw, format_args!("camera.{name}"));
    let target_point = target.map_or(Ok(extent.center), |raw| field(raw, "target").vector())?;
    let position_point = match (position, projection) {
        (Some(raw), _) => field(raw, "position").vector()?,
        (None, Projection::Perspective { fov_degrees }) => {
            defaults::eye(extent, target_point, fov_degrees)
        }
        (None, Projection::Orthographic { .. }) => {
            defaults::eye(extent, target_point, defaults::FOV_DEGREES)
        }
    };
    let Some(forward) = unit(target_point - position_point) else {
        return Err(source.error(
            position.or(target).unwrap_or(whole),
            "`camera.position` and `camera.target` are the same point",
        ));
    };
    let parallel = |up: DVec3| unit(up).is_none_or(|up| up.cross(forward).length() < PARALLEL);
    let up_direction = match up {
        Some(raw) => {
            let field = field(raw, "up");
            let up = field.direction()?;
            if parallel(up) {
                return Err(field.fail("must not be parallel to the viewing direction"));
            }
            up
        }
        // Looking straight down, the top of the image is where a map has its north.
        None if parallel(defaults::UP) => DVec3::Y,
        None => defaults::UP,
    };
    Ok([position_point, target_point, up_direction])
}
