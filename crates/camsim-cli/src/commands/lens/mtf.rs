//! `camsim lens CAMERA check --mtf`.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use camsim_core::{
    mtf::{CameraMtf, ChannelMtf, EdgePicture, camera_mtf, picture_mtf},
    scenario::CameraSpec,
    scene::linear_from_srgb,
};
use camsim_io::kernel_file::read_values;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// What is measured of the modulation transfer.
#[derive(Debug, clap::Args)]
pub(super) struct MtfArgs {
    /// Show the modulation transfer function too, by a slanted edge that is rendered through the camera (ISO
    /// 12233), beside the model's
    #[arg(long)]
    mtf: bool,
    /// Measure this picture of a slanted edge instead of the rendered one: EXR, or PNG or TIFF, encoded as
    /// sRGB
    #[arg(long, value_name = "PICTURE", requires = "mtf")]
    picture: Option<PathBuf>,
    /// Part of the picture with the edge [default: all]
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", requires = "picture", value_parser = parse_region)]
    region: Option<[usize; 4]>,
    /// The values of the PNG or TIFF are linear
    #[arg(long, requires = "picture")]
    linear: bool,
}

fn parse_region(text: &str) -> Result<[usize; 4], String> {
    let numbers: Vec<usize> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    <[usize; 4]>::try_from(numbers)
        .map_err(|_| "give X,Y,WIDTH,HEIGHT in whole pixels, such as 100,80,200,150".to_owned())
}

/// Measures what is asked for.
pub(super) fn measure(camera: &CameraSpec, args: &MtfArgs) -> Result<Option<CameraMtf>, Failure> {
    match &args.picture {
        _ if !args.mtf => Ok(None),
        None => camera_mtf(camera).map(Some).or_bad_input(),
        Some(path) => {
            let picture = read_edge(path, args).or_bad_input()?;
            let name = || path.display().to_string();
            picture_mtf(camera, &picture).map(Some).with_context(name).or_bad_input()
        }
    }
}

fn read_edge(path: &Path, args: &MtfArgs) -> anyhow::Result<EdgePicture> {
    let ([width, height], channels) = read_values(path)?;
    let is_linear = args.linear || path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr"));
    let [x, y, columns, rows] = args.region.unwrap_or([0, 0, width, height]);
    let fits = |first: usize, count: usize, of: usize| first.checked_add(count).is_some_and(|end| end <= of);
    if !fits(x, columns, width) || !fits(y, rows, height) {
        return Err(anyhow!(
            "{}: --region {x},{y},{columns},{rows} is not within its {width} x {height} pixels",
            path.display()
        ));
    }
    let of = |values: Vec<f64>| {
        let part = (y..y + rows).flat_map(|row| &values[row * width + x..][..columns]);
        part.map(|&value| if is_linear { value } else { linear_from_srgb(value as f32).into() }).collect()
    };
    Ok(EdgePicture { size: [columns, rows], channels: channels.map(of) })
}

/// Prints a table.
pub(super) fn print(mtf: &CameraMtf, console: &mut Console<'_>) -> Result<(), Failure> {
    let [width, height] = mtf.region_px;
    console.line("")?;
    console.line(format_args!(
        "modulation transfer across an edge {:.2} degrees off the pixels' axes, in {width} x {height} px",
        mtf.angle_deg
    ))?;
    let columns = |of: &dyn Fn(&ChannelMtf) -> [String; 2]| {
        let pairs = mtf.channels.iter().map(of).map(|[a, b]| format!(" | {a:>8} {b:>8}"));
        pairs.collect::<String>()
    };
    console
        .line(format_args!("cycles/px{}", columns(&|channel| [channel.channel.into(), "model".into()])))?;
    let count = mtf.channels.first().map_or(0, |channel| channel.curve.len());
    for i in (0..count).step_by(2) {
        let values = |channel: &ChannelMtf| {
            let point = &channel.curve[i];
            [point.measured, point.model].map(|value| format!("{value:.4}"))
        };
        let cycles_px = mtf.channels[0].curve[i].cycles_px;
        console.line(format_args!("{cycles_px:>9.3}{}", columns(&values)))?;
    }
    let half = |value: Option<f64>| value.map_or_else(|| "above 1".to_owned(), |value| format!("{value:.4}"));
    let halves = |channel: &ChannelMtf| [half(channel.mtf50_cycles_px), half(channel.model_mtf50_cycles_px)];
    console.line(format_args!("{:>9}{}", "half at", columns(&halves)))?;
    let largest = mtf.channels.iter().map(|channel| channel.largest_difference).fold(0.0, f64::max);
    console.line(format_args!("largest difference from the model  {largest:.4}"))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::parse_region;

    #[test]
    fn regions_have_four_whole_numbers() {
        assert_eq!(parse_region("1,2, 30,40"), Ok([1, 2, 30, 40]));
        for text in ["", "1,2,3", "1,2,3,4,5", "1,2,3,x", "-1,2,3,4"] {
            assert!(parse_region(text).is_err(), "{text}");
        }
    }
}
