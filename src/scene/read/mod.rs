//! From the entries of a scene file to a [`Scene`], everything checked on the way.

use super::error::SceneError;
use super::limits::{MAX_COLOR, MAX_LIGHTS, MAX_MATERIALS, MAX_SHININESS};
use super::source::{Raw, Source};
use super::syntax::{LightEntry, MaterialEntry, ModelEntry, Named, SceneEntry};
use super::{
    Camera, Extent, Light, LightKind, Material, ReflectionModel, Revisions, Rgb, Scene, defaults,
    places,
};
use animation::Motions;
use std::collections::HashMap;
use std::fmt::Display;

mod animation;
mod camera;
mod objects;

/// Reads a whole scene.
pub(super) fn scene(source: &Source<'_>) -> Result<Scene, SceneError> {
    let whole = source.whole();
    if whole.is_empty() {
        return Err(source.error(
            whole,
            "there is no scene here; the smallest is `(objects: [(shape: Teapot())])`",
        ));
    }
    let entry: SceneEntry<'_> = source.parse(whole)?;
    let mut materials = Materials::read(source, &entry.materials)?;
    let mut motions = Motions::default();
    let objects = objects::objects(source, entry.objects, &mut materials, &mut motions)?;
    let extent = Extent::of(&objects);
    let mut scene = Scene {
        camera: match entry.camera {
            Some(raw) => camera::camera(source, raw, &extent)?,
            None => Camera::fitted(&extent),
        },
        background: color(source, entry.background, "background", defaults::BACKGROUND)?,
        ambient: color(source, entry.ambient, "ambient", defaults::AMBIENT)?,
        lights: match entry.lights {
            Some(entries) => lights(source, &entries, &mut motions)?,
            None => defaults::lights(&extent),
        },
        materials: materials.list,
        rest: places(&objects),
        objects,
        animation: None,
        revisions: Revisions::fresh(),
    };
    scene.animation = animation::animation(source, entry.animation, &motions, &scene, &extent)?;
    Ok(scene)
}

/// An optional colour.
fn color(
    source: &Source<'_>,
    raw: Option<Raw<'_>>,
    name: impl Display,
    default: Rgb,
) -> Result<Rgb, SceneError> {
    raw.map_or(Ok(default), |raw| source.field(raw, name).color())
}

/// The materials, their names, and the default material once somebody needs it.
struct Materials {
    list: Vec<Material>,
    by_name: HashMap<String, usize>,
    default: Option<usize>,
}

impl Materials {
    fn read(source: &Source<'_>, entries: &Named<'_>) -> Result<Self, SceneError> {
        let mut materials = Self {
            list: Vec::new(),
            by_name: HashMap::new(),
            default: None,
        };
        for &(key, raw) in &entries.0 {
            let key = source.field(key, "materials");
            let name = key.text()?;
            // One place is kept for the default material.
            if materials.list.len() + 1 >= MAX_MATERIALS {
                return Err(key.fail(format_args!("has more than {} entries", MAX_MATERIALS - 1)));
            }
            let index = materials.list.len();
            materials.list.push(material(source, raw, &name)?);
            if materials.by_name.insert(name.clone(), index).is_some() {
                return Err(key.fail(format_args!("defines {name:?} twice")));
            }
        }
        Ok(materials)
    }

    /// Index of the material that an object names.
    fn find(
        &mut self,
        source: &Source<'_>,
        raw: Option<Raw<'_>>,
        name: impl Display,
    ) -> Result<usize, SceneError> {
        let Some(raw) = raw else {
            return Ok(*self.default.get_or_insert_with(|| {
                self.list.push(defaults::MATERIAL);
                self.list.len() - 1
            }));
        };
        let field = source.field(raw, name);
        let wanted = field.text()?;
        self.by_name.get(&wanted).copied().ok_or_else(|| {
            field.fail(format_args!(
                "is {wanted:?}, which `materials` does not define{}",
                self.known_names()
            ))
        })
    }

    /// "; it defines "a", "b"", or nothing to say.
    fn known_names(&self) -> String {
        const MOST: usize = 6;
        let mut names: Vec<_> = self.by_name.iter().map(|(name, &i)| (i, name)).collect();
        names.sort_unstable();
        let quoted: Vec<_> = names
            .iter()
            .take(MOST)
            .map(|(_, name)| format!("{name:?}"))
            .collect();
        match names.len() {
            0 => String::new(),
            n if n > MOST => format!("; it defines {} and {} more", quoted.join(", "), n - MOST),
            _ => format!("; it defines {}", quoted.join(", ")),
        }
    }
}

fn material(source: &Source<'_>, raw: Raw<'_>, name: &str) -> Result<Material, SceneError> {
    let entry: MaterialEntry<'_> = source.parse(raw)?;
    let at = format!("materials[{name:?}]");
    let default = defaults::MATERIAL;
    Ok(Material {
        ambient: color(
            source,
            entry.ambient,
            format_args!("{at}.ambient"),
            default.ambient,
        )?,
        diffuse: color(
            source,
            entry.diffuse,
            format_args!("{at}.diffuse"),
            default.diffuse,
        )?,
        specular: color(
            source,
            entry.specular,
            format_args!("{at}.specular"),
            default.specular,
        )?,
        shininess: entry.shininess.map_or(Ok(default.shininess), |raw| {
            source
                .field(raw, format_args!("{at}.shininess"))
                .up_to(MAX_SHININESS)
        })?,
        model: match entry.model {
            Some(ModelEntry::Phong) => ReflectionModel::Phong,
            Some(ModelEntry::BlinnPhong) => ReflectionModel::BlinnPhong,
            None => default.model,
        },
        two_sided: entry.two_sided.map_or(Ok(default.two_sided), |raw| {
            source.field(raw, format_args!("{at}.two_sided")).flag()
        })?,
    })
}

fn lights<'a>(
    source: &Source<'a>,
    entries: &[Raw<'a>],
    motions: &mut Motions<'a>,
) -> Result<Vec<Light>, SceneError> {
    if let Some(&one_too_many) = entries.get(MAX_LIGHTS) {
        return Err(source.error(
            one_too_many,
            format_args!(
                "`lights` has {} entries; at most {MAX_LIGHTS} are possible",
                entries.len()
            ),
        ));
    }
    entries
        .iter()
        .enumerate()
        .map(|(index, &raw)| light(source, raw, index, motions))
        .collect()
}

fn light<'a>(
    source: &Source<'a>,
    raw: Raw<'a>,
    index: usize,
    motions: &mut Motions<'a>,
) -> Result<Light, SceneError> {
    let field = |raw, name: &str| source.field(raw, format_args!("lights[{index}].{name}"));
    let (kind, tint, intensity, orbit) = match source.parse_kind(raw, LightEntry::KINDS, &[])? {
        LightEntry::Point {
            position,
            color,
            intensity,
            orbit,
        } => {
            let position = field(position, "position").vector()?;
            (LightKind::Point { position }, color, intensity, orbit)
        }
        LightEntry::Directional {
            direction,
            color,
            intensity,
            orbit,
        } => {
            let direction = field(direction, "direction").direction()?;
            (
                LightKind::Directional { direction },
                color,
                intensity,
                orbit,
            )
        }
    };
    motions.lights.extend(orbit.map(|raw| (index, raw)));
    let tint = tint.map_or(Ok([1.0; 3]), |raw| field(raw, "color").color())?;
    let intensity = intensity.map_or(Ok(1.0), |raw| field(raw, "intensity").up_to(MAX_COLOR))?;
    Ok(Light {
        kind,
        radiance: tint.map(|c| c * intensity),
    })
}
