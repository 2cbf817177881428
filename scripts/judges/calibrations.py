#!/usr/bin/env python3
"""Calibrations of `camsim camera export`, read by the programs that they are for.

    calibrations.py make DIR    writes cameras and rays
    calibrations.py DIR         judges the exports: pixels of the rays by OpenCV and COLMAP from their files, against camsim's own
"""

import json
import pathlib
import sys

import numpy as np

LENSES = {
    "radtan": ("brown-conrady", [-0.283, 0.074, 1.9e-4, 1.8e-5]),
    "rational": ("brown-conrady", [0.42, -0.31, 1e-3, -4e-4, 0.02, 0.66, -0.2, 0.01]),
    "prism": ("brown-conrady-prism", [-0.2, 0.05, 1e-4, 2e-4, 0.0, 0.0, 0.0, 0.0, 1e-3, -5e-4, 2e-4, 1e-4]),
    "fisheye": ("kannala-brandt", [3.5e-3, 7e-4, -2.0e-3, 2e-4]),
}
MOUNT_DEG, OFFSET_M = [1.25, -88.5, 3.0], [0.1, 0.055, -0.02]
SIZE, FOCAL, POINT = (752, 480), (458.654, 457.296), (367.215, 248.375)


def make(folder):
    folder.mkdir(parents=True, exist_ok=True)
    grid = [(u, v) for u in np.linspace(-0.6, 0.6, 25) for v in np.linspace(-0.4, 0.4, 17)]
    (folder / "rays.csv").write_text("u,v\n" + "".join(f"{u!r},{v!r}\n" for u, v in np.array(grid).tolist()))
    for name, (model, coefficients) in LENSES.items():
        (folder / f"{name}.toml").write_text(
            f"size_px = {list(SIZE)}\nfocal_px = {list(FOCAL)}\nprincipal_point_px = {list(POINT)}\nfps = 20.0\n"
            f"mount = {{ angles_deg = {MOUNT_DEG}, offset_m = {OFFSET_M} }}\n"
            f'shutter = {{ readout_ms = 14.4 }}\nlens = {{ model = "{model}", coefficients = {coefficients} }}\n'
        )


def table(path):
    return np.loadtxt(path, delimiter=",", skiprows=1)


def by_opencv(is_fisheye, matrix, distortion, rays):
    import cv2

    points = np.column_stack([rays, np.ones(len(rays))]).reshape(-1, 1, 3)
    project = cv2.fisheye.projectPoints if is_fisheye else None
    if project:
        return project(points, np.zeros(3), np.zeros(3), matrix, distortion.reshape(-1)[:4])[0].reshape(-1, 2)
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, distortion)[0].reshape(-1, 2)


def opencv(path, rays):
    import cv2

    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    size = [int(file.getNode(key).real()) for key in ("image_width", "image_height")]
    assert size == list(SIZE), size
    is_fisheye = file.getNode("fisheye_model").real() == 1
    matrix, distortion = (file.getNode(key).mat() for key in ("camera_matrix", "distortion_coefficients"))
    return by_opencv(is_fisheye, matrix, distortion, rays)


def ros(path, rays):
    import yaml

    info = yaml.safe_load(path.read_text())
    matrix = np.array(info["camera_matrix"]["data"]).reshape(3, 3)
    return by_opencv(
        info["distortion_model"] == "equidistant", matrix, np.array(info["distortion_coefficients"]["data"]), rays
    )


def colmap(path, rays):
    import pycolmap

    model = path.parent / (path.stem + "-model")
    model.mkdir(exist_ok=True)
    (model / "cameras.txt").write_text(path.read_text())
    for name in ("images", "points3D", "rigs", "frames"):
        (model / f"{name}.txt").write_text("")
    camera = next(iter(pycolmap.Reconstruction(model).cameras.values()))
    # Its first pixel has the centre (0.5, 0.5).
    return np.array([np.ravel(camera.img_from_cam(np.array([u, v, 1.0]))) - 0.5 for u, v in rays])


