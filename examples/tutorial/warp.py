"""Checks the flow: reads frame i + 1 where the flow of frame i leads, and compares that with frame i.

python warp.py [SCENARIO.toml]
"""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

import camsim


def read(picture: NDArray[Any], x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    """The picture between its pixels, bilinear."""
    left = np.clip(np.floor(x).astype(int), 0, picture.shape[1] - 2)
    top = np.clip(np.floor(y).astype(int), 0, picture.shape[0] - 2)
    a, b = (x - left)[..., None], (y - top)[..., None]
    above = (1 - a) * picture[top, left] + a * picture[top, left + 1]
    below = (1 - a) * picture[top + 1, left] + a * picture[top + 1, left + 1]
    return np.asarray((1 - b) * above + b * below)


scenario = camsim.Scenario.load(sys.argv[1] if sys.argv[1:] else "assets/demo.toml")
scenario = scenario.replace({"camera.photometric": {"noise_sigma": 0, "vignette": None}})
frames = list(scenario.frames(30, 35, channels=["color", "flow"]))
for one, other in zip(frames, frames[1:], strict=False):
    y, x = np.indices(one.flow.shape[:2])
    dx, dy, state = np.moveaxis(one.flow, -1, 0)
    seen = state == 1
    print(f"frame {one.index}: {seen.mean():.1%} seen again, {np.hypot(dx, dy)[seen].mean():.1f} px away; mean difference, DN:")
    for how, picture in {
        "without the flow": other.color,
        "by the flow": read(other.color, x + dx, y + dy),
        "by a flow that is off by half a pixel": read(other.color, x + dx + 0.5, y + dy),
    }.items():
        difference = np.abs(picture - one.color)[seen][:, :3].mean()
        print(f"    {how}: {255 * difference:.2f}")
