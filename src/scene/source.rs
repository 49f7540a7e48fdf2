//! Values of a scene file that remember where they stand.
//!
//! RON reports positions of syntax errors only; a value that parses but makes no sense would have none. So the file
//! is read in layers: an entry first becomes its [`Raw`] text, a slice of the file, whose address inside the file is
//! its position; its fields are raw again, down to single numbers. Each value is then parsed and checked
//! under its name by [`Field`].

use super::Rgb;
use super::error::{Place, SceneError, describe};
use super::limits::{MAX_COLOR, MAX_LENGTH, MIN_LENGTH};
use glam::DVec3;
use ron::extensions::Extensions;
use ron::value::RawValue;
use serde::{Deserialize, Deserializer};
use std::fmt::Display;
use std::path::Path;

/// The text of one value in a scene file, as a slice of the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raw<'a>(&'a str);

impl<'de: 'a, 'a> Deserialize<'de> for Raw<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = <&RawValue>::deserialize(deserializer)?;
        Ok(Self(skip_comments(value.get_ron())))
    }
}

impl Raw<'_> {
    /// True when there is nothing but comments.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// `text` without leading white space and comments.
fn skip_comments(mut text: &str) -> &str {
    loop {
        text = text.trim_start();
        let after = if let Some(comment) = text.strip_prefix("//") {
            comment.split_once('\n').map(|(_, after)| after)
        } else if let Some(comment) = text.strip_prefix("/*") {
            after_block_comment(comment)
        } else {
            return text;
        };
        // A comment that does not end is all there is.
        text = after.unwrap_or_default();
    }
}

/// What follows a block comment whose opening is already read; they nest.
fn after_block_comment(mut text: &str) -> Option<&str> {
    let mut depth = 1_u32;
    while depth > 0 {
        let at = text.find(['/', '*'])?;
        (depth, text) = match text.get(at..at + 2) {
            Some("/*") => (depth + 1, &text[at + 2..]),
            Some("*/") => (depth - 1, &text[at + 2..]),
            _ => (depth, &text[at + 1..]),
        };
    }
    Some(text)
}

/// A scene file's text and name.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source<'a> {
    /// The whole text.
    pub(super) text: &'a str,
    /// The file's name, for messages.
    pub(super) file: &'a str,
    /// The folder that paths in the file start from.
    pub(super) folder: &'a Path,
}

impl<'a> Source<'a> {
    /// The whole file as one value.
    pub(super) fn whole(&self) -> Raw<'a> {
        Raw(skip_comments(self.text))
    }

    /// Parses a value, `raw` being this file or a part of it.
    pub(super) fn parse<T: Deserialize<'a>>(&self, raw: Raw<'a>) -> Result<T, SceneError> {
        let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
        options.from_str(raw.0).map_err(|error| {
            let (mut message, place) = describe(&error.code);
            if error.code == ron::Error::TrailingCharacters && raw.0.len() < self.whole().0.len() {
                "nothing may follow this value".clone_into(&mut message);
            }
            let inner = match place {
                Place::Start => error.span.start,
                Place::End => error.span.end,
            };
            // A position inside the part, moved to where the part starts in the file.
            let (line, column) = self.position(raw);
            let column = if inner.line == 1 {
                column + inner.col - 1
            } else {
                inner.col
            };
            self.invalid((line + inner.line - 1, column), message)
        })
    }

    /// Parses a value of one of several kinds, each a name with its fields in parentheses, or a name alone. What is easily
    /// left out, the name or the parentheses, is asked for by name.
    pub(super) fn parse_kind<T: Deserialize<'a>>(
        &self,
        raw: Raw<'a>,
        with_fields: &[&str],
        bare: &[&str],
    ) -> Result<T, SceneError> {
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        if raw.0.starts_with(|c| !is_name(c) || c.is_numeric()) {
            let kinds = with_fields.iter().map(|kind| format!("`{kind}(..)`"));
            let kinds: Vec<_> = kinds
                .chain(bare.iter().map(|kind| format!("`{kind}`")))
                .collect();
            let message = format!("the kind is missing here: one of {}", kinds.join(", "));
            return Err(self.error(raw, message));
        }
        let name = raw.0.trim_end();
        if with_fields.contains(&name) {
            let message = format!(
                "`{name}` needs parentheses, also where all fields are left out: `{name}()`"
            );
            return Err(self.error(raw, message));
        }
        self.parse(raw)
    }

    /// An error at the start of `raw`.
    pub(super) fn error(&self, raw: Raw<'a>, message: impl Display) -> SceneError {
        self.invalid(self.position(raw), message)
    }

    /// The value of `raw` under the name that messages give it.
    pub(super) fn field(&self, raw: Raw<'a>, name: impl Display) -> Field<'a> {
        Field {
            source: *self,
            raw,
            name: name.to_string(),
        }
    }

    fn invalid(&self, (line, column): (usize, usize), message: impl Display) -> SceneError {
        SceneError::Invalid {
            file: self.file.to_owned(),
            line,
            column,
            message: message.to_string(),
        }
    }

    /// Line and column of the start of `raw`, counted from 1, in characters.
    fn position(&self, raw: Raw<'a>) -> (usize, usize) {
        let offset = (raw.0.as_ptr() as usize).wrapping_sub(self.text.as_ptr() as usize);
        let before = self.text.get(..offset).unwrap_or_default();
        line_and_column(before)
    }
}

