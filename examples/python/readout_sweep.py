"""What a rolling shutter costs a tracker that takes it for a global one: rotation by tracked points against the true one.

pip install opencv-python-headless matplotlib; python readout_sweep.py [SCENARIO.toml]:
of it, or of the built-in flight; the plot is sweep.png
"""

import sys

import cv2
import matplotlib
import numpy as np
from numpy.typing import NDArray

import camsim

matplotlib.use("agg")
import matplotlib.pyplot as plt

READOUTS_MS = [0, 5, 10, 15, 20, 25, 30]
scenario = camsim.Scenario.load(sys.argv[1]) if sys.argv[1:] else camsim.Scenario.demo()
scenario = scenario.replace({"camera.shutter.exposure_ms": 0, "camera.photometric.noise_sigma": 0.002})


def rotation(wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix of a quaternion."""
    w, x, y, z = wxyz
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + 2 * w * skew + 2 * skew @ skew)


def error_deg(one: camsim.Frame, other: camsim.Frame, swept: camsim.Scenario) -> float:
    """Angle between estimated and true rotation from one frame to the other."""
    pictures = [(255 * np.clip(frame.color[..., 1], 0, 1) ** (1 / 2.2)).astype(np.uint8) for frame in (one, other)]
    points = cv2.goodFeaturesToTrack(pictures[0], 600, 0.01, 8)
    moved, ok, _ = cv2.calcOpticalFlowPyrLK(pictures[0], pictures[1], points, None)
    tracked = ok.ravel() == 1
    before, after = (swept.lens.undistort(pixels.reshape(-1, 2)[tracked]) for pixels in (points, moved))
    essential, inliers = cv2.findEssentialMat(before, after, np.eye(3), threshold=1e-3)
    _, estimated, _, _ = cv2.recoverPose(essential, before, after, np.eye(3), mask=inliers)
    poses = [swept.trajectory.camera_at_ns(frame.stamp_ns).ned_from_camera_wxyz for frame in (one, other)]
    true = rotation(poses[1]).T @ rotation(poses[0])
    return float(np.degrees(np.arccos(np.clip((np.trace(estimated @ true.T) - 1) / 2, -1, 1))))


medians = []
for readout_ms in READOUTS_MS:
    swept = scenario.replace({"camera.shutter.readout_ms": readout_ms})
    frames = list(swept.frames(step=6, channels=["color"]))
    errors = [error_deg(one, other, swept) for one, other in zip(frames, frames[1:], strict=False)]
    medians.append(np.median(errors))
    print(f"readout {readout_ms:2} ms: rotation off by {medians[-1]:.3f} degrees (median of {len(errors)})")

plt.plot(READOUTS_MS, medians, "o-")
plt.xlabel("readout, ms")
plt.ylabel("median error of the rotation, degrees")
plt.title("A tracker that takes a rolling shutter for a global one")
plt.savefig("sweep.png")
