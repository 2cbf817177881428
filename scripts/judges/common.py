"""What judges share: tables of a run, camsim's axes turned by matrices of their own, and verdicts."""

import csv
import sys
from importlib.metadata import version

import numpy as np

# Rows: east, north, up.
ENU_FROM_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FRD_FROM_FLU = np.diag([1.0, -1.0, -1.0])
FAILED = []


def versions(*packages):
    print("  versions: " + ", ".join(f"{package} {version(package)}" for package in packages))


def check(what, value, limit):
    """Prints a figure, and remembers whether it is beyond its limit."""
    good = bool(np.isfinite(value) and value <= limit)
    print(f"  {'ok  ' if good else 'FAIL'} {what}: {value:.3g} (at most {limit:g})")
    if not good:
        FAILED.append(what)


def finish():
    sys.exit(1 if FAILED else 0)


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def rotation(row, prefix=""):
    """Matrix of the quaternion in columns qw, qx, qy, qz."""
    w, x, y, z = (float(row[prefix + name]) for name in ("qw", "qx", "qy", "qz"))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def camera_pose(row):
    """World (ENU) from optical axes, 4x4, of a row with n, e, d and a quaternion ned_from_camera."""
    pose = np.eye(4)
    pose[:3, :3] = ENU_FROM_NED @ rotation(row)
    pose[:3, 3] = ENU_FROM_NED @ [float(row[name]) for name in ("n", "e", "d")]
    return pose
