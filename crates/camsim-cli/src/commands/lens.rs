//! `camsim lens`: projects points through a lens, and checks the lens.

mod mtf;

use std::{
    fs::File,
    io::{self, Read, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail};
use camsim_core::camera::{BulkInverse, CameraModel, LensCheck, fringes_px};
use camsim_core::mtf::CameraMtf;
use camsim_core::scenario::CameraSpec;
use camsim_io::{
    formats::reading::read_camera_toml,
    kernel_file::load_kernel,
    lens_table::{lens_table_csv, load_lens_table},
    scenario_file::{read_cameras, read_rig},
};
use glam::DVec3;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    inputs::choose_camera,
    output::write_output,
};

/// Distort or undistort points with a camera's lens, or check the lens
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim lens CAMERA.toml distort --points rays.csv -o pixels.csv
  echo 'x_px,y_px
  319.5,239.5' | camsim lens flight.toml undistort
  camsim lens CAMERA.toml check --json
  camsim lens CAMERA.toml check --mtf                  the modulation transfer of lens and pixel
  camsim lens CAMERA.toml check --mtf --picture edge.png --region 100,80,200,150")]
pub struct LensArgs {
    /// Camera file, or a scenario: its [camera] is used, or one of its [[cameras]]
    camera: PathBuf,
    /// Camera of a scenario with [[cameras]], by its name [default: the first]
    #[arg(long = "camera", value_name = "NAME")]
    name: Option<String>,
    #[command(subcommand)]
    command: LensCommand,
}

#[derive(Debug, clap::Subcommand)]
enum LensCommand {
    /// Ideal (u, v) = (x/z, y/z) to pixels: reads u,v and writes x_px,y_px (NaN if u or v is not finite)
    Distort(PointsArgs),
    /// Pixels to ideal (u, v): reads x_px,y_px and writes u,v,valid (NaN and 0 where the lens has no inverse)
    Undistort(PointsArgs),
    /// Write the pixels of a grid of rays: a file for camera.lens_table, and for other programs
    Table {
        /// Rays along each side of the grid
        #[arg(long, default_value_t = 65, value_parser = clap::value_parser!(u32).range(5..=1025))]
        nodes: u32,
        /// Output CSV [default: standard output]
        #[arg(short, long, value_name = "CSV")]
        output: Option<PathBuf>,
    },
    /// Show where the model folds, the fraction of the image with an inverse, and the largest round-trip error
    Check {
        /// Print JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        mtf: mtf::MtfArgs,
    },
}

#[derive(Debug, clap::Args)]
struct PointsArgs {
    /// CSV of points [default: standard input]
    #[arg(long, value_name = "CSV")]
    points: Option<PathBuf>,
    /// Output CSV, one row per input row [default: standard output]
    #[arg(short, long, value_name = "CSV")]
    output: Option<PathBuf>,
    /// Rays x,y,z (right, down, forward) instead of u,v: also beside and behind the camera
    #[arg(long)]
    rays: bool,
}

/// Runs a lens command.
pub fn run(args: &LensArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let spec = read_camera(args, console)?;
    let in_file = || args.camera.display().to_string();
    let camera = CameraModel::from_spec(&spec).with_context(in_file).or_bad_input()?;
    match &args.command {
        LensCommand::Distort(points) => distort(&camera, points, console),
        LensCommand::Undistort(points) => undistort(&camera, points, console),
        LensCommand::Table { nodes, output } => {
            let text = lens_table_csv(&camera, *nodes);
            write_output(output.as_deref(), console, |out| out.write_all(text.as_bytes()))
        }
        LensCommand::Check { json, mtf } => {
            let fringes_px = fringes_px(&spec).with_context(in_file).or_bad_input()?;
            let lens = LensCheck { fringes_px, ..camera.check() };
            let report = LensReport { lens, mtf: mtf::measure(&spec, mtf)? };
            check(&report, *json, console)
        }
    }
}

/// A camera file has its keys at the root, a scenario has them in `[camera]` or `[[cameras]]`.
fn read_camera(args: &LensArgs, console: &mut Console<'_>) -> Result<CameraSpec, Failure> {
    let (path, name) = (&args.camera, args.name.as_deref());
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("{}: cannot be read", path.display()))
        .or_bad_input()?;
    // The reader of camera files explains errors of files that are not TOML.
    let root: toml::Table = text.parse().unwrap_or_default();
    Ok(if ["camera", "flight"].iter().any(|key| root.contains_key(*key)) {
        let mut spec =
            choose_camera(&read_rig(path, &[], None).or_bad_input()?, name, console)?.camera.clone();
        load_lens_table(&mut spec).or_bad_input()?;
        load_kernel(&mut spec).or_bad_input()?;
        spec
    } else if root.contains_key("cameras") {
        let mut spec = listed_camera(read_cameras(path).or_bad_input()?, name, console)?;
        load_lens_table(&mut spec).or_bad_input()?;
        load_kernel(&mut spec).or_bad_input()?;
        spec
    } else if let Some(name) = name {
        return Err(Failure::bad_input(anyhow!(
            "--camera {name} chooses one of the [[cameras]] of a scenario, and {} is a camera file: leave it out",
            path.display()
        )));
    } else {
        read_camera_toml(path).or_bad_input()?
    })
}

