//! The files that charts go to.

use super::chart;
use super::result::SceneResult;
use crate::cli::Failure;
use crate::cli::machine::Facts;
use specula::output::png::{check_writable, plain_reason};
use specula::output::save_whole;
use std::fs;
use std::path::{Path, PathBuf};

/// Charts of several scenes.
#[derive(Debug)]
pub(super) enum Charts {
    /// One chart, in this file.
    File(PathBuf),
    /// One for each scene, named after it, in this folder.
    Folder(PathBuf),
}

impl Charts {
    /// The charts of these scenes, under that name.
    pub(super) fn new(path: &Path, scenes: &[&str]) -> Result<Self, Failure> {
        let is_file = path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("svg"));
        if is_file && scenes.len() > 1 {
            return Err(Failure::input(format!(
                "one file cannot hold the charts of {} scenes: give --svg a folder instead of '{}'",
                scenes.len(),
                path.display()
            )));
        }
        if is_file {
            return Ok(Self::File(path.to_owned()));
        }
        let twice =
            (scenes.iter().enumerate()).find(|(index, name)| scenes[..*index].contains(name));
        if let Some((_, name)) = twice {
            return Err(Failure::input(format!(
                "two scenes are called '{name}', so that their charts would be one file"
            )));
        }
        Ok(Self::Folder(path.to_owned()))
    }

    /// Makes the folder, and finds out whether files can be written.
    pub(super) fn prepare(&self) -> Result<(), Failure> {
        if let Self::Folder(folder) = self {
            fs::create_dir_all(folder).map_err(|error| {
                Failure::runtime(format!(
                    "cannot make the folder {}: {}",
                    folder.display(),
                    plain_reason(&error)
                ))
            })?;
        }
        Ok(check_writable(self.file("chart"))?)
    }

    fn file(&self, scene: &str) -> PathBuf {
        match self {
            Self::File(path) => path.clone(),
            Self::Folder(folder) => folder.join(format!("{scene}.svg")),
        }
    }

    /// Draws and writes the chart of a scene.
    pub(super) fn save(
        &self,
        result: &SceneResult,
        facts: &Facts,
        repeats: u32,
    ) -> Result<(), Failure> {
        let svg = chart::draw(result, facts, repeats)
            .map_err(|error| Failure::runtime(format!("cannot draw a chart: {error}")))?;
        Ok(save_whole(self.file(&result.scene), svg)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_scenes_need_a_folder_and_different_names() {
        let charts = |path: &str, scenes: &[&str]| Charts::new(Path::new(path), scenes);
        let one = charts("a.SVG", &["x"]).expect("one scene");
        assert_eq!(one.file("x"), Path::new("a.SVG"));
        let two = charts("a", &["x", "y"]).expect("two names");
        assert_eq!(two.file("y"), Path::new("a/y.svg"));
        for (path, scenes) in [("a.svg", ["x", "y"]), ("a", ["x", "x"])] {
            let failure = charts(path, &scenes).expect_err(path);
            assert_eq!(failure.status(), 2);
        }
    }
}
