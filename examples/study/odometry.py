"""The error of the tutorial's stereo odometry, for `camsim study`: odometry.py DATA RESULT, with export = "euroc".

pip install numpy opencv-python-headless
"""

import csv
import json
import pathlib
import subprocess
import sys

import numpy as np

data, result = map(pathlib.Path, sys.argv[1:3])
estimate = data / "estimate.txt"
odometry = pathlib.Path(__file__).parents[1] / "tutorial" / "odometry.py"
subprocess.run([sys.executable, odometry, data, estimate], check=True)

with (data / "camsim/left/frames.csv").open(newline="") as file:
    true = {int(row["stamp_ns"]): [float(row[name]) for name in "ned"] for row in csv.DictReader(file)}
poses = np.loadtxt(estimate)
stamps = np.array(sorted(true))
# The estimate's times are decimal seconds.
nearest = stamps[np.abs(stamps[None] - 1e9 * poses[:, :1]).argmin(axis=1)]
found, truth = poses[:, 1:4], np.array([true[stamp] for stamp in nearest])

# The rigid motion that brings them together best (Umeyama 1991, without scale).
a, b = found - found.mean(axis=0), truth - truth.mean(axis=0)
u, _, vt = np.linalg.svd(b.T @ a)
turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
rms = float(np.sqrt(((b - a @ turn.T) ** 2).sum(axis=1).mean()))
length = float(np.linalg.norm(np.diff(truth, axis=0), axis=1).sum())
result.write_text(json.dumps({"position_rms_m": rms, "position_percent": 100 * rms / length}))