/// The camera of a name in a file with `[[cameras]]` alone, or the first.
fn listed_camera(
    cameras: Vec<CameraSpec>,
    name: Option<&str>,
    console: &mut Console<'_>,
) -> Result<CameraSpec, Failure> {
    let names = cameras.iter().map(|camera| camera.name.clone()).collect::<Vec<_>>().join(", ");
    if name.is_none() && cameras.len() > 1 {
        console.note(format_args!("the first of {names}: --camera NAME chooses another"));
    }
    let chosen = cameras.into_iter().find(|camera| name.is_none_or(|name| camera.name == name));
    chosen.ok_or_else(|| Failure::bad_input(anyhow!("there is no such camera; the cameras are {names}")))
}

fn distort(camera: &CameraModel, args: &PointsArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let path = args.points.as_deref();
    let rays: Vec<DVec3> = match args.rays {
        true => read_points(path, ["x", "y", "z"]).or_bad_input()?.into_iter().map(DVec3::from).collect(),
        false => {
            let points = read_points(path, ["u", "v"]).or_bad_input()?;
            points.into_iter().map(|[u, v]| DVec3::new(u, v, 1.0)).collect()
        }
    };
    let is_known = |ray: &DVec3| ray.is_finite() && *ray != DVec3::ZERO;
    let unknown = rays.iter().filter(|ray| !is_known(ray)).count();
    let is_seen = |ray: DVec3| match args.rays {
        true => camera.lens.contains_ray(ray),
        false => camera.lens.contains(ray.truncate()),
    };
    let beyond = rays.iter().filter(|ray| is_known(ray) && !is_seen(**ray)).count();
    write_output(args.output.as_deref(), console, |out| {
        writeln!(out, "x_px,y_px")?;
        for ray in &rays {
            let pixel = if args.rays { camera.project_ray(*ray) } else { camera.project(ray.truncate()) };
            match pixel.is_finite() {
                true => writeln!(out, "{:?},{:?}", pixel.x, pixel.y)?,
                false => writeln!(out, "NaN,NaN")?,
            }
        }
        Ok(())
    })?;
    if beyond > 0 {
        console.warn(format_args!(
            "{beyond} of {} points lie beyond the fold of the lens: the formula gives pixels for them, but \
             no real lens images them there",
            rays.len()
        ));
    }
    if unknown > 0 {
        console.warn(format_args!("{unknown} of {} points are not finite and have no pixels", rays.len()));
    }
    warn_if_empty(rays.is_empty(), console);
    Ok(())
}

fn warn_if_empty(is_empty: bool, console: &mut Console<'_>) {
    if is_empty {
        console.warn("there are no points: only the header is written");
    }
}

fn undistort(camera: &CameraModel, args: &PointsArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let points = read_points(args.points.as_deref(), ["x_px", "y_px"]).or_bad_input()?;
    let inverse = BulkInverse::new(camera.clone());
    write_output(args.output.as_deref(), console, |out| {
        writeln!(out, "{},valid", if args.rays { "x,y,z" } else { "u,v" })?;
        if args.rays {
            let mut rays = vec![[0.0; 3]; points.len()];
            inverse.rays(&points, &mut rays);
            return rays.iter().try_for_each(|ray| write_solution(out, ray));
        }
        let mut ideal = vec![[0.0; 2]; points.len()];
        inverse.unproject(&points, &mut ideal);
        ideal.iter().try_for_each(|uv| write_solution(out, uv))
    })?;
    warn_if_empty(points.is_empty(), console);
    Ok(())
}

/// A row of an undistorted point: NaN and 0 where there is none.
fn write_solution(out: &mut dyn Write, solution: &[f64]) -> io::Result<()> {
    for value in solution {
        write!(out, "{value:?},")?;
    }
    writeln!(out, "{}", u8::from(!solution[0].is_nan()))
}

/// What `check` prints.
#[derive(Debug, serde::Serialize)]
struct LensReport {
    #[serde(flatten)]
    lens: LensCheck,
    #[serde(skip_serializing_if = "Option::is_none")]
    mtf: Option<CameraMtf>,
}

