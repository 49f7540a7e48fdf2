//! Wavefront OBJ files, read by the `tobj` library.
//!
//! `tobj` gets only the statements that matter here, `v`, `vn` and `f`, one by one, each looked at before: the library does not
//! say in which line a fault is, and takes some things that make no sense. What is looked at: counts of words, that
//! numbers are numbers in range, that indices exist, and how large the mesh becomes, before memory is taken for it.
//! Lines that a `\` continues and comments behind statements are resolved on the way.
//!
//! All groups and objects of a file make one mesh. Left out are texture coordinates, vertex colours, materials, smoothing groups,
//! points, lines and free-form surfaces.

mod checks;

use crate::geometry::polygon::Polygons;
use checks::Checks;
use glam::DVec3;
use std::io::{self, BufRead, Read};

/// What a file may contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjLimits {
    /// Largest magnitude of a coordinate.
    pub max_length: f64,
    /// Most triangles.
    pub max_triangles: u64,
}

/// What is wrong with a file, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ObjError {
    /// Byte position in the text.
    pub offset: usize,
    /// One sentence without a full stop.
    pub message: String,
}

/// Reads the text of an OBJ file. There is at least one polygon, all indices are in range, and all coordinates within the limits.
///
/// # Errors
/// When a statement is not understood or refers to what does not exist, when there are no faces, or too many.
pub fn read(text: &str, limits: &ObjLimits) -> Result<Polygons, ObjError> {
    let mut feed = Feed::new(text, limits);
    let options = tobj::LoadOptions::default();
    let loaded = tobj::load_obj_buf(&mut feed, &options, |_| Ok(Default::default()));
    if let Some(error) = feed.error {
        return Err(error);
    }
    let (models, _) = loaded.map_err(|error| ObjError {
        offset: feed.statement_start,
        message: format!("this statement cannot be read: {error}"),
    })?;
    // Without groups there is one model.
    let mesh = models.into_iter().next().map(|model| model.mesh);
    Ok(polygons(&mesh.unwrap_or_default(), &feed.checks.has_normal))
}

/// What the library found. `has_normal` says for each corner whether the file gives it a normal: the library makes up others.
fn polygons(mesh: &tobj::Mesh, has_normal: &[bool]) -> Polygons {
    let vectors = |numbers: &[f64]| -> Vec<DVec3> {
        let (triples, _) = numbers.as_chunks::<3>();
        triples.iter().map(|&v| DVec3::from_array(v)).collect()
    };
    let given = vectors(&mesh.normals);
    let normals = mesh
        .normal_indices
        .iter()
        .zip(has_normal)
        .map(|(&index, &has)| {
            if has {
                given[index as usize]
            } else {
                DVec3::ZERO
            }
        })
        .collect();
    let ends = if mesh.face_arities.is_empty() {
        (3..=mesh.indices.len() as u32).step_by(3).collect()
    } else {
        let add = |end: &mut u32, &arity: &u32| {
            *end += arity;
            Some(*end)
        };
        mesh.face_arities.iter().scan(0, add).collect()
    };
    Polygons {
        positions: vectors(&mesh.positions),
        corners: mesh.indices.clone(),
        ends,
        normals,
    }
}

/// Hands one checked statement after the other to the library, as a file with one in each line.
struct Feed<'a> {
    text: &'a str,
    /// Where in the text the next statement begins.
    at: usize,
    /// Where the one at hand began.
    statement_start: usize,
    /// The statement at hand, and how much of it has been read.
    line: String,
    read: usize,
    checks: Checks<'a>,
    error: Option<ObjError>,
}

impl<'a> Feed<'a> {
    fn new(text: &'a str, limits: &ObjLimits) -> Self {
        Self {
            text,
            // A byte order mark would hide the first statement.
            at: if text.starts_with('\u{feff}') {
                '\u{feff}'.len_utf8()
            } else {
                0
            },
            statement_start: 0,
            line: String::new(),
            read: 0,
            checks: Checks::new(text, *limits),
            error: None,
        }
    }

    /// The next statement without its comment, with the lines that continue it; `None` at the end.
    fn statement(&mut self) -> Option<&'a str> {
        let start = self.at;
        self.statement_start = start;
        if start >= self.text.len() {
            return None;
        }
        loop {
            let rest = &self.text[self.at..];
            let (line, next) = rest
                .find('\n')
                .map_or((rest, rest.len()), |end| (&rest[..end], end + 1));
            let code = line.find('#').map_or(line, |hash| &line[..hash]);
            let end = self.at + code.len();
            self.at += next;
            let continues = code.len() == line.len() && line.trim_end().ends_with('\\');
            if !continues || self.at >= self.text.len() {
                return Some(&self.text[start..end]);
            }
        }
    }
}

impl BufRead for Feed<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.read == self.line.len() {
            self.line.clear();
            self.read = 0;
            // At the end the library looks up all indices, so they have to be checked before it sees that end.
            while self.line.is_empty() {
                let statement = self.statement();
                let checked = match statement {
                    Some(statement) => self.checks.pass(statement, &mut self.line),
                    None => self.checks.finish(),
                };
                if let Err(error) = checked {
                    self.error = Some(error);
                    return Err(io::ErrorKind::InvalidData.into());
                }
                if statement.is_none() {
                    break;
                }
            }
        }
        Ok(&self.line.as_bytes()[self.read..])
    }

    fn consume(&mut self, amount: usize) {
        self.read += amount;
    }
}

impl Read for Feed<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}
