//! WGSL composition: `#import path` includes a file once; `#import <slot:name>` is filled by the pipeline
//! key.
//!
//! A hundred lines of plain text substitution keep every file readable by WGSL tools, need no build step, and
//! are independent of naga's version. naga_oil's module system would rename every symbol for no gain at this
//! size. If `CAMSIM_SHADER_DIR` is set, the files are read from that folder instead of the embedded copies,
//! for development.

use std::borrow::Cow;

use crate::adapter::GpuError;

macro_rules! embedded {
    ($($path:literal),* $(,)?) => {
        /// All shader files: path below `shaders/`, text.
        pub const FILES: &[(&str, &str)] = &[$(($path, include_str!(concat!("../shaders/", $path)))),*];
    };
}

embedded![
    "common/dispatch.wgsl",
    "common/frame.wgsl",
    "common/noise.wgsl",
    "ideal/alpha_mask.wgsl",
    "ideal/camera.wgsl",
    "ideal/centroid/covered_samples.wgsl",
    "ideal/centroid/pixel_centre.wgsl",
    "ideal/dilate_tiles.wgsl",
    "ideal/edge_lines.wgsl",
    "ideal/edge_mask.wgsl",
    "ideal/edge_mask_to_alpha.wgsl",
    "ideal/edge_tiles.wgsl",
    "ideal/find_edge_lines.wgsl",
    "ideal/fog/exponential.wgsl",
    "ideal/fog/none.wgsl",
    "ideal/light.wgsl",
    "ideal/mesh.wgsl",
    "ideal/mesh_color/blended.wgsl",
    "ideal/mesh_color/opaque.wgsl",
    "ideal/mesh_lit.wgsl",
    "ideal/mesh_masked.wgsl",
    "ideal/mesh_masked_lit.wgsl",
    "ideal/mesh_surface.wgsl",
    "ideal/prefilter/four.wgsl",
    "ideal/prefilter/grid.wgsl",
    "ideal/prefilter/one.wgsl",
    "ideal/prefilter/two.wgsl",
    "ideal/resolve_depth.wgsl",
    "ideal/sample_count.wgsl",
    "ideal/surface.wgsl",
    "ideal/terrain.wgsl",
    "ideal/terrain_vertex.wgsl",
    "ideal/texture/opaque.wgsl",
    "ideal/texture/tiled.wgsl",
    "ideal/texture/with_alpha.wgsl",
    "ideal/thin_surfaces/none.wgsl",
    "ideal/thin_surfaces/samples.wgsl",
    "ideal/triangles_near_edges.wgsl",
    "reverse/color/linear.wgsl",
    "reverse/color/srgb.wgsl",
    "reverse/depth/bilinear.wgsl",
    "reverse/depth/nearest.wgsl",
    "reverse/edges/candidates.wgsl",
    "reverse/edges/color/centres.wgsl",
    "reverse/edges/color/samples.wgsl",
    "reverse/edges/list_candidates.wgsl",
    "reverse/edges/near_silhouette.wgsl",
    "reverse/edges/none.wgsl",
    "reverse/edges/pixel_list.wgsl",
    "reverse/edges/rays.wgsl",
    "reverse/edges/silhouette_rays.wgsl",
    "reverse/edges/truth.wgsl",
    "reverse/emit/color.wgsl",
    "reverse/emit/truth.wgsl",
    "reverse/gather/blur.wgsl",
    "reverse/gather/footprint.wgsl",
    "reverse/gather/interface.wgsl",
    "reverse/gather/no_blur.wgsl",
    "reverse/gather/nodes/each.wgsl",
    "reverse/gather/nodes/ends.wgsl",
    "reverse/gather/nodes/independent.wgsl",
    "reverse/gather/nodes/mid.wgsl",
    "reverse/gather/nodes/three.wgsl",
    "reverse/gather/path/parabola.wgsl",
    "reverse/gather/path/quartic.wgsl",
    "reverse/gather/path/straight.wgsl",
    "reverse/gather/segments/one.wgsl",
    "reverse/gather/segments/several.wgsl",
    "reverse/gather/segments/two.wgsl",
    "reverse/gather/straight.wgsl",
    "reverse/gather/tap/area.wgsl",
    "reverse/gather/tap/bilinear.wgsl",
    "reverse/gather/tap/cells.wgsl",
    "reverse/gather/tap/grid.wgsl",
    "reverse/gather/tap/single.wgsl",
    "reverse/gather/tap/spline.wgsl",
    "reverse/gather/tap/spline_or_grid.wgsl",
    "reverse/ideal_frame.wgsl",
    "reverse/keys/mid_window.wgsl",
    "reverse/keys/one.wgsl",
    "reverse/keys/other_instant.wgsl",
    "reverse/keys/several.wgsl",
    "reverse/lens_inverse/brown_conrady.wgsl",
    "reverse/lens_inverse/kannala_brandt.wgsl",
    "reverse/lens_inverse/lens.wgsl",
    "reverse/lens_inverse/main.wgsl",
    "reverse/lens_inverse/pinhole.wgsl",
    "reverse/lens_inverse/start_cold.wgsl",
    "reverse/lens_inverse/start_warm.wgsl",
    "reverse/lens_inverse/table.wgsl",
    "reverse/line_poses/cached.wgsl",
    "reverse/line_poses/uncached.wgsl",
    "reverse/photometric.wgsl",
    "reverse/pixels/one.wgsl",
    "reverse/pixels/several.wgsl",
    "reverse/ray/gauss_newton.wgsl",
    "reverse/ray/interface.wgsl",
    "reverse/ray/lens_map.wgsl",
    "reverse/ray/pinhole.wgsl",
    "reverse/reverse.wgsl",
    "reverse/temporal_inverse/constant_depth.wgsl",
    "reverse/temporal_inverse/identity.wgsl",
    "reverse/temporal_inverse/interface.wgsl",
    "reverse/temporal_inverse/line_entry.wgsl",
    "reverse/temporal_inverse/linear.wgsl",
    "reverse/temporal_inverse/look_ups/one.wgsl",
    "reverse/temporal_inverse/look_ups/several.wgsl",
    "reverse/temporal_inverse/look_ups/two.wgsl",
    "reverse/temporal_inverse/pose_table.wgsl",
    "reverse/temporal_inverse/reproject.wgsl",
    "reverse/temporal_inverse/rk2.wgsl",
    "reverse/temporal_inverse/rotation.wgsl",
];

