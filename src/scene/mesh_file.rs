//! Mesh files that a scene names, or that are opened directly.

use super::error::SceneError;
use super::file::read_text;
use super::limits::{MAX_LENGTH, MAX_MESH_BYTES, MAX_TRIANGLES};
use super::source::line_and_column;
use crate::geometry::Mesh;
use crate::geometry::import::{self, Normals, ObjLimits, obj};
use glam::DMat3;
use glam::DVec3;
use std::path::Path;

/// Which axis of a mesh file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeshUp {
    /// The y axis; the front is towards +z. The usual one.
    #[default]
    Y,
    /// The z axis, as in scenes.
    Z,
}

impl MeshUp {
    /// The turn from the file's axes to a scene's, whose z axis points up and whose front is towards -y.
    #[must_use]
    pub fn scene_from_file(self) -> DMat3 {
        match self {
            Self::Y => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
            Self::Z => DMat3::IDENTITY,
        }
    }
}

/// True when a file of that name is a mesh by itself.
pub(super) fn is_mesh(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("obj"))
}

/// Reads a mesh from a Wavefront OBJ file, in the file's own axes.
///
/// # Errors
/// When the file cannot be read ([`SceneError::is_io`]), or does not hold a valid mesh within the [limits](super::limits).
pub fn load_mesh(path: impl AsRef<Path>, normals: Normals) -> Result<Mesh, SceneError> {
    let path = path.as_ref();
    let text = read_text(path, MAX_MESH_BYTES)?;
    let limits = ObjLimits {
        max_length: MAX_LENGTH,
        max_triangles: MAX_TRIANGLES,
    };
    let polygons = obj::read(&text, &limits).map_err(|error| {
        let before = text.get(..error.offset).unwrap_or_default();
        let (line, column) = line_and_column(before.trim_start_matches('\u{feff}'));
        SceneError::Invalid {
            file: path.to_string_lossy().into_owned(),
            line,
            column,
            message: error.message,
        }
    })?;
    // The text may be as large as the mesh.
    drop(text);
    Ok(import::mesh(polygons, normals))
}