fn check(report: &LensReport, json: bool, console: &mut Console<'_>) -> Result<(), Failure> {
    if json {
        console.json(report)?;
        return Ok(());
    }
    let LensCheck { valid_fraction, ray_fraction, angle_max_deg, .. } = report.lens;
    let LensCheck { fold_radius_min, fold_radius_max, worst_roundtrip_px, bijective, .. } = report.lens;
    console.line(format_args!("pixels with a ray              {:.3} %", 100.0 * ray_fraction))?;
    // An ideal plane holds no others.
    console.line(format_args!("  at most 89 degrees off axis  {:.3} %", 100.0 * valid_fraction))?;
    console.line(format_args!("largest angle off axis         {angle_max_deg:.3} degrees"))?;
    match (fold_radius_min, fold_radius_max) {
        (Some(min), Some(max)) => {
            console.line(format_args!("folds at ideal radius |(u, v)|  {min:.6} to {max:.6}"))?
        }
        _ => console.line("folds                          nowhere")?,
    }
    console.line(format_args!("largest round-trip error       {worst_roundtrip_px:.3e} px"))?;
    let answer = if bijective {
        "yes"
    } else {
        "no: some pixels have several ideal rays, so the calibration is unusable there"
    };
    console.line(format_args!("one ray per pixel              {answer}"))?;
    if let Some([red_px, blue_px]) = report.lens.fringes_px {
        console
            .line(format_args!("red and blue beside green      at most {red_px:.3} and {blue_px:.3} px"))?;
    }
    report.mtf.as_ref().map_or(Ok(()), |measured| mtf::print(measured, console))
}

/// Points of a CSV by the names of their columns; as many bare columns of numbers need no header. Lines that
/// begin with `#` are comments.
fn read_points<const N: usize>(path: Option<&Path>, columns: [&str; N]) -> anyhow::Result<Vec<[f64; N]>> {
    let (name, input): (String, Box<dyn Read>) = match path {
        Some(path) => {
            let name = path.display().to_string();
            let file = File::open(path).with_context(|| format!("{name}: cannot be read"))?;
            (name, Box::new(io::BufReader::new(file)))
        }
        None => ("standard input".to_owned(), Box::new(io::stdin().lock())),
    };
    parse_points(input, columns).with_context(|| name)
}

fn parse_points<const N: usize>(input: impl Read, columns: [&str; N]) -> anyhow::Result<Vec<[f64; N]>> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(input);
    let mut column_indices = None;
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        if column_indices.is_none() {
            if let Some(indices) = header(&record, columns) {
                column_indices = Some(indices);
                continue;
            }
            if record.len() != N {
                bail!(
                    "line {line}: the columns {} are missing; give a header that names them",
                    columns.join(",")
                );
            }
        }
        let column_indices = *column_indices.get_or_insert(std::array::from_fn(|i| i));
        let number = |i: usize| -> anyhow::Result<f64> {
            let text = record
                .get(column_indices[i])
                .ok_or_else(|| anyhow!("line {line}: {} is missing", columns[i]))?;
            text.parse().map_err(|_| {
                anyhow!(
                    "line {line}: {} is `{text}`, which is not a number; expected the columns {}",
                    columns[i],
                    columns.join(",")
                )
            })
        };
        let mut point = [0.0; N];
        for (i, value) in point.iter_mut().enumerate() {
            *value = number(i)?;
        }
        points.push(point);
    }
    Ok(points)
}

/// Indices of the columns, if the row names all. A byte-order mark may precede the first name.
fn header<const N: usize>(row: &csv::StringRecord, columns: [&str; N]) -> Option<[usize; N]> {
    let index = |name: &str| {
        row.iter().position(|cell| cell.trim_start_matches('\u{feff}').eq_ignore_ascii_case(name))
    };
    let mut indices = [0; N];
    for (slot, name) in indices.iter_mut().zip(columns) {
        *slot = index(name)?;
    }
    Some(indices)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    const UV: [&str; 2] = ["u", "v"];

    #[test]
    fn points_are_read_by_name_or_position() {
        let both = vec![[1.0, 2.0], [-3.5, 4e-3]];
        for text in [
            "u,v\n1,2\n-3.5,4e-3\n",
            "1,2\n-3.5,0.004",
            "\u{feff}id, V ,u\r\n7,2,1\r\n8,4e-3,-3.5\r\n",
            "# rays\nu,v\n1,2\n# more\n-3.5,4e-3\n",
        ] {
            assert_eq!(parse_points(text.as_bytes(), UV).unwrap(), both, "{text}");
        }
        assert!(parse_points("".as_bytes(), UV).unwrap().is_empty());
        assert!(parse_points("u,v\n".as_bytes(), UV).unwrap().is_empty());
    }

    #[test]
    fn invalid_points_are_reported_by_line() {
        for (text, wanted) in [
            ("u,v\n1,x\n", "line 2: v is `x`"),
            ("u,v\n1\n", "line 2: v is missing"),
            ("a,b,c\n1,2,3\n", "columns u,v are missing"),
            ("x_px,y_px\n1,2\n", "expected the columns u,v"),
        ] {
            let error = format!("{:#}", parse_points(text.as_bytes(), UV).unwrap_err());
            assert!(error.contains(wanted), "{error}");
        }
    }
}
