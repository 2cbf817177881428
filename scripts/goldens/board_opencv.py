#!/usr/bin/env python3
"""Does OpenCV find the camera again that camsim simulated?

Makes 40 poses before a chessboard, has camsim render them through the lens of EuRoC's cam0, finds the corners with OpenCV and calibrates.
Writes poses.csv, corners.csv and opencv.json into tests/data/board; the suite compares against these and needs no OpenCV.

    pip install opencv-python-headless numpy
    cargo build --release
    python3 scripts/goldens/board_opencv.py target/release/camsim

Last run with the versions that opencv.json names. The poses come from a fixed seed.
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import cv2
import numpy as np

DATA = pathlib.Path(__file__).resolve().parents[2] / "tests" / "data" / "board"
SCENARIO = DATA / "euroc_cam0.toml"
POSES = 40
# Corners stay this far from the picture's border, pixels: the detector wants to see part of the outer squares.
RIM_PX = 20.0


def rotation(roll, pitch, yaw):
    """ned_from_camera of a camera that looks along the nose."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    turn_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    turn_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    turn_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return turn_z @ turn_y @ turn_x @ np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])


def board_points(board):
    """Inner corners from the board's middle, x right and y down, row by row."""
    columns, rows, size = board["columns"], board["rows"], board["size_m"]
    y, x = np.mgrid[0:rows, 0:columns]
    return np.stack([(x - (columns - 1) / 2) * size, (y - (rows - 1) / 2) * size, np.zeros_like(x)], -1).reshape(-1, 3)


def project(points, position, ned_from_camera, matrix, distortion):
    # The board stands: its right is east, its down is down.
    ned = np.stack([points[:, 2], points[:, 0], points[:, 1]], -1)
    in_camera = (ned - position) @ ned_from_camera
    if in_camera[:, 2].min() < 0.1:
        return None
    return cv2.projectPoints(in_camera, np.zeros(3), np.zeros(3), matrix, distortion)[0].reshape(-1, 2)


def make_poses(points, matrix, distortion, size_px):
    """Poses that show the whole board, its middle all over the picture."""
    random, poses = np.random.default_rng(20210301), []
    while len(poses) < POSES:
        roll, pitch, yaw = np.radians(random.uniform([-30, -32, -32], [30, 32, 32]))
        depth, (u, v) = random.uniform(0.45, 0.85), random.uniform([-0.45, -0.3], [0.45, 0.3])
        turn = rotation(roll, pitch, yaw)
        position = -turn @ (depth * np.array([u, v, 1.0]))
        # As the file holds it.
        position, angles = np.round(position, 6), np.round(np.degrees([roll, pitch, yaw]), 5)
        px = project(points, position, rotation(*np.radians(angles)), matrix, distortion)
        if px is not None and px.min() > RIM_PX and (px < np.array(size_px) - 1 - RIM_PX).all():
            poses.append((position, angles))
    return poses


def find(picture, columns, rows, expected):
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(picture, (columns, rows), flags=flags)
    if not found:
        # Rows that a fisheye bends much only the classic detector follows.
        found, corners = cv2.findChessboardCorners(picture, (columns, rows), flags=cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not found:
        return None
    # The detector's own positions suffer where the lens bends the rows; the classic refinement does not.
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-4)
    corners = cv2.cornerSubPix(picture, corners.reshape(-1, 1, 2).astype(np.float32), (5, 5), (-1, -1), stop).reshape(-1, 2)
    # A chessboard may be counted from either end.
    turned = corners[::-1]
    return min((corners, turned), key=lambda c: np.abs(c - expected).sum())


def main():
    camsim = pathlib.Path(sys.argv[1]).resolve()
    scenario = tomllib.loads(SCENARIO.read_text())
    camera, board = scenario["camera"], scenario["scene"]["board"]
    (fx, fy), (cx, cy) = camera["focal_px"], camera["principal_point_px"]
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    distortion = np.array(camera["lens"]["coefficients"])
    points = board_points(board)
    poses = make_poses(points, matrix, distortion, camera["size_px"])
    with open(DATA / "poses.csv", "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["t_s", "n_m", "e_m", "d_m", "roll_deg", "pitch_deg", "yaw_deg"])
        # One more, so that the last frame, half a second on, is inside the log.
        for i, (position, angles) in enumerate(poses + poses[-1:]):
            out.writerow([i, *(f"{x:.6f}" for x in position), *(f"{a:.5f}" for a in angles)])
    corners, rows = [], []
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([camsim, "render", SCENARIO, "-o", folder, "--quiet"], check=True)
        for i, (position, angles) in enumerate(poses):
            picture = cv2.imread(f"{folder}/color/frame_{i:06}.png", cv2.IMREAD_GRAYSCALE)
            expected = project(points, position, rotation(*np.radians(angles)), matrix, distortion)
            found = find(picture, board["columns"], board["rows"], expected)
            if found is None:
                sys.exit(f"frame {i}: OpenCV finds no board")
            corners.append(found.astype(np.float32))
            rows += [(i, k, f"{x:.3f}", f"{y:.3f}", *np.abs(found[k] - expected[k])) for k, (x, y) in enumerate(found)]
    with open(DATA / "corners.csv", "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["frame", "id", "x_px", "y_px"])
        out.writerows(row[:4] for row in rows)
    objects = [points.astype(np.float32)] * POSES
    rms, k, d, *_ = cv2.calibrateCamera(objects, corners, tuple(camera["size_px"]), None, None, flags=cv2.CALIB_FIX_K3)
    d = d.ravel()
    error = np.array([row[4:] for row in rows])
    result = {
        "versions": {"opencv": cv2.__version__, "numpy": np.__version__, "python": sys.version.split()[0]},
        "frames": POSES,
        "corners_against_truth_rms_px": round(float(np.sqrt((error**2).sum(1).mean())), 5),
        "corners_against_truth_max_px": round(float(np.sqrt((error**2).sum(1)).max()), 5),
        "reprojection_rms_px": round(float(rms), 5),
        "focal_px": [round(float(k[0, 0]), 4), round(float(k[1, 1]), 4)],
        "principal_point_px": [round(float(k[0, 2]), 4), round(float(k[1, 2]), 4)],
        "k1": round(float(d[0]), 6),
        "k2": round(float(d[1]), 6),
        "p1": round(float(d[2]), 7),
        "p2": round(float(d[3]), 7),
    }
    (DATA / "opencv.json").write_text(json.dumps(result, indent=2) + "\n")
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
