#!/bin/sh
# Makes the pictures at the head of the guides APPLY, BOARDS, EXPORT, LONG_RUNS, PYTHON, RANDOMIZE, RIGS and SENSORS:
#   sh scripts/pictures.sh target/release/camsim
# Needs a built camsim, and Python with numpy, matplotlib, Pillow and OpenEXR (PYTHON=... names the interpreter). Everything shown is
# in the repository: the demo's flight over generated terrain, or a board.
set -eu
camsim=$(realpath "$1")
cd "$(dirname "$0")/.."
repository=$PWD
demo=$repository/assets/demo.toml
python=${PYTHON:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp scripts/pictures/*.toml scripts/pictures/*.csv "$work"
cp assets/demo* assets/vignette.png "$work"
cd "$work"

# APPLY: a perfect picture with depth, wider than the output's, goes through a camera.
"$camsim" render apply_input.toml -o input --frames 2 --format png -q
"$camsim" apply apply_camera.toml apply_frame.toml -o applied.png -q

# BOARDS: an AprilGrid in a fast turn, with its exact corners.
"$camsim" render board.toml -o board --frames 12 -q

# EXPORT: a model of COLMAP.
"$camsim" export "$demo" --as colmap -o colmap --frames 0,16,32,48,64,80,96,112 --set 'output.tracks={points="terrain",count=2000}' -q

# LONG_RUNS: twelve frames of the whole flight, in two shards.
for shard in 1 2; do
    "$camsim" render "$demo" -o "shards/$shard" --shard "$shard/2" --checksums --format png -q \
        --set 'flight.window_s=[1,45]' --set camera.fps=0.27 --set 'camera.size_px=[320,240]' --set 'camera.focal_px=[210,210]' \
        --set 'camera.principal_point_px=[159.5,119.5]'
done
"$camsim" merge shards/1 shards/2 -o merged -q

# PYTHON: colour, depth and flow of one frame.
"$camsim" render "$demo" -o python --frames 32 --outputs color,depth,flow --format png -q

# RANDOMIZE: the first eight variations.
"$camsim" render randomize.toml -o randomize -q

# RIGS: four cameras at one instant.
"$camsim" render rig.toml -o rig --frames 32 -q

# SENSORS: samples beside their true values.
"$camsim" track sensors.toml --sensors sensors -q

"$python" "$repository/scripts/pictures/draw.py" "$work" "$repository/docs/pictures"
