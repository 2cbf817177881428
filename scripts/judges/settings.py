#!/usr/bin/env python3
"""OpenCV's FileStorage and PyYAML read the settings of exports for estimators, by the rules of each program.

    settings.py RUN      an output folder with datasets/euroc and kalibr, of two fisheye cameras and an IMU
"""

import pathlib
import sys

import cv2
import numpy as np
import yaml
from common import check, finish, rows, versions


def by_opencv(path):
    """A file as OpenVINS, ORB-SLAM3 and VINS-Fusion read it."""
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert file.isOpened(), path
    return file


def matrix(node):
    """A list of lists."""
    return np.array([[node.at(i).at(k).real() for k in range(node.at(i).size())] for i in range(node.size())])


def by_yaml(path):
    """A file as Kalibr reads it."""
    return yaml.safe_load(path.read_text())


def judge(run):
    euroc, kalibr = run / "datasets" / "euroc", run / "datasets" / "kalibr"
    settings = euroc / "settings"
    for path in sorted(settings.rglob("*.yaml")):
        by_opencv(path)
    print(f"  {len(list(settings.rglob('*.yaml')))} files that OpenCV reads")
    chain = by_yaml(kalibr / "camchain.yaml")
    openvins = by_opencv(settings / "openvins" / "kalibr_imucam_chain.yaml")
    orb = by_opencv(settings / "orb_slam3.yaml")
    vins = by_opencv(settings / "vins" / "vins.yaml")
    for i in range(2):
        camera = openvins.getNode(f"cam{i}")
        pose = np.linalg.inv(np.array(chain[f"cam{i}"]["T_cam_imu"]))
        check(f"cam{i}: T_imu_cam of OpenVINS to that of Kalibr", np.abs(matrix(camera.getNode("T_imu_cam")) - pose).max(), 1e-12)
        check(f"cam{i}: body_T_cam of VINS to it", np.abs(vins.getNode(f"body_T_cam{i}").mat() - pose).max(), 1e-12)
        shift = camera.getNode("timeshift_cam_imu").real() - chain[f"cam{i}"]["timeshift_cam_imu"]
        check(f"cam{i}: timeshift_cam_imu", abs(shift), 1e-15)
        ends = [orb.getNode(f"Camera{i + 1}.overlapping{end}") for end in ("Begin", "End")]
        check(f"cam{i}: columns of ORB-SLAM3 that are no integers", sum(not node.isInt() for node in ends), 0)
    for key, wanted in (("IMU.T_b_c1", np.linalg.inv(np.array(chain["cam0"]["T_cam_imu"]))), ("Stereo.T_c1_c2", np.linalg.inv(np.array(chain["cam1"]["T_cn_cnm1"])))):
        read = orb.getNode(key).mat()
        check(f"{key}: elements that are no floats", int(read.dtype != np.float32), 0)
        check(f"{key} to Kalibr's", np.abs(read - wanted).max(), 1e-6)
    # A node is valid as long as its file is.
    imu_chain = by_opencv(settings / "openvins" / "kalibr_imu_chain.yaml")
    imu = imu_chain.getNode("imu0")
    estimator = by_opencv(settings / "openvins" / "estimator_config.yaml")
    noise = by_yaml(kalibr / "imu0.yaml")
    for key in ("accelerometer_noise_density", "accelerometer_random_walk", "gyroscope_noise_density", "gyroscope_random_walk"):
        check(f"{key}: no number above 0 for Kalibr or OpenVINS", int(not (isinstance(noise[key], float) and noise[key] > 0 and imu.getNode(key).real() > 0)), 0)
    check("T_i_b", np.abs(matrix(imu.getNode("T_i_b")) - np.eye(4)).max(), 0)
    gravity = estimator.getNode("gravity_mag").real()
    check("gravity_mag to that of the run", abs(gravity - float(vins.getNode("g_norm").real())) + (gravity == 9.81), 1e-12)
    for folder in sorted(euroc.glob("mav0/cam*/data")) + sorted(kalibr.glob("cam?")):
        pictures = [cv2.imread(str(path), cv2.IMREAD_UNCHANGED) for path in sorted(folder.iterdir())]
        check(f"{folder.relative_to(run)}: pictures that are not 8 bit grey", sum(p.ndim != 2 or p.dtype != np.uint8 for p in pictures), 0)
    source = run / "left"
    grey = cv2.imread(str(source / rows(source / "frames.csv")[0]["color_png"]), cv2.IMREAD_GRAYSCALE).astype(int)
    own = cv2.imread(str(sorted((euroc / "mav0/cam0/data").iterdir())[0]), cv2.IMREAD_UNCHANGED).astype(int)
    check("grey to OpenCV's", np.abs(grey - own).max(), 1)


if __name__ == "__main__":
    versions("opencv-python-headless", "PyYAML")
    judge(pathlib.Path(sys.argv[1]))
    finish()
