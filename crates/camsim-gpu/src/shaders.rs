//! WGSL composition: `#import path` includes a file once; `#import <slot:name>` is filled by the pipeline
//! key.
//!
//! About a hundred lines of plain text joining keep every file readable by WGSL tools, need no build step,
//! and leave naga's version alone; naga_oil's module system would rename every symbol for no gain at this
//! size. `CAMSIM_SHADER_DIR` reads the files from a folder instead of the embedded copies, for development.

use std::borrow::Cow;

macro_rules! embedded {
    ($($path:literal),* $(,)?) => {
        /// Every shader file: path below `shaders/`, text.
        pub const FILES: &[(&str, &str)] = &[$(($path, include_str!(concat!("../../../shaders/", $path)))),*];
    };
}

embedded![
    "common/dispatch.wgsl",
    "common/frame.wgsl",
    "common/noise.wgsl",
    "ideal/borders.wgsl",
    "ideal/camera.wgsl",
    "ideal/covered/samples.wgsl",
    "ideal/covered/whole.wgsl",
    "ideal/fine.wgsl",
    "ideal/fog/none.wgsl",
    "ideal/fog/some.wgsl",
    "ideal/holes.wgsl",
    "ideal/light.wgsl",
    "ideal/lines.wgsl",
    "ideal/marked_tiles.wgsl",
    "ideal/marks.wgsl",
    "ideal/mesh.wgsl",
    "ideal/mesh_color/mixed.wgsl",
    "ideal/mesh_color/whole.wgsl",
    "ideal/mesh_holes.wgsl",
    "ideal/mesh_holes_lit.wgsl",
    "ideal/mesh_lit.wgsl",
    "ideal/mesh_surface.wgsl",
    "ideal/near_marks.wgsl",
    "ideal/picture/mixed.wgsl",
    "ideal/picture/tiles.wgsl",
    "ideal/picture/whole.wgsl",
    "ideal/reach.wgsl",
    "ideal/reads/four.wgsl",
    "ideal/reads/grid.wgsl",
    "ideal/reads/one.wgsl",
    "ideal/reads/two.wgsl",
    "ideal/samples.wgsl",
    "ideal/spread/none.wgsl",
    "ideal/spread/samples.wgsl",
    "ideal/stamp.wgsl",
    "ideal/surface.wgsl",
    "ideal/terrain.wgsl",
    "ideal/terrain_vertex.wgsl",
    "reverse/color/linear.wgsl",
    "reverse/color/stored.wgsl",
    "reverse/depth/bilinear.wgsl",
    "reverse/depth/nearest.wgsl",
    "reverse/edges/candidates.wgsl",
    "reverse/edges/color/centres.wgsl",
    "reverse/edges/color/samples.wgsl",
    "reverse/edges/list.wgsl",
    "reverse/edges/listed.wgsl",
    "reverse/edges/near.wgsl",
    "reverse/edges/none.wgsl",
    "reverse/edges/seen.wgsl",
    "reverse/edges/supersampled.wgsl",
    "reverse/emit/color.wgsl",
    "reverse/emit/truth.wgsl",
    "reverse/gather/blur.wgsl",
    "reverse/gather/footprint.wgsl",
    "reverse/gather/interface.wgsl",
    "reverse/gather/nodes/each.wgsl",
    "reverse/gather/nodes/ends.wgsl",
    "reverse/gather/nodes/mid.wgsl",
    "reverse/gather/nodes/solved.wgsl",
    "reverse/gather/nodes/three.wgsl",
    "reverse/gather/path/parabola.wgsl",
    "reverse/gather/path/quartic.wgsl",
    "reverse/gather/path/straight.wgsl",
    "reverse/gather/sharp.wgsl",
    "reverse/gather/straight.wgsl",
    "reverse/gather/stretches/one.wgsl",
    "reverse/gather/stretches/several.wgsl",
    "reverse/gather/stretches/two.wgsl",
    "reverse/gather/tap/area.wgsl",
    "reverse/gather/tap/bilinear.wgsl",
    "reverse/gather/tap/cells.wgsl",
    "reverse/gather/tap/grid.wgsl",
    "reverse/gather/tap/single.wgsl",
    "reverse/gather/tap/spline.wgsl",
    "reverse/gather/tap/spline_or_grid.wgsl",
    "reverse/ideal_frame.wgsl",
    "reverse/keys/elsewhere.wgsl",
    "reverse/keys/one.wgsl",
    "reverse/keys/several.wgsl",
    "reverse/keys/single.wgsl",
    "reverse/lens_inverse/brown_conrady.wgsl",
    "reverse/lens_inverse/kannala_brandt.wgsl",
    "reverse/lens_inverse/lens.wgsl",
    "reverse/lens_inverse/main.wgsl",
    "reverse/lens_inverse/pinhole.wgsl",
    "reverse/lens_inverse/start_cold.wgsl",
    "reverse/lens_inverse/start_warm.wgsl",
    "reverse/lens_inverse/table.wgsl",
    "reverse/line/held.wgsl",
    "reverse/line/read.wgsl",
    "reverse/photometric.wgsl",
    "reverse/pixels/one.wgsl",
    "reverse/pixels/several.wgsl",
    "reverse/ray/gauss_newton.wgsl",
    "reverse/ray/interface.wgsl",
    "reverse/ray/map.wgsl",
    "reverse/ray/pinhole.wgsl",
    "reverse/rays.wgsl",
    "reverse/reverse.wgsl",
    "reverse/temporal_inverse/constant_depth.wgsl",
    "reverse/temporal_inverse/identity.wgsl",
    "reverse/temporal_inverse/interface.wgsl",
    "reverse/temporal_inverse/line_entry.wgsl",
    "reverse/temporal_inverse/linear.wgsl",
    "reverse/temporal_inverse/looks/one.wgsl",
    "reverse/temporal_inverse/looks/several.wgsl",
    "reverse/temporal_inverse/looks/two.wgsl",
    "reverse/temporal_inverse/pose_table.wgsl",
    "reverse/temporal_inverse/reproject.wgsl",
    "reverse/temporal_inverse/rk2.wgsl",
    "reverse/temporal_inverse/rotation.wgsl",
];

