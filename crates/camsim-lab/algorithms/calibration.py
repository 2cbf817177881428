"""Calibration by OpenCV from pictures of the board against the true one: where the two image the same rays."""

import cv2
import numpy as np
from common import board_corners, calibration, points_ned_m, write

size, matrix, coefficients, is_fisheye = calibration()
points = points_ned_m()
# In the board's own plane: two axes of it, from its first point on.
numbers = sorted(points)
world = np.array([points[number] for number in numbers])
_, _, axes = np.linalg.svd(world - world.mean(axis=0))
flat = {number: np.append((at - world[0]) @ axes[:2].T, 0.0) for number, at in zip(numbers, world)}
objects, images = [], []
for _, seen, pixels in board_corners():
    objects.append(np.array([flat[int(number)] for number in seen], np.float32)[:, None])
    images.append(pixels.astype(np.float32)[:, None])
nan = dict.fromkeys(["reprojection_px", "focal_error", "centre_error_px", "map_rms_px"], np.nan)
if len(objects) < 5:
    write(**nan, pictures=len(objects))
    raise SystemExit
if is_fisheye:
    flags = cv2.fisheye.CALIB_RECOMPUTE_EXTRINSIC | cv2.fisheye.CALIB_FIX_SKEW
    error, found, lens, _, _ = cv2.fisheye.calibrate(
        [part.astype(float) for part in objects], [part.astype(float) for part in images], size, None, None, flags=flags
    )
else:
    start, fixed = matrix.copy(), cv2.CALIB_FIX_K3 if coefficients[4] == 0 else 0
    error, found, lens, _, _ = cv2.calibrateCamera(objects, images, size, start, None, flags=cv2.CALIB_USE_INTRINSIC_GUESS | fixed)


def imaged(rays, matrix, lens):
    if is_fisheye:
        return cv2.fisheye.projectPoints(rays, np.zeros(3), np.zeros(3), matrix, lens.ravel()[:4])[0][:, 0]
    return cv2.projectPoints(rays, np.zeros(3), np.zeros(3), matrix, lens.ravel())[0][:, 0]


x, y = np.meshgrid(np.linspace(0, size[0] - 1, 24), np.linspace(0, size[1] - 1, 18))
grid = np.c_[x.ravel(), y.ravel()][:, None]
undistort = cv2.fisheye.undistortPoints if is_fisheye else cv2.undistortPoints
flat_rays = undistort(grid, matrix, coefficients[:4] if is_fisheye else coefficients)[:, 0]
rays = np.c_[flat_rays, np.ones(len(flat_rays))][:, None]
# The poses take up a turn of the camera, so a common shift counts as focal length and centre, not twice.
difference = imaged(rays, found, lens) - imaged(rays, matrix, coefficients)
write(
    reprojection_px=error,
    focal_error=found[0, 0] / matrix[0, 0] - 1,
    centre_error_px=np.hypot(found[0, 2] - matrix[0, 2], found[1, 2] - matrix[1, 2]),
    map_rms_px=np.sqrt((difference**2).sum(1).mean()),
    pictures=len(objects),
)
