//! Pixel to model coordinates: GeoTIFF tags and world files.

use std::path::{Path, PathBuf};

use super::TerrainFileError;

/// `model = origin + x column + y row`, where (x, y) are pixel coordinates with (0, 0) at the outer corner of
/// the top-left pixel: the centre of pixel (i, j) is (i + 0.5, j + 0.5). GeoTIFF calls this "pixel is area".
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Affine {
    /// Model coordinates of the outer corner of the top-left pixel.
    pub origin: [f64; 2],
    /// Model vector of one column.
    pub column: [f64; 2],
    /// Model vector of one row.
    pub row: [f64; 2],
}

impl Affine {
    /// Model coordinates of pixel coordinates.
    pub fn apply(&self, pixel: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k: usize| self.origin[k] + pixel[0] * self.column[k] + pixel[1] * self.row[k])
    }

    /// `None` if degenerate or not finite.
    pub fn inverse(&self) -> Option<Self> {
        let [a, d] = self.column;
        let [b, e] = self.row;
        let determinant = a * e - b * d;
        if !determinant.is_normal() || !self.origin.iter().all(|x| x.is_finite()) {
            return None;
        }
        let (column, row) = ([e / determinant, -d / determinant], [-b / determinant, a / determinant]);
        let [x, y] = self.origin;
        let origin = [0, 1].map(|k: usize| -(x * column[k] + y * row[k]));
        Some(Self { origin, column, row })
    }

    /// The georeference of the raster with its rows reversed.
    pub fn with_rows_reversed(&self, rows: f64) -> Self {
        Self { origin: self.apply([0.0, rows]), row: self.row.map(|x| -x), ..*self }
    }

    /// The georeference of the raster with its columns reversed.
    pub fn with_columns_reversed(&self, columns: f64) -> Self {
        Self { origin: self.apply([columns, 0.0]), column: self.column.map(|x| -x), ..*self }
    }

    /// The georeference from one whose integer pixel coordinates are pixel centres.
    pub fn with_centres_at_half(self) -> Self {
        Self { origin: self.apply([-0.5, -0.5]), ..self }
    }
}

/// Possible world files of a picture: for `.tif`, `.tfw`, `.tifw`, `.wld` and `.TFW`.
pub(super) fn world_file_names(path: &Path) -> Vec<PathBuf> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let letters: Vec<char> = extension.chars().collect();
    let mut extensions = Vec::new();
    if let (Some(first), Some(last)) = (letters.first(), letters.last()) {
        extensions.push(format!("{first}{last}w"));
        extensions.push(format!("{extension}w"));
    }
    extensions.push("wld".into());
    if let Some(first) = extensions.first().map(|e| e.to_uppercase()) {
        extensions.push(first);
    }
    extensions.into_iter().map(|extension| path.with_extension(extension)).collect()
}

/// Existing world files of a picture.
pub(crate) fn world_files(path: &Path) -> impl Iterator<Item = PathBuf> {
    world_file_names(path).into_iter().filter(|name| name.is_file())
}

/// The georeference of a picture's world file, if there is one. The file gives the centre of the top-left
/// pixel.
pub(super) fn world_file(path: &Path) -> Result<Option<Affine>, TerrainFileError> {
    let Some(path) = world_files(path).next() else { return Ok(None) };
    let error = |reason: String| TerrainFileError::WorldFile { path: path.clone(), reason };
    let text = std::fs::read_to_string(&path).map_err(|e| error(e.to_string()))?;
    let values = text
        .split_whitespace()
        .enumerate()
        .map(|(index, word)| {
            word.parse::<f64>().map_err(|_| error(format!("number {} is `{word}`", index + 1)))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let [a, d, b, e, c, f] = values[..] else { return Err(error(format!("{} numbers found", values.len()))) };
    Ok(Some(Affine { origin: [c, f], column: [a, d], row: [b, e] }.with_centres_at_half()))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn inverse_inverts_a_rotated_transformation() {
        let affine = Affine { origin: [600_000.0, 200_000.0], column: [1.5, 0.7], row: [0.6, -1.4] };
        let inverse = affine.inverse().unwrap();
        let back = inverse.apply(affine.apply([12.25, 345.5]));
        assert!((back[0] - 12.25).abs() < 1e-8 && (back[1] - 345.5).abs() < 1e-8, "{back:?}");
        assert_eq!(Affine { row: [3.0, 1.4], ..affine }.inverse(), None);
        assert_eq!(Affine { row: [f64::NAN, 1.4], ..affine }.inverse(), None);
    }

    #[test]
    fn world_files_give_the_centre_of_the_first_pixel() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("a.png");
        assert_eq!(world_file(&picture).unwrap(), None);
        std::fs::write(folder.path().join("a.pgw"), "2.0\n0\n0\n-2.0\r\n101.0\n199.0\n").unwrap();
        let affine = world_file(&picture).unwrap().unwrap();
        assert_eq!(affine.origin, [100.0, 200.0]);
        std::fs::write(folder.path().join("a.pgw"), "2.0 x").unwrap();
        assert!(world_file(&picture).unwrap_err().to_string().contains("number 2 is `x`"));
        std::fs::write(folder.path().join("a.pgw"), "2.0 1.0").unwrap();
        assert!(
            world_file(&picture).unwrap_err().to_string().contains("a.pgw: a world file has six numbers")
        );
    }
}
