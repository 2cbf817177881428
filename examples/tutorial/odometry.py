"""Stereo odometry of a EuRoC folder of `camsim export`: poses of the left camera, from its first picture on, as TUM writes them.

pip install numpy opencv-python-headless; python odometry.py FOLDER ESTIMATE.txt
"""

import pathlib
import sys
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
folder = pathlib.Path(sys.argv[1])
settings = cv2.FileStorage(str(folder / "settings/orb_slam3.yaml"), cv2.FILE_STORAGE_READ)
lenses = [[settings.getNode(f"Camera{i}.{key}").real() for key in "fx fy cx cy k1 k2 p1 p2 k3".split()] for i in (1, 2)]
right_from_left = np.linalg.inv(settings.getNode("Stereo.T_c1_c2").mat().astype(float))
one_px = 1 / lenses[0][0]


def picture(camera: int, stamp: str) -> Array:
    return np.asarray(cv2.imread(str(folder / f"mav0/cam{camera}/data/{stamp}.png"), cv2.IMREAD_GRAYSCALE), np.uint8)


def rays(pixels: Array, camera: int) -> Array:
    """x/z and y/z, without the lens."""
    fx, fy, cx, cy, *coefficients = lenses[camera]
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    return np.asarray(cv2.undistortPoints(pixels[:, None], matrix, np.array(coefficients))[:, 0], np.float64)


def key_frame(left: Array, right: Array) -> tuple[Array, Array]:
    """Corners of the left picture, and their points by triangulation: metres in its camera's axes."""
    pixels = cv2.goodFeaturesToTrack(left, 1000, 0.01, 8)[:, 0]
    matched, found, _ = cv2.calcOpticalFlowPyrLK(left, right, pixels, None)
    one, other = rays(pixels, 0), rays(matched, 1)
    points = cv2.triangulatePoints(np.eye(4)[:3], right_from_left[:3], one.T, other.T)
    x, y, z = right_from_left[:3] @ points / points[3]
    ok = (found[:, 0] == 1) & (z > 0) & (np.hypot(x / z - other[:, 0], y / z - other[:, 1]) < one_px)
    return pixels[ok], (points[:3] / points[3]).T[ok]


stamps = (folder / "settings/times_cam0.txt").read_text().split()
last, world_from_key = picture(0, stamps[0]), np.eye(4)
pixels, points = key_frame(last, picture(1, stamps[0]))
wanted = 0.6 * len(points)
with open(sys.argv[2], "w", encoding="ascii") as poses:
    for stamp in stamps:
        moved, found, _ = cv2.calcOpticalFlowPyrLK(last, picture(0, stamp), pixels, None)
        _, turn, shift, inliers = cv2.solvePnPRansac(points, rays(moved, 0), np.eye(3), None, reprojectionError=one_px)
        pixels, points, last = moved[inliers[:, 0]], points[inliers[:, 0]], picture(0, stamp)
        pose = world_from_key @ np.linalg.inv(np.r_[np.c_[cv2.Rodrigues(turn)[0], shift], [[0, 0, 0, 1]]])
        half = cv2.Rodrigues(pose[:3, :3])[0].ravel() / 2
        angle = np.linalg.norm(half)
        print(int(stamp) / 1e9, *pose[:3, 3], *half * np.sinc(angle / np.pi), np.cos(angle), file=poses)
        if len(points) < wanted:
            world_from_key, (pixels, points) = pose, key_frame(last, picture(1, stamp))
            wanted = 0.6 * len(points)
