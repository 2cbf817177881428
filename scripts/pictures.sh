#!/bin/sh
# Makes the pictures of docs/GALLERY.md, and those at the head of the guides EXPORT, LONG_RUNS, OBJECTS, PYTHON and SENSORS:
#   sh scripts/pictures.sh target/release/camsim
# Needs a built camsim, and Python with numpy, matplotlib, Pillow and OpenEXR (PYTHON=... names the interpreter). Everything shown is
# in the repository: the demo's flight, a village on the demo's terrain, or a board.
set -eu
camsim=$(realpath "$1")
cd "$(dirname "$0")/.."
repository=$PWD
demo=$repository/assets/demo.toml
python=${PYTHON:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp scripts/pictures/*.toml scripts/pictures/*.csv scripts/pictures/*.yaml "$work"
cp assets/demo* assets/vignette.png benches/houses/house.glb "$work"
"$python" scripts/pictures/vehicles.py "$work"
cd "$work"

# APPLY: a perfect picture with depth, wider than the output's, goes through a camera.
"$camsim" render apply_input.toml -o input --frames 2 --format png -q
"$camsim" apply apply_camera.toml apply_frame.toml -o applied.png -q

# BOARDS: an AprilGrid in a fast turn, with its exact corners.
"$camsim" render board.toml -o board --frames 12 -q

# CAMERA_FILES: the demo through two calibrations, and a binned part of the first.
for camera in opencv kalibr; do
    "$camsim" camera import "$camera.yaml" -o "$camera.toml" -q
done
"$camsim" render demo.toml -o opencv --frames 32 --format png -q --set camera=opencv.toml --set 'camera.mount.angles_deg=[0,-28,0]'
"$camsim" render demo.toml -o kalibr --frames 32 --format png -q --set camera=kalibr.toml --set 'camera.mount.angles_deg=[0,-28,0]' \
    --set camera.image_circle.half_angle_deg=95
"$camsim" render demo.toml -o part --frames 32 --format png -q --set camera=opencv.toml --set 'camera.mount.angles_deg=[0,-28,0]' \
    --set 'camera.resized={crop_px=[320,200,400,240],binning=2}'

# CHANNELS, OBJECTS: a village with a lorry and two cars.
"$camsim" render village.toml -o village --frames 40 --set output.palette=true --sheet -q \
    --outputs color,depth,range,normal,normal_world,object,coverage,flow,flow_back,flow_global,motion,blur_path

# Pairs of the GALLERY: a perfect camera, a global shutter, a scene without shadows.
"$camsim" render "$demo" -o demo --frames 60 --format png -q --set 'output.twin=[{name="perfect",ideal=true}]'
"$camsim" render "$repository/examples/propeller/propeller.toml" -o propeller --frames 2 -q
for shadows in false true; do
    "$camsim" render "$demo" -o "shadows_$shadows" --frames 60 --format png -q \
        --set "scene.light={sun_azimuth_deg=265,sun_elevation_deg=16,shadows=$shadows}"
done

# EXPORT: a model of COLMAP.
"$camsim" export "$demo" --as colmap -o colmap --frames 0,16,32,48,64,80,96,112 --set 'output.tracks={points="terrain",count=2000}' -q

# LONG_RUNS: six frames of the whole flight, in two shards.
for shard in 1 2; do
    "$camsim" render "$demo" -o "shards/$shard" --shard "$shard/2" --checksums --format png -q \
        --set 'flight.window_s=[1,45]' --set camera.fps=0.135 --set 'camera.size_px=[320,240]' --set 'camera.focal_px=[210,210]' \
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

# TRACKS: the points that the village's frame shows, through the 15 frames before it. Shadows move no point.
"$camsim" render village.toml -o tracks --frames 26..=40 --format none --set scene.light.shadows=false -q \
    --set 'output.tracks={points=["terrain","vertices"],count=400}'

"$python" "$repository/scripts/pictures/draw.py" "$work" "$repository/docs/pictures"
