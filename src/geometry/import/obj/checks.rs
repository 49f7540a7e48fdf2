//! What is checked of the statements of an OBJ file before the library reads them.

use super::{ObjError, ObjLimits};
use crate::geometry::polygon::MAX_CORNERS;
use std::fmt::Display;

/// How many of something there are, and the largest index by which a face refers to it, with the place of that.
#[derive(Debug, Default)]
struct Counted<'a> {
    count: u64,
    highest: u64,
    highest_at: &'a str,
}

/// Looks at statements.
pub(super) struct Checks<'a> {
    text: &'a str,
    limits: ObjLimits,
    vertices: Counted<'a>,
    normals: Counted<'a>,
    triangles: u64,
    /// For each corner so far whether it has a normal.
    pub(super) has_normal: Vec<bool>,
}

impl<'a> Checks<'a> {
    pub(super) fn new(text: &'a str, limits: ObjLimits) -> Self {
        Self {
            text,
            limits,
            vertices: Counted::default(),
            normals: Counted::default(),
            triangles: 0,
            has_normal: Vec::new(),
        }
    }

    /// An error at `word`, a part of the text.
    fn error(&self, word: &str, message: impl Display) -> ObjError {
        ObjError {
            offset: (word.as_ptr() as usize).saturating_sub(self.text.as_ptr() as usize),
            message: message.to_string(),
        }
    }

    /// Checks a statement, and writes what the library needs of it to `line`, if anything.
    pub(super) fn pass(&mut self, statement: &'a str, line: &mut String) -> Result<(), ObjError> {
        // A backslash is the one that continues a line.
        let is_space = |c: char| c.is_ascii_whitespace() || c == '\\';
        let mut words = statement.split(is_space).filter(|word| !word.is_empty());
        match words.next() {
            Some(keyword @ "v") => self.vertex(keyword, words, line),
            Some(keyword @ "vn") => self.normal(keyword, words, line),
            Some(keyword @ "f") => self.face(keyword, words, line),
            _ => Ok(()),
        }
    }

    /// `v x y z`, `v x y z w`, or with more numbers, which then are a colour.
    fn vertex(
        &mut self,
        keyword: &str,
        mut words: impl Iterator<Item = &'a str>,
        line: &mut String,
    ) -> Result<(), ObjError> {
        let most = self.limits.max_length;
        let mut largest = 0.0_f64;
        line.push('v');
        for k in 0..3 {
            let word = words.next().ok_or_else(|| {
                self.error(
                    keyword,
                    format_args!("`v` needs three coordinates, but has {k}"),
                )
            })?;
            let value = self.number("a coordinate", word)?.abs();
            if value > most {
                let message = format_args!(
                    "a coordinate must be at most {most:e} in magnitude, not {}",
                    excerpt(word)
                );
                return Err(self.error(word, message));
            }
            largest = largest.max(value);
            push_word(line, word);
        }
        if let (Some(word), None) = (words.next(), words.next()) {
            let divisor = self.number("the weight of a vertex", word)?.abs();
            if divisor == 0.0 {
                return Err(self.error(word, "the weight of a vertex must not be zero"));
            }
            if largest / divisor > most {
                let message = format_args!(
                    "divided by this weight, a coordinate exceeds {most:e} in magnitude"
                );
                return Err(self.error(word, message));
            }
            push_word(line, word);
        }
        line.push('\n');
        self.vertices.count += 1;
        Ok(())
    }

    /// `vn x y z`, of any length. Numbers that are not finite are let through: such a normal counts as missing.
    fn normal(
        &mut self,
        keyword: &str,
        mut words: impl Iterator<Item = &'a str>,
        line: &mut String,
    ) -> Result<(), ObjError> {
        line.push_str("vn");
        for k in 0..3 {
            let word = words.next().ok_or_else(|| {
                self.error(
                    keyword,
                    format_args!("`vn` needs three numbers, but has {k}"),
                )
            })?;
            if word.parse::<f64>().is_err() {
                return Err(self.error(word, must_be_a_number("a normal's component", word)));
            }
            push_word(line, word);
        }
        line.push('\n');
        self.normals.count += 1;
        Ok(())
    }

