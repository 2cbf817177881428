//! The files of a terrain: one, a list, a folder, or all whose names fit a pattern with `*` and `?`.

use std::path::{Path, PathBuf};

use camsim_core::scenario::FileList;

use super::TerrainFileError;
use crate::shell::quoted;

/// Endings of files of heights, for folders and patterns.
const DEM_ENDINGS: [&str; 4] = ["tif", "tiff", "hgt", "asc"];
/// Endings of pictures, for folders and patterns.
const PICTURE_ENDINGS: [&str; 6] = ["tif", "tiff", "png", "jpg", "jpeg", "webp"];

/// Largest number of tiles.
const MAX_TILES: usize = 4096;

/// Number of tiles that a command names.
const IN_COMMAND: usize = 8;

/// The files of `scene.terrain.dem`.
pub(crate) fn dem_files(list: &FileList) -> Result<Vec<PathBuf>, TerrainFileError> {
    files(list, "scene.terrain.dem", &DEM_ENDINGS)
}

/// The files of `scene.terrain.ortho`.
pub(crate) fn ortho_files(list: &FileList) -> Result<Vec<PathBuf>, TerrainFileError> {
    files(list, "scene.terrain.ortho", &PICTURE_ENDINGS)
}

/// All files of a terrain that can be found, for their fingerprints.
pub(crate) fn terrain_files(dem: &FileList, ortho: Option<&FileList>) -> Vec<PathBuf> {
    let lists = [(Some(dem), &DEM_ENDINGS[..]), (ortho, &PICTURE_ENDINGS[..])];
    let found = lists.into_iter().filter_map(|(list, endings)| Some((list?, endings)));
    found
        .flat_map(|(list, endings)| files(list, "", endings).unwrap_or_else(|_| list.paths().to_vec()))
        .collect()
}

fn files(list: &FileList, key: &'static str, endings: &[&str]) -> Result<Vec<PathBuf>, TerrainFileError> {
    let mut files = Vec::new();
    for path in list.paths() {
        if path.is_dir() {
            files.extend(found(path, key, endings, folder_files(path), "is a folder without")?);
        } else if !path.exists() && has_wildcard(path) {
            files.extend(found(path, key, endings, matching(path), "no file fits it, with the ending")?);
        } else {
            files.push(path.clone());
        }
    }
    let mut known = std::collections::HashSet::new();
    files.retain(|file| known.insert(file.clone()));
    if files.len() > MAX_TILES {
        let problem =
            format!("names {} files, more than {MAX_TILES}: give those under the flight alone", files.len());
        return Err(TerrainFileError::Meaning { path: key.into(), problem });
    }
    Ok(files)
}

/// The files with one of the endings, in order. Sidecar files are skipped by this.
fn found(
    path: &Path,
    key: &'static str,
    endings: &[&str],
    mut files: Vec<PathBuf>,
    problem: &str,
) -> Result<Vec<PathBuf>, TerrainFileError> {
    let has_ending = |file: &PathBuf| {
        file.extension().is_some_and(|own| endings.iter().any(|ending| own.eq_ignore_ascii_case(ending)))
    };
    files.retain(has_ending);
    files.sort();
    if files.is_empty() {
        let endings = endings.iter().map(|ending| format!(".{ending}")).collect::<Vec<_>>().join(", ");
        let problem = format!("{problem} {endings}; check {key}");
        return Err(TerrainFileError::Meaning { path: path.into(), problem });
    }
    Ok(files)
}

fn folder_files(folder: &Path) -> Vec<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = folder.read_dir().into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).filter(|path| path.is_file()).collect()
}

fn has_wildcard(path: &Path) -> bool {
    path.to_string_lossy().contains(['*', '?'])
}

/// The files that a path with `*` and `?` in any of its parts leads to.
fn matching(pattern: &Path) -> Vec<PathBuf> {
    let mut found = vec![PathBuf::new()];
    for part in pattern.components() {
        let text = part.as_os_str().to_string_lossy().into_owned();
        if !text.contains(['*', '?']) {
            found.iter_mut().for_each(|path| path.push(part));
            continue;
        }
        let text: Vec<char> = text.chars().collect();
        let fits = |name: &str| fits(&text, &name.chars().collect::<Vec<_>>());
        let below = |folder: &PathBuf| {
            let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { folder.as_path() };
            let entries = listed.read_dir().into_iter().flatten().flatten();
            let names = entries.map(|entry| entry.file_name());
            let fitting = names.filter(|name| fits(&name.to_string_lossy()));
            fitting.map(|name| folder.join(name)).collect::<Vec<_>>()
        };
        found = found.iter().flat_map(below).collect();
    }
    found.retain(|path| path.is_file());
    found
}

/// Whether a name fits a pattern: `*` is any text, `?` any letter.
fn fits(pattern: &[char], name: &[char]) -> bool {
    match (pattern.split_first(), name.split_first()) {
        (None, None) => true,
        (Some(('*', rest)), _) => (0..=name.len()).any(|skipped| fits(rest, &name[skipped..])),
        (Some((wanted, rest)), Some((letter, name))) if *wanted == '?' || wanted == letter => {
            fits(rest, name)
        }
        _ => false,
    }
}

/// The name of a file, or of its tiles in words, for messages.
pub(super) fn label(paths: &[PathBuf]) -> PathBuf {
    match paths {
        [] => PathBuf::new(),
        [only] => only.clone(),
        [first, others @ ..] => {
            let s = if others.len() == 1 { "" } else { "s" };
            format!("{} and {} more file{s}", first.display(), others.len()).into()
        }
    }
}

/// Paths as words of a command.
pub(super) fn command_paths(paths: &[&Path]) -> String {
    let mut words: Vec<String> = paths.iter().take(IN_COMMAND).map(quoted).collect();
    words.extend((paths.len() > IN_COMMAND).then(|| "...".to_owned()));
    words.join(" ")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn folders_and_patterns_lead_to_rasters_without_their_sidecar_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(path("a/deep")).unwrap();
        for name in ["b.tif", "a.TIF", "a.tfw", "a.TIF.aux.xml", "a.prj", "readme.txt", "a/deep/n.hgt"] {
            std::fs::write(path(name), "").unwrap();
        }
        let names = |pattern: &str| -> Vec<String> {
            let files = dem_files(&path(pattern).into()).unwrap_or_default();
            files.iter().map(|file| file.strip_prefix(folder.path()).unwrap().display().to_string()).collect()
        };
        assert_eq!(names(""), ["a.TIF", "b.tif"]);
        assert_eq!(names("*"), ["a.TIF", "b.tif"]);
        assert_eq!(names("*.tif"), ["b.tif"]);
        assert_eq!(names("?.*"), ["a.TIF", "b.tif"]);
        assert_eq!(names("*/deep/*.hgt"), ["a/deep/n.hgt"]);
        assert_eq!(names("none*.tif"), [""; 0]);
        // The same file twice is one tile.
        let twice = FileList::from(vec![path("b.tif"), path("*.tif")]);
        assert_eq!(dem_files(&twice).unwrap().len(), 1);
        let error = dem_files(&path("a").into()).unwrap_err().to_string();
        assert!(error.contains("is a folder without .tif, .tiff, .hgt, .asc"), "{error}");
    }
}
