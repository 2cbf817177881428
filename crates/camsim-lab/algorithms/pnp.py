"""Pose of the camera from one picture of the board (OpenCV's solvePnP, true calibration) against the true pose."""

import cv2
import numpy as np
from common import board_corners, calibration, points_ned_m, rotation, spread, write

LEAST_CORNERS = 12

_, matrix, coefficients, is_fisheye = calibration()
points = points_ned_m()


def pose(world, rays):
    """Turn and shift from the world's axes to the camera's: of the two that a flat board allows, the one that fits better."""
    best = None
    _, turns, shifts, _ = cv2.solvePnPGeneric(world, rays, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    for turn, shift in zip(turns, shifts):
        turn, shift = cv2.solvePnPRefineLM(world, rays, np.eye(3), None, turn, shift)
        error = np.linalg.norm(cv2.projectPoints(world, turn, shift, np.eye(3), None)[0] - rays)
        if best is None or error < best[0]:
            best = error, turn, shift
    return best


shifts, turns = [], []
for row, numbers, pixels in board_corners():
    if len(numbers) < LEAST_CORNERS:
        continue
    world = np.array([points[int(number)] for number in numbers])
    undistort = cv2.fisheye.undistortPoints if is_fisheye else cv2.undistortPoints
    rays = undistort(pixels[:, None].astype(float), matrix, coefficients[:4] if is_fisheye else coefficients)
    found = pose(world, rays)
    if found is None:
        continue
    camera_from_ned = cv2.Rodrigues(found[1])[0]
    position = -camera_from_ned.T @ found[2][:, 0]
    shifts.append(1e3 * np.linalg.norm(position - [float(row[name]) for name in "ned"]))
    turns.append(np.degrees(np.linalg.norm(cv2.Rodrigues(camera_from_ned @ rotation(row))[0])))
write(**spread("position", shifts, "mm"), **spread("angle", turns, "deg"), pictures=len(turns))
