//! Files of learned costs: `bench --save-costs` writes one, `--costs` starts from it.

use super::Failure;
use ron::ser::{PrettyConfig, to_string_pretty};
use specula::output::save_whole;
use specula::schedule::{CostModel, Kind};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Longest file that is read: some hundred times what there is to say.
const MOST_BYTES: u64 = 1 << 18;

/// Reads costs.
pub(super) fn load(path: &Path) -> Result<CostModel, Failure> {
    let name = path.display();
    let bytes = read(path)
        .map_err(|error| Failure::runtime(format!("cannot read costs '{name}': {error}")))?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(Failure::input(format!(
            "{name}:1:1: these are no costs: more than {MOST_BYTES} bytes"
        )));
    }
    let costs: CostModel = ron::de::from_bytes(&bytes).map_err(|error| {
        let place = error.span.start;
        let (line, column, code) = (place.line, place.col, error.code);
        Failure::input(format!(
            "{name}:{line}:{column}: these are no costs: {code}"
        ))
    })?;
    match Kind::ALL
        .into_iter()
        .find(|&kind| !costs.rate(kind).is_valid())
    {
        None => Ok(costs),
        Some(kind) => {
            let kind = kind.name();
            let (line, column) = place_of(kind, &bytes);
            Err(Failure::input(format!(
                "{name}:{line}:{column}: the costs of '{kind}' make no sense: rates lie between 0.001 and 1000, and a spread \
                 between 0 and 1"
            )))
        }
    }
}

/// Writes costs, as a whole or not at all.
pub(super) fn save(path: &Path, costs: &CostModel) -> Result<(), Failure> {
    let text = to_string_pretty(costs, PrettyConfig::default())
        .map_err(|error| Failure::runtime(format!("cannot write costs: {error}")))?;
    Ok(save_whole(path, text + "\n")?)
}

/// The file's bytes, or one more than may be.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?
        .take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Line and column of a field, counted from 1.
fn place_of(field: &str, text: &[u8]) -> (usize, usize) {
    let lines = text.split(|&byte| byte == b'\n');
    (1..)
        .zip(lines)
        .find_map(|(number, line)| {
            let line = String::from_utf8_lossy(line);
            let at = line.find(&format!("{field}:"))?;
            Some((number, line[..at].chars().count() + 1))
        })
        .unwrap_or((1, 1))
}