/// A slot's name and the file that fills it.
pub type Slot = (&'static str, &'static str);

/// Errors of composition: faults of the shader files, not of any input.
#[derive(Debug, thiserror::Error)]
pub enum ComposeError {
    /// No such file.
    #[error("shader file `{0}` does not exist")]
    Missing(String),
    /// A slot that the key does not fill.
    #[error("slot `{slot}` of `{file}` is not filled")]
    Unfilled {
        /// Slot name.
        slot: String,
        /// Importing file.
        file: String,
    },
}

/// The whole WGSL text of `file` with its imports, each once, in order of first need.
///
/// # Errors
/// A missing file or an unfilled slot.
pub fn compose(file: &str, slots: &[Slot]) -> Result<String, ComposeError> {
    let mut seen = Vec::new();
    let mut text = String::new();
    append(file, slots, &mut seen, &mut text)?;
    Ok(text)
}

fn append(file: &str, slots: &[Slot], seen: &mut Vec<String>, text: &mut String) -> Result<(), ComposeError> {
    if seen.iter().any(|name| name == file) {
        return Ok(());
    }
    seen.push(file.to_owned());
    let source = read(file)?;
    let mut body = format!("// from {file}\n");
    for line in source.lines() {
        let Some(import) = line.strip_prefix("#import ") else {
            body.push_str(line);
            body.push('\n');
            continue;
        };
        let target = match import.trim().strip_prefix("<slot:").and_then(|rest| rest.strip_suffix('>')) {
            None => import.trim(),
            Some(slot) => slots
                .iter()
                .find_map(|(name, filling)| (*name == slot).then_some(*filling))
                .ok_or_else(|| ComposeError::Unfilled { slot: slot.to_owned(), file: file.to_owned() })?,
        };
        append(target, slots, seen, text)?;
    }
    text.push_str(&body);
    Ok(())
}

fn read(file: &str) -> Result<Cow<'static, str>, ComposeError> {
    if let Some(folder) = std::env::var_os("CAMSIM_SHADER_DIR") {
        return std::fs::read_to_string(std::path::Path::new(&folder).join(file))
            .map(Cow::Owned)
            .map_err(|_| ComposeError::Missing(file.to_owned()));
    }
    FILES
        .iter()
        .find_map(|(name, text)| (*name == file).then_some(Cow::Borrowed(*text)))
        .ok_or_else(|| ComposeError::Missing(file.to_owned()))
}

/// A shader module from a composed file.
///
/// # Errors
/// As [`compose`]. WGSL faults surface as validation errors of the device; a test validates every variant
/// beforehand.
pub fn module(
    device: &wgpu::Device,
    label: &str,
    file: &str,
    slots: &[Slot],
) -> Result<wgpu::ShaderModule, ComposeError> {
    let source = compose(file, slots)?;
    Ok(device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    }))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::path::{Path, PathBuf};

    use super::*;

    fn files_below(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { files_below(&path, found) } else { found.push(path) }
        }
    }

    #[test]
    fn the_embedded_table_is_the_folder() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders");
        let mut found = Vec::new();
        files_below(&root, &mut found);
        let mut names: Vec<String> = found
            .iter()
            .map(|p| p.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/"))
            .collect();
        names.sort();
        assert_eq!(names, FILES.iter().map(|(name, _)| (*name).to_owned()).collect::<Vec<_>>());
    }

    #[test]
    fn faults_are_named() {
        assert!(matches!(compose("no/such.wgsl", &[]), Err(ComposeError::Missing(_))));
        assert!(
            matches!(compose("reverse/reverse.wgsl", &[]), Err(ComposeError::Unfilled { slot, .. }) if slot == "keys")
        );
    }
}