/// Line and column, counted from 1, of what follows `before`.
pub(super) fn line_and_column(before: &str) -> (usize, usize) {
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    let line = 1 + before.bytes().filter(|&b| b == b'\n').count();
    (line, 1 + before[line_start..].chars().count())
}

/// A named value of a scene file, yet to be parsed and checked.
#[derive(Clone, Debug)]
pub(super) struct Field<'a> {
    source: Source<'a>,
    raw: Raw<'a>,
    name: String,
}

impl<'a> Field<'a> {
    /// An error about this value: "`name` what".
    pub(super) fn fail(&self, what: impl Display) -> SceneError {
        self.source
            .error(self.raw, format_args!("`{}` {what}", self.name))
    }

    /// Any finite number up to [`MAX_LENGTH`] in magnitude.
    pub(super) fn number(&self) -> Result<f64, SceneError> {
        let value: f64 = self
            .source
            .parse(self.raw)
            .map_err(|_| self.fail(format_args!("must be a number, not {}", self.excerpt())))?;
        if !value.is_finite() {
            return Err(self.fail(format_args!(
                "must be a finite number, not {}",
                self.excerpt()
            )));
        }
        if value.abs() > MAX_LENGTH {
            return Err(self.fail(format_args!(
                "must be at most {MAX_LENGTH:e} in magnitude, not {}",
                self.excerpt()
            )));
        }
        Ok(value)
    }

    /// A number in `0..=max`.
    pub(super) fn up_to(&self, max: f64) -> Result<f64, SceneError> {
        let value = self.number()?;
        if value < 0.0 {
            return Err(self.fail(format_args!(
                "must not be negative, but is {}",
                self.excerpt()
            )));
        }
        if value > max {
            return Err(self.fail(format_args!(
                "must be at most {max}, but is {}",
                self.excerpt()
            )));
        }
        Ok(value)
    }

    /// A length that is more than nothing.
    pub(super) fn length(&self) -> Result<f64, SceneError> {
        let value = self.number()?;
        if value < MIN_LENGTH {
            return Err(self.fail(format_args!("must be above 0, but is {}", self.excerpt())));
        }
        Ok(value)
    }

    /// A whole number in `min..=max`.
    pub(super) fn whole(&self, min: u32, max: u32) -> Result<u32, SceneError> {
        let value: Option<u32> = self.source.parse(self.raw).ok();
        value.filter(|v| (min..=max).contains(v)).ok_or_else(|| {
            self.fail(format_args!(
                "must be a whole number from {min} to {max}, not {}",
                self.excerpt()
            ))
        })
    }

    /// `true` or `false`.
    pub(super) fn flag(&self) -> Result<bool, SceneError> {
        self.source.parse(self.raw).map_err(|_| {
            self.fail(format_args!(
                "must be true or false, not {}",
                self.excerpt()
            ))
        })
    }

    /// A string.
    pub(super) fn text(&self) -> Result<String, SceneError> {
        self.source.parse(self.raw).map_err(|_| {
            self.fail(format_args!(
                "must be a string in quotes, not {}",
                self.excerpt()
            ))
        })
    }

