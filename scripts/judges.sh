#!/bin/sh
# Has the readers of other programs judge the exports: evo, pycolmap, rosbags, mcap, OpenCV, PyYAML, DuckDB. OpenCV also calibrates three lenses from pictures.
# Renders small scenes, and makes a Python environment with these packages (a download of about 300 MB, once).
#   CAMSIM=target/release/camsim   the program; without it, it is built
#   JUDGES_VENV=DIR                the environment; default target/judges-venv
#   JUDGES_DIR=DIR                 scenes and exports; default target/judges, made anew
set -eu
cd "$(dirname "$0")/.."
. scripts/setup.sh

python=$(command -v python3 || true)
if [ -z "$python" ]; then
    say "JUDGES SKIPPED: no python3 here, so no other program has read the exports (apt-get install python3-venv)"
    exit 0
fi
venv=${JUDGES_VENV:-target/judges-venv}
if ! [ -x "$venv/bin/python" ]; then
    say "making $venv"
    "$python" -m venv "$venv" || { say "JUDGES SKIPPED: python3 has no venv (apt-get install python3-venv)"; rm -rf "$venv"; exit 0; }
fi
if ! "$venv/bin/python" -c "import cv2, duckdb, evo, mcap, numpy, OpenEXR, pycolmap, rosbags, tombi, yaml" 2>/dev/null; then
    say "installing the readers into $venv"
    "$venv/bin/pip" install --quiet --requirement scripts/judges/requirements.txt ||
        { say "JUDGES SKIPPED: the packages of scripts/judges/requirements.txt could not be installed"; exit 0; }
fi
dir=${JUDGES_DIR:-target/judges}
rm -rf "$dir"
"$venv/bin/python" scripts/judges/scene.py "$dir"
camsim() {
    if [ -n "${CAMSIM:-}" ]; then "$CAMSIM" "$@"; else cargo run --quiet -- "$@"; fi
}
judge() {
    say "judge: $*"
    script=$1
    shift
    "$venv/bin/python" "scripts/judges/$script.py" "$@"
}
render() {
    say "rendering $1"
    camsim -q render "$dir/$1.toml" -o "$dir/$1/run" --backend cpu --set "output.datasets=$2"
}
render gs '["tum", "euroc", "kitti", "colmap", "mcap", "flo"]'
render rs '["tum", "euroc", "kitti"]'
render fisheye '["colmap", "mcap"]'
render rig '["colmap", "webdataset"]'
render stereo '["euroc", "kalibr"]'
judge trajectories "$dir/gs/run" "$dir/rs/run"
judge colmap "$dir/gs/run" "$dir/fisheye/run" "$dir/rig/run"
judge bag "$dir/gs/run" "$dir/fisheye/run"
judge pictures "$dir/gs/run"
judge settings "$dir/stereo/run"
camsim schema -o "$dir/scenario.schema.json"
camsim -q render --print-default > "$dir/default.toml"
say "studies: camsim's algorithms"
camsim -q new "$dir/board/flight.toml" --for calibration >/dev/null
sed "s|^scenario = .*|scenario = \"board/flight.toml\"|; s|^frames = .*|set = { \"camera.fps\" = 1 }|" scripts/judges/study.toml >"$dir/calibration.toml"
for algorithm in tracking flow pnp calibration mapping; do
    study=scripts/judges/study.toml
    [ $algorithm = calibration ] && study=$dir/calibration.toml
    camsim -q study "$study" --algorithm $algorithm -o "$dir/study-$algorithm" --python "$(realpath "$venv")/bin/python" >/dev/null
done
judge study "$dir"
judge schema "$dir/scenario.schema.json" "$dir/default.toml" "$dir/gs.toml" assets/demo.toml examples/propeller/propeller.toml
calib="$dir/calibrations"
"$venv/bin/python" scripts/judges/calibrations.py make "$calib"
for camera in radtan rational prism fisheye; do
    camsim -q lens "$calib/$camera.toml" distort --points "$calib/rays.csv" -o "$calib/$camera.px.csv"
    for format in opencv ros colmap; do
        camsim -q camera export "$calib/$camera.toml" --as "$format" -o "$calib/$camera.$format" ||
            say "$format has no lens like $camera"
    done
done
for format in kalibr euroc orbslam3 basalt stmap; do
    camsim -q camera export "$calib/radtan.toml" --as "$format" -o "$calib/radtan.$format"
done
judge calibrations "$calib"
judge shards "$dir/rig/run"
judge lens_calibration "${CAMSIM:-cargo run --quiet --}"
say "judges: all agree"
