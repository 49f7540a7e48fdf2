//! `objects:` of a scene file.

use super::super::Object;
use super::super::error::{SceneError, reason};
use super::super::limits::{MAX_SEGMENTS, MAX_TRIANGLES};
use super::super::mesh_file::{MeshUp, load_mesh};
use super::super::shape::Shape;
use super::super::source::{Field, Raw, Source};
use super::super::syntax::{NormalsEntry, ObjectEntry, ShapeEntry, UpEntry, WeightEntry};
use super::Materials;
use super::animation::Motions;
use crate::geometry::Mesh;
use crate::geometry::import::Normals;
use crate::geometry::normals::{CREASE_DEGREES, Weight};
use crate::math::sin_cos_degrees;
use glam::{DMat3, DMat4, DVec3};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::PathBuf;
use std::sync::Arc;

/// Reads the objects, of which there is at least one.
pub(super) fn objects<'a>(
    source: &Source<'a>,
    raw: Option<Raw<'a>>,
    materials: &mut Materials,
    motions: &mut Motions<'a>,
) -> Result<Vec<Object>, SceneError> {
    let entries: Vec<Raw<'a>> = raw.map_or_else(|| Ok(Vec::new()), |raw| source.parse(raw))?;
    if entries.is_empty() {
        return Err(source.error(
            raw.unwrap_or(source.whole()),
            "the scene has no objects; `objects` must name at least one",
        ));
    }
    let mut meshes = Meshes::default();
    let mut planned = Vec::with_capacity(entries.len());
    let mut triangles = 0_u64;
    for (index, &raw) in entries.iter().enumerate() {
        let entry: ObjectEntry<'a> = source.parse(raw)?;
        motions.objects.extend(entry.spin.map(|raw| (index, raw)));
        let at = format!("objects[{index}]");
        let (geometry, size) = geometry(source, raw, &entry, &at, &mut meshes)?;
        triangles += geometry.triangles();
        if triangles > MAX_TRIANGLES {
            let (raw, name) = match entry.mesh {
                Some(mesh) => (mesh, "mesh"),
                None => (entry.shape.unwrap_or(raw), "shape"),
            };
            return Err(source.field(raw, format_args!("{at}.{name}")).fail(
                format_args!(
                    "brings the scene to {triangles} triangles; at most {MAX_TRIANGLES} are possible"
                ),
            ));
        }
        let material = materials.find(source, entry.material, format_args!("{at}.material"))?;
        planned.push((geometry, material, place(source, &entry, size, &at)?));
    }
    // Only now, with everything checked, is memory taken for shapes.
    let mut shapes: HashMap<[u64; 4], Arc<Mesh>> = HashMap::new();
    Ok(planned
        .into_iter()
        .map(|(geometry, material, author_from_mesh)| Object {
            mesh: match geometry {
                Geometry::Mesh(mesh) => mesh,
                Geometry::Shape(shape) => shapes
                    .entry(shape.key())
                    .or_insert_with(|| Arc::new(shape.mesh()))
                    .clone(),
            },
            material,
            author_from_mesh,
        })
        .collect())
}

/// What an object looks like.
enum Geometry {
    /// A shape, yet to be made.
    Shape(Shape),
    /// A mesh from a file.
    Mesh(Arc<Mesh>),
}

impl Geometry {
    fn triangles(&self) -> u64 {
        match self {
            Self::Shape(shape) => shape.triangles(),
            Self::Mesh(mesh) => mesh.triangles.len() as u64,
        }
    }
}

