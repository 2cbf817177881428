//! `camsim board`: the image of a calibration board for printing, and its points.

use std::path::PathBuf;

use anyhow::anyhow;
use camsim_core::{
    frame::RenderedFrame,
    scenario::{BoardSpec, OutputEncoding},
    scene::{Board, ned_from_board},
};
use camsim_io::{
    board_file::read_board,
    load::{board_position_ned_m, load_flight},
    scenario_file::read_rig,
    write::write_picture,
};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    output::{check_output, write_output},
};

/// Write the image of a calibration board, and the positions of its corners or circles
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim board flight.toml -o board.png --points points.csv
  camsim board april_6x6.yaml -o board.png")]
pub struct BoardArgs {
    /// Scenario with a [scene.board], or Kalibr's target YAML
    board: PathBuf,
    /// Image file: .png or linear .exr
    #[arg(short, long, value_name = "PICTURE")]
    output: Option<PathBuf>,
    /// Points as id,x_m,y_m from the board's centre, x right and y down; for a scenario also n_m,e_m,d_m
    /// [default without an image: standard output]
    #[arg(long, value_name = "CSV")]
    points: Option<PathBuf>,
}

/// Runs `camsim board`.
pub fn run(args: &BoardArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    args.output.as_deref().map_or(Ok(()), check_output)?;
    let yaml = args
        .board
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("yaml") || ending.eq_ignore_ascii_case("yml"));
    let (board, pose) = if yaml {
        (
            read_board(&BoardSpec { target: Some(args.board.clone()), ..BoardSpec::default() })
                .or_bad_input()?,
            None,
        )
    } else {
        let rig = read_rig(&args.board, &[], None).or_bad_input()?;
        // The board is the same for all cameras.
        let scenario = rig.first();
        let spec = scenario.scene.board.as_ref();
        let spec =
            spec.ok_or_else(|| anyhow!("{}: has no [scene.board]", args.board.display())).or_bad_input()?;
        let (log, _) = load_flight(scenario).or_bad_input()?;
        let centre_ned_m = board_position_ned_m(scenario, spec, &log).or_bad_input()?;
        (read_board(spec).or_bad_input()?, Some((centre_ned_m, ned_from_board(spec.angles_deg))))
    };
    if let Some(path) = &args.output {
        write_picture(path, &picture(&board), OutputEncoding::Luma8).or_failed()?;
    }
    if args.points.is_none() && args.output.is_some() {
        return Ok(());
    }
    write_output(args.points.as_deref(), console, |out| {
        writeln!(out, "id,x_m,y_m{}", if pose.is_some() { ",n_m,e_m,d_m" } else { "" })?;
        for point in board.points() {
            write!(out, "{},{:?},{:?}", point.id, point.position_m.x, point.position_m.y)?;
            if let Some((centre_ned_m, turn)) = pose {
                let ned = centre_ned_m + turn * point.position_m.extend(0.0);
                write!(out, ",{:?},{:?},{:?}", ned.x, ned.y, ned.z)?;
            }
            writeln!(out)?;
        }
        Ok(())
    })
}

fn picture(board: &Board) -> RenderedFrame {
    let texture = board.picture();
    let color_rgba = texture.rgba8.iter().map(|&byte| f32::from(byte) / 255.0).collect();
    RenderedFrame::picture(texture.size_px, color_rgba)
}
