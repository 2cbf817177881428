//! `camsim cluster`: scripts that render a scenario in shards, on a cluster or on one machine.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_io::{portable::write_scenario, shell::quoted, write::write_atomic};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::{FrameList, FrameListError},
    inputs::{self, Changes},
};

/// Write scripts that render a scenario in shards
///
/// Each shard renders every N-th frame into a folder of its own, and resumes if it is started again. `camsim merge`
/// then checks the shards and joins them into the folder that one run would have made. The scripts name no absolute
/// path but that of the camsim program, which the variable CAMSIM replaces.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim cluster slurm flight.toml -N 200 -o job && job/submit.sh
  camsim cluster slurm flight.toml -N 20 -o job --sbatch=--partition=short --sbatch=--time=02:00:00
  camsim cluster local flight.toml -N 8 -o job && job/local.sh 4      four shards at once on this machine
  camsim merge job/shards/* -o job/frames                             what the scripts do at the end")]
pub struct ClusterArgs {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Debug, clap::Subcommand)]
enum Kind {
    /// An array job for Slurm, and a job that merges when all shards are done (submit.sh)
    Slurm(SlurmArgs),
    /// The same shards on this machine, by xargs -P (local.sh)
    Local(ShardArgs),
}

#[derive(Debug, clap::Args)]
struct SlurmArgs {
    #[command(flatten)]
    shards: ShardArgs,
    /// Option of sbatch for every shard, such as --sbatch=--partition=short (may be repeated)
    #[arg(long = "sbatch", value_name = "OPTION", allow_hyphen_values = true)]
    options: Vec<String>,
    /// Processors of each shard
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    cpus: u32,
}

#[derive(Debug, clap::Args)]
struct ShardArgs {
    /// Scenario (TOML)
    scenario: PathBuf,
    #[command(flatten)]
    changes: Changes,
    /// Number of shards
    #[arg(short = 'N', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    shards: u32,
    /// Folder of the scripts, the shards and the joined run
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Frames, as of `camsim render` [default: all]
    #[arg(long, value_name = "LIST", value_parser = frame_list, allow_hyphen_values = true)]
    frames: Option<String>,
    /// Further options of `camsim render`, after --
    #[arg(last = true, value_name = "OPTIONS")]
    render: Vec<String>,
}

/// The list as typed, if it is one.
fn frame_list(text: &str) -> Result<String, FrameListError> {
    text.parse::<FrameList>().map(|_| text.to_owned())
}

/// Writes the scripts.
pub fn run(args: &ClusterArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let shards = match &args.kind {
        Kind::Slurm(args) => &args.shards,
        Kind::Local(args) => args,
    };
    let folder = &shards.output;
    let scenario = inputs::read_changed(&shards.scenario, &shards.changes, console)?;
    if scenario.is_random() {
        return Err(Failure::bad_input(anyhow!(
            "camsim cluster makes shards of the frames of one scenario, and this one has [randomize]: in an array job, \
             `camsim render {} -o OUT --shard I/N --resume` renders every N-th variation, all into one folder",
            shards.scenario.display()
        )));
    }
    let rig = scenario.into_base();
    if folder.join("shards").exists() {
        return Err(Failure::bad_input(anyhow!(
            "{} has shards already: choose another folder, or remove that one",
            folder.display()
        )));
    }
    write_scenario(&folder.join("scenario.toml"), &rig).or_failed()?;
    write_script(folder, "shard.sh", &shard_script(shards)?)?;
    write_script(folder, "merge.sh", &merge_script()?)?;
    let start = match &args.kind {
        Kind::Slurm(args) => {
            write_script(folder, "array.sbatch", &array_script(args))?;
            write_script(folder, "merge.sbatch", MERGE_JOB)?;
            write_script(folder, "submit.sh", SUBMIT)?;
            "submit.sh"
        }
        Kind::Local(args) => {
            write_script(folder, "local.sh", &local_script(args.shards))?;
            "local.sh"
        }
    };
    Ok(console.line(format_args!(
        "{} shards: {}; the joined frames will be in {}",
        shards.shards,
        folder.join(start).display(),
        folder.join("frames").display()
    ))?)
}

/// The program that renders, for scripts.
fn program() -> Result<String, Failure> {
    let path = std::env::current_exe().or_failed()?;
    Ok(format!("camsim=${{CAMSIM:-{}}}", quoted(path)))
}

fn shard_script(args: &ShardArgs) -> Result<String, Failure> {
    let n = args.shards;
    let frames = args.frames.as_ref().map_or_else(String::new, |frames| format!(" --frames {frames}"));
    let more: String = args.render.iter().map(|word| format!(" {}", quoted(word))).collect();
    Ok(format!(
        "#!/bin/sh
# Renders shard $1 of {n} into shards/$1. Started again, it renders only what is missing.
set -eu
cd \"$(dirname \"$0\")\"
{}
\"$camsim\" -q render scenario.toml -o \"shards/$1\" --shard \"$1/{n}\" --resume --checksums{frames}{more}
",
        program()?
    ))
}

fn merge_script() -> Result<String, Failure> {
    Ok(format!(
        "#!/bin/sh
# Checks all shards and joins them in the folder frames.
set -eu
cd \"$(dirname \"$0\")\"
{}
\"$camsim\" merge shards/* -o frames
",
        program()?
    ))
}

fn array_script(args: &SlurmArgs) -> String {
    let options: String = args.options.iter().map(|option| format!("#SBATCH {option}\n")).collect();
    format!(
        "#!/bin/sh
#SBATCH --job-name=camsim
#SBATCH --array=1-{}
#SBATCH --cpus-per-task={}
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=log-%a.txt
{options}# Slurm runs a copy of this file, in the folder that submit.sh gives.
export RAYON_NUM_THREADS=\"${{SLURM_CPUS_PER_TASK:-{}}}\"
exec ./shard.sh \"$SLURM_ARRAY_TASK_ID\"
",
        args.shards.shards, args.cpus, args.cpus
    )
}

const MERGE_JOB: &str = "#!/bin/sh
#SBATCH --job-name=camsim-merge
#SBATCH --output=log-merge.txt
exec ./merge.sh
";

const SUBMIT: &str = "#!/bin/sh
# Submits the shards, and the merge for when all of them have succeeded. After a failure, run it again: finished shards
# take seconds.
set -eu
cd \"$(dirname \"$0\")\"
array=$(sbatch --parsable --chdir=\"$PWD\" array.sbatch)
merge=$(sbatch --parsable --chdir=\"$PWD\" --dependency=\"afterok:$array\" --kill-on-invalid-dep=yes merge.sbatch)
echo \"shards: job $array, merge: job $merge\"
";

fn local_script(shards: u32) -> String {
    format!(
        "#!/bin/sh
# Renders all shards, $1 at a time (default 1), and joins them. Started again, it renders only what is missing.
set -eu
cd \"$(dirname \"$0\")\"
seq {shards} | xargs -n 1 -P \"${{1:-1}}\" ./shard.sh
exec ./merge.sh
"
    )
}

/// Writes a script that can be executed.
fn write_script(folder: &Path, name: &str, text: &str) -> Result<(), Failure> {
    let path = folder.join(name);
    write_atomic(&path, text.as_bytes()).or_failed()?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).or_failed()?;
    }
    Ok(())
}