    /// `f` and three corners or more.
    fn face(
        &mut self,
        keyword: &str,
        words: impl Iterator<Item = &'a str>,
        line: &mut String,
    ) -> Result<(), ObjError> {
        line.push('f');
        let mut corners = 0;
        for word in words {
            self.corner(word, line)?;
            corners += 1;
            if corners > MAX_CORNERS {
                return Err(self.error(
                    keyword,
                    format_args!("a face has more than {MAX_CORNERS} corners"),
                ));
            }
        }
        line.push('\n');
        if corners < 3 {
            return Err(self.error(
                keyword,
                format_args!("a face needs at least three corners, but has {corners}"),
            ));
        }
        self.triangles += corners as u64 - 2;
        if self.triangles > self.limits.max_triangles {
            return Err(self.error(
                keyword,
                format_args!(
                    "the mesh has more than {} triangles, which is the most possible",
                    self.limits.max_triangles
                ),
            ));
        }
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, word: &'a str, line: &mut String) -> Result<(), ObjError> {
        let mut indices = [None; 3];
        let mut parts = word.split('/');
        for index in &mut indices {
            *index = match parts.next() {
                None | Some("") => None,
                Some(part) => Some((part, part.parse::<i64>().map_err(|_| self.malformed(word))?)),
            };
        }
        let (Some((part, vertex)), None) = (indices[0], parts.next()) else {
            return Err(self.malformed(word));
        };
        self.vertices
            .refer(word, vertex, "vertex")
            .map_err(|message| self.error(word, message))?;
        push_word(line, part);
        if let Some((part, normal)) = indices[2] {
            self.normals
                .refer(word, normal, "normal")
                .map_err(|message| self.error(word, message))?;
            line.push_str("//");
            line.push_str(part);
        }
        self.has_normal.push(indices[2].is_some());
        Ok(())
    }

    fn malformed(&self, word: &str) -> ObjError {
        self.error(
            word,
            format_args!(
                "a corner of a face must be `v`, `v/vt`, `v//vn` or `v/vt/vn` with whole numbers, not {}",
                excerpt(word)
            ),
        )
    }

    /// A finite number.
    fn number(&self, what: &str, word: &str) -> Result<f64, ObjError> {
        let value: f64 = word
            .parse()
            .map_err(|_| self.error(word, must_be_a_number(what, word)))?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.error(
                word,
                format!("{what} must be a finite number, not {}", excerpt(word)),
            ))
        }
    }

    /// What can be said only at the end.
    pub(super) fn finish(&self) -> Result<(), ObjError> {
        for (counted, name) in [(&self.vertices, "vertex"), (&self.normals, "normal")] {
            if counted.highest > counted.count {
                return Err(self.error(
                    counted.highest_at,
                    format_args!(
                        "there is no {name} {}; the file has only {}",
                        counted.highest, counted.count
                    ),
                ));
            }
        }
        if self.triangles == 0 {
            return Err(self.error(
                self.text,
                "there are no faces here; in an OBJ file they are lines such as `f 1 2 3`",
            ));
        }
        Ok(())
    }
}

impl<'a> Counted<'a> {
    /// Notes that a face refers to number `index`, which counts from 1, or back from the last one so far.
    fn refer(&mut self, word: &'a str, index: i64, name: &str) -> Result<(), String> {
        let magnitude = index.unsigned_abs();
        if index == 0 {
            return Err(format!("there is no {name} 0; they are counted from 1"));
        }
        if index < 0 && magnitude > self.count {
            return Err(format!(
                "there is no {name} {index}; up to here the file has only {}",
                self.count
            ));
        }
        if index > 0 && magnitude > self.highest {
            self.highest = magnitude;
            self.highest_at = word;
        }
        Ok(())
    }
}

fn push_word(line: &mut String, word: &str) {
    line.push(' ');
    line.push_str(word);
}

fn must_be_a_number(what: &str, word: &str) -> String {
    format!("{what} must be a number, not {}", excerpt(word))
}

/// A word of the file, shortened to fit a message, without characters that would upset a terminal.
fn excerpt(word: &str) -> String {
    const MOST: usize = 40;
    let mut short: String = word
        .chars()
        .take(MOST)
        .flat_map(char::escape_debug)
        .collect();
    if word.chars().nth(MOST).is_some() {
        short.push_str("...");
    }
    short
}