/// Name of a slot, and the file that fills it.
pub type ShaderSlot = (&'static str, &'static str);

/// Errors of composition. They are inconsistencies of the shader files, not of any input.
#[derive(Debug, thiserror::Error)]
pub enum ComposeError {
    /// A file does not exist.
    #[error("shader file `{0}` does not exist")]
    Missing(String),
    /// The pipeline key does not fill a slot.
    #[error("slot `{slot}` of `{file}` is not filled")]
    Unfilled {
        /// Name of the slot.
        slot: String,
        /// File that imports the slot.
        file: String,
    },
}

impl From<ComposeError> for GpuError {
    fn from(error: ComposeError) -> Self {
        Self::Shader(Box::new(error))
    }
}

/// WGSL text of `file` with its imports, each once, in order of first use.
///
/// # Errors
/// A missing file or an unfilled slot.
pub fn compose(file: &str, slots: &[ShaderSlot]) -> Result<String, ComposeError> {
    let mut included = Vec::new();
    let mut text = String::new();
    append(file, slots, &mut included, &mut text)?;
    Ok(text)
}

fn append(
    file: &str,
    slots: &[ShaderSlot],
    included: &mut Vec<String>,
    text: &mut String,
) -> Result<(), ComposeError> {
    if included.iter().any(|name| name == file) {
        return Ok(());
    }
    included.push(file.to_owned());
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
        append(target, slots, included, text)?;
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

/// Shader module of a composed file.
///
/// # Errors
/// As [`compose`]. WGSL faults surface as validation errors of the device; a test validates every variant
/// beforehand.
pub fn module(
    device: &wgpu::Device,
    label: &str,
    file: &str,
    slots: &[ShaderSlot],
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

    fn files_below(folder: &Path, paths: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { files_below(&path, paths) } else { paths.push(path) }
        }
    }

    #[test]
    fn embedded_table_lists_every_shader_file() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        let mut paths = Vec::new();
        files_below(&root, &mut paths);
        let mut names: Vec<String> = paths
            .iter()
            .map(|p| p.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/"))
            .collect();
        names.sort();
        assert_eq!(names, FILES.iter().map(|(name, _)| (*name).to_owned()).collect::<Vec<_>>());
    }

    #[test]
    fn missing_files_and_unfilled_slots_are_named() {
        assert!(matches!(compose("no/such.wgsl", &[]), Err(ComposeError::Missing(_))));
        let unfilled = compose("reverse/reverse.wgsl", &[]);
        assert!(matches!(unfilled, Err(ComposeError::Unfilled { slot, .. }) if slot == "keys"));
    }
}
