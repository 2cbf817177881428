#!/bin/sh
# OpenVINS (ROS 2) on the frames of a point of `camsim study` with export = "euroc", and evo's absolute error:
#   openvins.sh DATA RESULT
# It follows the sources of OpenVINS and is not run by camsim's tests.
set -eu
data=$1 result=$2
settings=$data/settings/openvins/estimator_config.yaml
rm -rf "$data/bag" "$data/poses"
camsim export "$data/camsim" --as mcap -o "$data/bag"
trap 'kill $(jobs -p) 2>/dev/null || true' EXIT
ros2 run ov_msckf run_subscribe_msckf --ros-args -p config_path:="$settings" &
for camera in cam0 cam1; do
    ros2 run image_transport republish compressed raw --ros-args \
        -r in/compressed:=/$camera/image_raw/compressed -r out:=/$camera/image_raw &
done
ros2 bag record -o "$data/poses" /poseimu &
recorder=$!
sleep 3
ros2 bag play "$data/bag/camsim.mcap"
sleep 2
kill -INT $recorder
wait $recorder || true
cd "$data"
evo_traj bag2 poses /poseimu --save_as_tum
evo_ape euroc mav0/state_groundtruth_estimate0/data.csv poseimu.tum --align --save_results ape.zip
unzip -p ape.zip stats.json > "$result"
