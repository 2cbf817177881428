"""Calibrates a simulated chessboard by OpenCV, and compares with the lens that took the pictures.

pip install opencv-python-headless; python calibrate_board.py
"""

import cv2
import numpy as np

import camsim

columns, rows = 9, 6
random = np.random.default_rng(4)
t_s = np.arange(25) * 0.5
around_m = np.c_[random.uniform(-0.08, 0.08, (25, 2)), random.uniform(-0.55, -0.4, 25)]
log = camsim.PoseTable(t_s, position_ned_m=around_m, angles_deg=random.uniform(-18, 18, (25, 3)))
scenario = camsim.Scenario.from_dict(
    {
        "flight": {"log": log},
        "tracker": {"kind": "linear"},
        "camera": {
            "size_px": [640, 480],
            "focal_px": [520.0, 521.0],
            "fps": 2.0,
            "mount": {"angles_deg": [0, -90, 0]},
            "lens": {"model": "brown-conrady", "coefficients": [-0.22, 0.06, 0.0006, -0.0004]},
            "photometric": {"noise_sigma": 0.005},
        },
        "scene": {"board": {"kind": "chessboard", "columns": columns, "rows": rows, "size_m": 0.04}},
    }
)

points_m = np.c_[camsim.board(scenario).points_m, np.zeros(columns * rows)].astype(np.float32)
found, seen = [], []
for frame in scenario.frames(channels=["color"], progress=True):
    picture = (255 * np.clip(frame.color[..., 1], 0, 1) ** (1 / 2.2)).astype(np.uint8)
    ok, corners = cv2.findChessboardCornersSB(picture, (columns, rows))
    if ok:
        found.append(corners)
        seen.append(points_m)

error_px, matrix, coefficients, _, _ = cv2.calibrateCamera(seen, found, scenario.lens.size_px, None, None, flags=cv2.CALIB_FIX_K3)
print(f"{len(found)} of {len(scenario)} pictures show the whole board; reprojection error {error_px:.3f} px")
print("focal length, principal point: estimated", np.round(matrix[[0, 1, 0, 1], [0, 1, 2, 2]], 2))
print("                               true     ", scenario.lens.matrix[[0, 1, 0, 1], [0, 1, 2, 2]])
print("k1 k2 p1 p2: estimated", np.round(coefficients.ravel()[:4], 4), "true", scenario.lens.coefficients[:4])
