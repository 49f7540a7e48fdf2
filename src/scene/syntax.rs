//! The shape of a scene file: which entries have which fields. Values stay [`Raw`]; [`read`](super::read) checks them.

use super::source::Raw;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use std::fmt;

/// The whole file.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields, rename = "Scene", bound(deserialize = "'de: 'a"))]
pub(super) struct SceneEntry<'a> {
    pub(super) camera: Option<Raw<'a>>,
    pub(super) background: Option<Raw<'a>>,
    pub(super) ambient: Option<Raw<'a>>,
    pub(super) lights: Option<Vec<Raw<'a>>>,
    #[serde(default)]
    pub(super) materials: Named<'a>,
    pub(super) objects: Option<Raw<'a>>,
    pub(super) animation: Option<Raw<'a>>,
}

/// Values by name, in the file's order, which a hash map would lose.
#[derive(Debug, Default)]
pub(super) struct Named<'a>(pub(super) Vec<(Raw<'a>, Raw<'a>)>);

impl<'de: 'a, 'a> Deserialize<'de> for Named<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = Vec<(Raw<'de>, Raw<'de>)>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map from names to materials")
            }

            fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Self::Value, M::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(entries)
            }
        }
        deserializer.deserialize_map(Entries).map(Self)
    }
}

/// `camera:`
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields, rename = "Camera", bound(deserialize = "'de: 'a"))]
pub(super) enum CameraEntry<'a> {
    Perspective {
        position: Option<Raw<'a>>,
        target: Option<Raw<'a>>,
        up: Option<Raw<'a>>,
        near: Option<Raw<'a>>,
        far: Option<Raw<'a>>,
        fov_degrees: Option<Raw<'a>>,
    },
    Orthographic {
        position: Option<Raw<'a>>,
        target: Option<Raw<'a>>,
        up: Option<Raw<'a>>,
        near: Option<Raw<'a>>,
        far: Option<Raw<'a>>,
        height: Option<Raw<'a>>,
    },
}

impl CameraEntry<'_> {
    pub(super) const KINDS: &'static [&'static str] = &["Perspective", "Orthographic"];
}

/// One of `lights:`
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields, rename = "Light", bound(deserialize = "'de: 'a"))]
pub(super) enum LightEntry<'a> {
    Point {
        position: Raw<'a>,
        color: Option<Raw<'a>>,
        intensity: Option<Raw<'a>>,
        orbit: Option<Raw<'a>>,
    },
    Directional {
        direction: Raw<'a>,
        color: Option<Raw<'a>>,
        intensity: Option<Raw<'a>>,
        orbit: Option<Raw<'a>>,
    },
}

impl LightEntry<'_> {
    pub(super) const KINDS: &'static [&'static str] = &["Point", "Directional"];
}

/// One of `materials:`
#[derive(Debug, serde::Deserialize)]
#[serde(
    deny_unknown_fields,
    rename = "Material",
    bound(deserialize = "'de: 'a")
)]
pub(super) struct MaterialEntry<'a> {
    pub(super) diffuse: Option<Raw<'a>>,
    pub(super) specular: Option<Raw<'a>>,
    pub(super) ambient: Option<Raw<'a>>,
    pub(super) shininess: Option<Raw<'a>>,
    pub(super) model: Option<ModelEntry>,
    pub(super) two_sided: Option<Raw<'a>>,
}

/// `model:` of a material.
#[derive(Clone, Copy, Debug, serde::Deserialize)]
#[serde(rename = "Model")]
pub(super) enum ModelEntry {
    Phong,
    BlinnPhong,
}

/// One of `objects:`
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields, rename = "Object", bound(deserialize = "'de: 'a"))]
pub(super) struct ObjectEntry<'a> {
    pub(super) shape: Option<Raw<'a>>,
    pub(super) mesh: Option<Raw<'a>>,
    pub(super) normals: Option<Raw<'a>>,
    pub(super) up: Option<Raw<'a>>,
    pub(super) material: Option<Raw<'a>>,
    pub(super) position: Option<Raw<'a>>,
    pub(super) rotate_degrees: Option<Raw<'a>>,
    pub(super) scale: Option<Raw<'a>>,
    pub(super) spin: Option<Raw<'a>>,
}

/// `animation:`
#[derive(Debug, serde::Deserialize)]
#[serde(
    deny_unknown_fields,
    rename = "Animation",
    bound(deserialize = "'de: 'a")
)]
pub(super) struct AnimationEntry<'a> {
    pub(super) duration: Option<Raw<'a>>,
    pub(super) fps: Option<Raw<'a>>,
    pub(super) orbit: Option<Raw<'a>>,
}

/// `orbit:` and `spin:`
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields, rename = "Turn", bound(deserialize = "'de: 'a"))]
pub(super) struct TurnEntry<'a> {
    pub(super) degrees_per_second: Option<Raw<'a>>,
    pub(super) axis: Option<Raw<'a>>,
    pub(super) center: Option<Raw<'a>>,
}

/// `normals:` of an object.
#[derive(Debug, serde::Deserialize)]
#[serde(
    deny_unknown_fields,
    rename = "Normals",
    bound(deserialize = "'de: 'a")
)]
pub(super) enum NormalsEntry<'a> {
    File,
    Smooth {
        crease_degrees: Option<Raw<'a>>,
        weight: Option<WeightEntry>,
    },
    Flat,
}

impl NormalsEntry<'_> {
    pub(super) const WITH_FIELDS: &'static [&'static str] = &["Smooth"];
    pub(super) const BARE: &'static [&'static str] = &["File", "Flat"];
}

/// `weight:` of smooth normals.
#[derive(Clone, Copy, Debug, serde::Deserialize)]
#[serde(rename = "Weight")]
pub(super) enum WeightEntry {
    Equal,
    Area,
    Angle,
}

/// `up:` of an object.
#[derive(Clone, Copy, Debug, serde::Deserialize)]
#[serde(rename = "Up")]
pub(super) enum UpEntry {
    Y,
    Z,
}

/// `shape:` of an object.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields, rename = "Shape", bound(deserialize = "'de: 'a"))]
pub(super) enum ShapeEntry<'a> {
    Teapot {
        tessellation: Option<Raw<'a>>,
        bottom: Option<Raw<'a>>,
    },
    Sphere {
        radius: Option<Raw<'a>>,
        slices: Option<Raw<'a>>,
        stacks: Option<Raw<'a>>,
    },
    Torus {
        major_radius: Option<Raw<'a>>,
        minor_radius: Option<Raw<'a>>,
        major_segments: Option<Raw<'a>>,
        minor_segments: Option<Raw<'a>>,
    },
    Plane {
        width: Option<Raw<'a>>,
        depth: Option<Raw<'a>>,
        columns: Option<Raw<'a>>,
        rows: Option<Raw<'a>>,
    },
    Box {
        size: Option<Raw<'a>>,
    },
}

impl ShapeEntry<'_> {
    pub(super) const KINDS: &'static [&'static str] =
        &["Teapot", "Sphere", "Torus", "Plane", "Box"];
}