    /// Three values in parentheses, each a field of its own.
    fn parts(&self, expected: &str) -> Result<[Self; 3], SceneError> {
        let parts: (Raw<'a>, Raw<'a>, Raw<'a>) = self
            .source
            .parse(self.raw)
            .map_err(|_| self.fail(format_args!("must be {expected}, not {}", self.excerpt())))?;
        let part = |raw| Self {
            source: self.source,
            raw,
            name: self.name.clone(),
        };
        Ok([part(parts.0), part(parts.1), part(parts.2)])
    }

    /// Three numbers, a point or angles.
    pub(super) fn vector(&self) -> Result<DVec3, SceneError> {
        let [x, y, z] = self.parts("three numbers (x, y, z)")?;
        Ok(DVec3::new(x.number()?, y.number()?, z.number()?))
    }

    /// Three numbers that are not all zero.
    pub(super) fn direction(&self) -> Result<DVec3, SceneError> {
        let vector = self.vector()?;
        if vector.abs().max_element() < MIN_LENGTH {
            return Err(self.fail("must not be the zero vector"));
        }
        Ok(vector)
    }

    /// Three lengths, each more than nothing.
    pub(super) fn lengths(&self) -> Result<DVec3, SceneError> {
        let [x, y, z] = self.parts("three numbers (x, y, z)")?;
        Ok(DVec3::new(x.length()?, y.length()?, z.length()?))
    }

    /// One scale factor for all axes, or three; negative ones mirror, none is zero.
    pub(super) fn scale(&self) -> Result<DVec3, SceneError> {
        let factor = |part: &Self| {
            let value = part.number()?;
            if value.abs() < MIN_LENGTH {
                return Err(part.fail("must not be zero, which would flatten the object"));
            }
            Ok(value)
        };
        if self.raw.0.starts_with('(') {
            let [x, y, z] = self.parts("a number or three numbers (x, y, z)")?;
            Ok(DVec3::new(factor(&x)?, factor(&y)?, factor(&z)?))
        } else {
            Ok(DVec3::splat(factor(self)?))
        }
    }

    /// A colour: linear `(r, g, b)`, one number for grey, or `"#rrggbb"` in sRGB.
    pub(super) fn color(&self) -> Result<Rgb, SceneError> {
        if self.raw.0.starts_with('(') {
            let [r, g, b] = self.parts("three numbers (r, g, b)")?;
            return Ok([
                r.up_to(MAX_COLOR)?,
                g.up_to(MAX_COLOR)?,
                b.up_to(MAX_COLOR)?,
            ]);
        }
        if self.raw.0.starts_with(['"', 'r']) {
            return parse_hex(&self.text()?).ok_or_else(|| {
                self.fail(format_args!(
                    "must be a colour such as \"#ff8800\", not {}",
                    self.excerpt()
                ))
            });
        }
        if self
            .raw
            .0
            .starts_with(|c: char| c.is_ascii_digit() || "+-.iN".contains(c))
        {
            return Ok([self.up_to(MAX_COLOR)?; 3]);
        }
        Err(self.fail(format_args!(
            "must be a colour, (r, g, b), \"#rrggbb\" or a grey number, not {}",
            self.excerpt()
        )))
    }

    /// The value as written, shortened to fit a message.
    pub(super) fn excerpt(&self) -> String {
        const MOST: usize = 40;
        let line = self.raw.0.lines().next().unwrap_or_default().trim_end();
        let mut short: String = line.chars().take(MOST).collect();
        if short.len() < self.raw.0.trim_end().len() {
            short.push_str("...");
        }
        short
    }
}

/// `#rrggbb` in sRGB to linear light (IEC 61966-2-1).
fn parse_hex(text: &str) -> Option<Rgb> {
    let digits = text.strip_prefix('#')?;
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let code = u32::from_str_radix(digits, 16).ok()?;
    let linear = |shift: u32| {
        let encoded = f64::from(code >> shift & 0xff) / 255.0;
        if encoded <= 0.04045 {
            encoded / 12.92
        } else {
            libm::pow((encoded + 0.055) / 1.055, 2.4)
        }
    };
    Some([linear(16), linear(8), linear(0)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_colours_are_decoded_from_srgb() {
        assert_eq!(parse_hex("#000000"), Some([0.0; 3]));
        assert_eq!(parse_hex("#ffffff"), Some([1.0; 3]));
        let [r, g, b] = parse_hex("#bc0080").expect("a colour");
        assert!((r - 0.502_886).abs() < 1e-5 && g == 0.0 && (b - 0.215_861).abs() < 1e-5);
        for bad in ["ffffff", "#fffff", "#gggggg", "#+fffff", "#ffffé"] {
            assert_eq!(parse_hex(bad), None, "{bad}");
        }
    }

    #[test]
    fn comments_before_a_value_are_skipped() {
        for text in [
            "7",
            " // seven\n 7",
            "/* a /* nested */ one */ 7",
            "\n//x\n/**/ 7",
        ] {
            assert_eq!(skip_comments(text), "7");
        }
    }

    #[test]
    fn positions_count_characters_from_one() {
        assert_eq!(line_and_column(""), (1, 1));
        assert_eq!(line_and_column("é\nää"), (2, 3));
    }
}
