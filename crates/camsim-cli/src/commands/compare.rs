//! `camsim compare`.

use std::path::PathBuf;

use camsim_io::compare::{Figures, compare_paths};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// Compare two images, or two folders of images
///
/// Values are compared as stored, with the code range scaled to 0..1: EXR with EXR (linear), PNG with PNG
/// (encoded). In folders, images of the same name are compared.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: camsim compare out/color other/color --json")]
pub struct CompareArgs {
    /// First image or folder
    a: PathBuf,
    /// Second image or folder
    b: PathBuf,
    /// Print JSON: rmse, max, psnr_db (null for equal images), ssim, differing, and of folders each format and file
    #[arg(long)]
    json: bool,
}

/// Prints the differences.
pub fn run(args: &CompareArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let report = compare_paths(&args.a, &args.b).or_bad_input()?;
    if args.json {
        return Ok(console.json(&report)?);
    }
    for (only, folder) in [(&report.only_in_a, &args.a), (&report.only_in_b, &args.b)] {
        if !only.is_empty() {
            console.warn(format_args!("{} images are only in {}", only.len(), folder.display()));
        }
    }
    console.line(format_args!(
        "{:>11} {:>11} {:>9} {:>8} {:>11}",
        "RMSE", "max", "PSNR dB", "SSIM", "differing"
    ))?;
    for file in &report.files {
        console.line(format_args!("{} {}", row(&file.figures), file.file))?;
    }
    for of in &report.formats {
        console.line(format_args!("{} all {} {} images", row(&of.figures), of.files, of.format))?;
    }
    if report.formats.is_empty() {
        console.line(row(&report.total))?;
    }
    if report.total.non_finite > 0 {
        console.warn(format_args!(
            "{} pixels contain NaN or infinity: the figures leave out those that are alike, and are NaN if any \
             is not",
            report.total.non_finite
        ));
    }
    Ok(())
}

fn row(figures: &Figures) -> String {
    let Figures { rmse, max, psnr_db, ssim, differing, .. } = figures;
    let without_psnr = if rmse.is_nan() { "NaN" } else { "inf" };
    let psnr = psnr_db.map_or(without_psnr.to_owned(), |psnr| format!("{psnr:.2}"));
    let ssim = ssim.map_or("-".to_owned(), |ssim| format!("{ssim:.5}"));
    format!("{rmse:>11.4e} {max:>11.4e} {psnr:>9} {ssim:>8} {:>9.3} %", 100.0 * differing)
}