/// The geometry of an object whose entry is `whole`, and the linear map from its space to the object's before
/// that is placed.
fn geometry<'a>(
    source: &Source<'a>,
    whole: Raw<'a>,
    entry: &ObjectEntry<'a>,
    at: &str,
    meshes: &mut Meshes,
) -> Result<(Geometry, DMat3), SceneError> {
    match (entry.shape, entry.mesh) {
        (Some(raw), None) => {
            for (option, name) in [(entry.normals, "normals"), (entry.up, "up")] {
                if let Some(option) = option {
                    return Err(source
                        .field(option, format_args!("{at}.{name}"))
                        .fail("is for objects with a `mesh`; this one has a `shape`"));
                }
            }
            let (shape, size) = shape(source, raw, at)?;
            Ok((Geometry::Shape(shape), DMat3::from_diagonal(size)))
        }
        (None, Some(raw)) => {
            let normals = entry
                .normals
                .map_or(Ok(Normals::default()), |raw| normals(source, raw, at))?;
            let up = match entry.up.map(|raw| source.parse(raw)).transpose()? {
                Some(UpEntry::Y) => MeshUp::Y,
                Some(UpEntry::Z) => MeshUp::Z,
                None => MeshUp::default(),
            };
            let field = source.field(raw, format_args!("{at}.mesh"));
            let mesh = meshes.load(source, &field, normals)?;
            Ok((Geometry::Mesh(mesh), up.scene_from_file()))
        }
        (Some(_), Some(raw)) => Err(source
            .field(raw, format_args!("{at}.mesh"))
            .fail("is one too many: the object already has a `shape`")),
        (None, None) => {
            Err(source.error(whole, format_args!("`{at}` needs a `shape` or a `mesh`")))
        }
    }
}

/// Mesh files read so far.
#[derive(Default)]
struct Meshes(HashMap<(PathBuf, [u64; 2]), Arc<Mesh>>);

impl Meshes {
    /// The mesh of the file that `field` names, read once for each way to make normals.
    fn load(
        &mut self,
        source: &Source<'_>,
        field: &Field<'_>,
        normals: Normals,
    ) -> Result<Arc<Mesh>, SceneError> {
        let name = field.text()?;
        let path = source.folder.join(&name);
        let key = match normals {
            Normals::File => [0, 0],
            Normals::Flat => [1, 0],
            Normals::Smooth {
                crease_degrees,
                weight,
            } => [2 + weight as u64, crease_degrees.to_bits()],
        };
        match self.0.entry((path, key)) {
            Entry::Occupied(known) => Ok(known.get().clone()),
            Entry::Vacant(new) => {
                let mesh = load_mesh(&new.key().0, normals).map_err(|error| match error {
                    // The scene is what has to be changed.
                    SceneError::Io { source, path } => field.fail(format_args!(
                        "cannot be read from '{}': {}",
                        path.display(),
                        reason(&source)
                    )),
                    other => other,
                })?;
                Ok(new.insert(Arc::new(mesh)).clone())
            }
        }
    }
}

/// Where the normals of a mesh come from.
fn normals(source: &Source<'_>, raw: Raw<'_>, at: &str) -> Result<Normals, SceneError> {
    Ok(
        match source.parse_kind(raw, NormalsEntry::WITH_FIELDS, NormalsEntry::BARE)? {
            NormalsEntry::File => Normals::File,
            NormalsEntry::Flat => Normals::Flat,
            NormalsEntry::Smooth {
                crease_degrees,
                weight,
            } => Normals::Smooth {
                crease_degrees: crease_degrees.map_or(Ok(CREASE_DEGREES), |raw| {
                    source
                        .field(raw, format_args!("{at}.normals.crease_degrees"))
                        .up_to(180.0)
                })?,
                weight: match weight {
                    Some(WeightEntry::Equal) => Weight::Equal,
                    Some(WeightEntry::Area) => Weight::Area,
                    Some(WeightEntry::Angle) => Weight::Angle,
                    None => Weight::default(),
                },
            },
        },
    )
}