def axes(degrees):
    """Optical axes in the body by roll, pitch, yaw; columns right, down, ahead."""
    roll, pitch, yaw = np.radians(degrees)
    c, s = np.cos, np.sin
    x = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    y = np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
    z = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    return z @ y @ x @ np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def pose():
    """The camera in the platform, forward, left, up."""
    from common import FRD_FROM_FLU

    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = FRD_FROM_FLU @ axes(MOUNT_DEG), FRD_FROM_FLU @ np.array(OFFSET_M)
    return matrix


def poses(folder, check):
    import cv2
    import yaml

    wanted = pose()
    chain = yaml.safe_load((folder / "radtan.kalibr").read_text())["cam0"]
    check("Kalibr: T_cam_imu", np.abs(np.linalg.inv(np.array(chain["T_cam_imu"])) - wanted).max(), 1e-14)
    check("Kalibr: line_delay, s", abs(chain["line_delay"] - 0.0144 / 480), 1e-18)
    sensor = yaml.safe_load((folder / "radtan.euroc").read_text())
    check("EuRoC: T_BS", np.abs(np.array(sensor["T_BS"]["data"]).reshape(4, 4) - wanted).max(), 1e-14)
    orb = cv2.FileStorage(str(folder / "radtan.orbslam3"), cv2.FILE_STORAGE_READ)
    # ORB-SLAM3 keeps the pose in floats.
    # ORB-SLAM3 reads 32-bit numbers.
    check("ORB-SLAM3: IMU.T_b_c1", np.abs(orb.getNode("IMU.T_b_c1").mat() - wanted).max(), 1e-6)
    check("ORB-SLAM3: Camera1.fx", abs(orb.getNode("Camera1.fx").real() - FOCAL[0]), 0)
    t = json.loads((folder / "radtan.basalt").read_text())["value0"]["T_imu_cam"][0]
    check("Basalt: T_imu_cam", np.abs(np.array([t["px"], t["py"], t["pz"]]) - wanted[:3, 3]).max(), 1e-15)
    x, y, z, w = (t[key] for key in ("qx", "qy", "qz", "qw"))
    first_column = [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)]
    check("Basalt: right of the picture", np.abs(np.array(first_column) - wanted[:3, 0]).max(), 1e-14)


def stmap(folder, check):
    import OpenEXR

    with OpenEXR.File(str(folder / "radtan.stmap" / "undistort.exr"), separate_channels=True) as file:
        channels = file.channels()
        s, t = (np.array(channels[name].pixels, dtype=float) for name in "RG")
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    ideal = np.column_stack([(x.ravel() - POINT[0]) / FOCAL[0], (y.ravel() - POINT[1]) / FOCAL[1]])
    wanted = opencv(folder / "radtan.opencv", ideal)
    found = np.column_stack([s.ravel() * SIZE[0] - 0.5, (1 - t.ravel()) * SIZE[1] - 0.5])
    # Floats of shares: 752 px times 2^-24.
    check("STmap against OpenCV, px", np.abs(found - wanted)[s.ravel() >= 0].max(), 1e-4)


def judge(folder):
    from common import check, finish, versions

    versions("pycolmap", "OpenEXR", "numpy")
    rays = table(folder / "rays.csv")
    for name in LENSES:
        own = table(folder / f"{name}.px.csv")
        for format, read in [("opencv", opencv), ("ros", ros), ("colmap", colmap)]:
            path = folder / f"{name}.{format}"
            if path.exists():
                check(f"{name} by {format}, px", np.abs(read(path, rays) - own).max(), 1e-9)
            else:
                print(f"  none {name} by {format}: it has no such lens")
    poses(folder, check)
    stmap(folder, check)
    finish()


if sys.argv[1] == "make":
    make(pathlib.Path(sys.argv[2]))
else:
    judge(pathlib.Path(sys.argv[1]))
