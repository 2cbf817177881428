#!/usr/bin/env python3
"""evo reads TUM, EuRoC and KITTI folders; the error to the run's own tables is 0.

    trajectories.py GS_RUN RS_RUN     output folders with datasets/tum, euroc and kitti
"""

import pathlib
import sys

import numpy as np
from common import ENU_FROM_NED, FRD_FROM_FLU, camera_pose, check, finish, rotation, rows, versions
from evo.core import metrics, sync
from evo.core.trajectory import PosePath3D, PoseTrajectory3D
from evo.tools import file_interface


def ape(truth, read, relation):
    metric = metrics.APE(relation)
    metric.process_data((truth, read))
    return metric.get_statistic(metrics.StatisticsType.max)


def judge(name, truth, read):
    if isinstance(read, PoseTrajectory3D):
        truth, read = sync.associate_trajectories(truth, read, max_diff=1e-6)
    print(f"  {name}: {read.num_poses} poses")
    # Positions are metres from the origin; files keep all digits.
    check(f"{name}: ATE, m", ape(truth, read, metrics.PoseRelation.translation_part), 1e-9)
    # The angle is that of a matrix, by an arc cosine.
    check(f"{name}: attitude, deg", ape(truth, read, metrics.PoseRelation.rotation_angle_deg), 1e-5)


def frame_truth(run, is_rolling):
    """Times and poses of pictures: at the stamp, or of the middle of the rows."""
    times, poses = [], []
    for frame in rows(run / "frames.csv"):
        if is_rolling:
            lines = rows(run / frame["rows"])
            middle = [lines[len(lines) // 2 - 1], lines[len(lines) // 2]]
            a, b = (camera_pose(line) for line in middle)
            # Half a row lies between: a step in which a turn is a mean of matrices to 1e-9.
            pose = (a + b) / 2
            u, _, v = np.linalg.svd(pose[:3, :3])
            pose[:3, :3] = u @ v
            times.append((int(middle[0]["t_mid_ns"]) + int(middle[1]["t_mid_ns"])) / 2e9)
        else:
            pose = camera_pose(frame)
            times.append(int(frame["stamp_ns"]) / 1e9)
        poses.append(pose)
    return np.array(times), poses


def body_truth(run):
    """The platform, x forward, y left, z up, in ENU."""
    times, poses = [], []
    for row in rows(run / "trajectory.csv"):
        pose = np.eye(4)
        pose[:3, :3] = ENU_FROM_NED @ rotation(row) @ FRD_FROM_FLU
        pose[:3, 3] = ENU_FROM_NED @ [float(row[name]) for name in ("n_m", "e_m", "d_m")]
        times.append(float(row["t_s"]))
        poses.append(pose)
    return PoseTrajectory3D(poses_se3=poses, timestamps=np.array(times))


def main(scenes):
    versions("evo", "numpy")
    for run, is_rolling in zip(scenes, (False, True)):
        scene, name = run / "datasets", run.parent.name
        times, poses = frame_truth(run, is_rolling)
        tum = file_interface.read_tum_trajectory_file(scene / "tum" / "groundtruth.txt")
        judge(f"{name} TUM", PoseTrajectory3D(poses_se3=poses, timestamps=times), tum)
        euroc = file_interface.read_euroc_csv_trajectory(scene / "euroc" / "mav0" / "state_groundtruth_estimate0" / "data.csv")
        judge(f"{name} EuRoC", body_truth(run), euroc)
        kitti = file_interface.read_kitti_poses_file(scene / "kitti" / "poses" / "00.txt")
        _, poses = frame_truth(run / "pinhole", is_rolling)
        first = np.linalg.inv(poses[0])
        judge(f"{name} KITTI", PosePath3D(poses_se3=[first @ pose for pose in poses]), kitti)
    finish()


if __name__ == "__main__":
    main([pathlib.Path(path) for path in sys.argv[1:]])