/// A shape, and the factors by which its mesh must be scaled to have the size asked for.
fn shape<'a>(source: &Source<'a>, raw: Raw<'a>, at: &str) -> Result<(Shape, DVec3), SceneError> {
    let field = |raw, name: &str| source.field(raw, format_args!("{at}.shape.{name}"));
    let count = |raw: Option<Raw<'a>>, name, min, default| {
        raw.map_or(Ok(default), |raw| field(raw, name).whole(min, MAX_SEGMENTS))
    };
    let length = |raw: Option<Raw<'a>>, name, default| {
        raw.map_or(Ok(default), |raw| field(raw, name).length())
    };
    Ok(match source.parse_kind(raw, ShapeEntry::KINDS, &[])? {
        ShapeEntry::Teapot {
            tessellation,
            bottom,
        } => (
            Shape::Teapot {
                tessellation: count(tessellation, "tessellation", 1, 8)?,
                bottom: bottom.map_or(Ok(false), |raw| field(raw, "bottom").flag())?,
            },
            DVec3::ONE,
        ),
        ShapeEntry::Sphere {
            radius,
            slices,
            stacks,
        } => (
            Shape::Sphere {
                slices: count(slices, "slices", 3, 32)?,
                stacks: count(stacks, "stacks", 2, 16)?,
            },
            DVec3::splat(length(radius, "radius", 1.0)?),
        ),
        ShapeEntry::Torus {
            major_radius,
            minor_radius,
            major_segments,
            minor_segments,
        } => {
            let major = length(major_radius, "major_radius", 1.0)?;
            let minor = length(minor_radius, "minor_radius", major * 0.4)?;
            if minor >= major {
                return Err(
                    field(minor_radius.unwrap_or(raw), "minor_radius").fail(format_args!(
                        "is {minor} and must be less than `major_radius`, which is {major}"
                    )),
                );
            }
            (
                Shape::Torus {
                    minor_radius: minor / major,
                    major_segments: count(major_segments, "major_segments", 3, 48)?,
                    minor_segments: count(minor_segments, "minor_segments", 3, 24)?,
                },
                DVec3::splat(major),
            )
        }
        ShapeEntry::Plane {
            width,
            depth,
            columns,
            rows,
        } => (
            Shape::Plane {
                columns: count(columns, "columns", 1, 1)?,
                rows: count(rows, "rows", 1, 1)?,
            },
            DVec3::new(
                length(width, "width", 1.0)?,
                length(depth, "depth", 1.0)?,
                1.0,
            ),
        ),
        ShapeEntry::Box { size } => (
            Shape::Cube,
            size.map_or(Ok(DVec3::ONE), |raw| field(raw, "size").lengths())?,
        ),
    })
}

/// Where an object is: given its `size`, scaled, turned about x, then y, then z, and moved.
fn place(
    source: &Source<'_>,
    entry: &ObjectEntry<'_>,
    size: DMat3,
    at: &str,
) -> Result<DMat4, SceneError> {
    let field = |raw, name: &str| source.field(raw, format_args!("{at}.{name}"));
    let position = entry
        .position
        .map_or(Ok(DVec3::ZERO), |raw| field(raw, "position").vector())?;
    let angles = entry
        .rotate_degrees
        .map_or(Ok(DVec3::ZERO), |raw| field(raw, "rotate_degrees").vector())?;
    let scale = entry
        .scale
        .map_or(Ok(DVec3::ONE), |raw| field(raw, "scale").scale())?;
    let linear = rotation(angles) * (DMat3::from_diagonal(scale) * size);
    Ok(DMat4::from_cols(
        linear.x_axis.extend(0.0),
        linear.y_axis.extend(0.0),
        linear.z_axis.extend(0.0),
        position.extend(1.0),
    ))
}

/// The rotation about the x axis, then the y axis, then the z axis, by angles in degrees.
fn rotation(degrees: DVec3) -> DMat3 {
    let [(sx, cx), (sy, cy), (sz, cz)] = degrees.to_array().map(sin_cos_degrees);
    let x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
    let y = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
    let z = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
    z * y * x
}
