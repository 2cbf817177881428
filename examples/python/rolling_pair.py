"""Pairs for learning: a rolling shutter, a global one at the same instant, and the displacement between them.

python rolling_pair.py [SCENARIO.toml]: ten pairs of it, or of the built-in flight, into out/pairs/
"""

import pathlib
import sys

import numpy as np

import camsim

folder, count = pathlib.Path("out/pairs"), 10
scenario = camsim.Scenario.load(sys.argv[1]) if sys.argv[1:] else camsim.Scenario.demo()
rolling = scenario.replace({"camera.shutter.exposure_ms": 0})
sharp = rolling.replace({"camera.shutter.readout_ms": 0})

folder.mkdir(parents=True, exist_ok=True)
pairs = zip(rolling.frames(0, count, channels=["color", "flow_global"]), sharp.frames(0, count, channels=["color"]), strict=True)
for seen, wanted in pairs:
    np.savez(
        folder / f"{seen.index:06}.npz",
        rolling=seen.color.astype(np.float16),
        sharp=wanted.color.astype(np.float16),
        flow=seen.flow_global[..., :2],
        visible=seen.flow_global[..., 2] == 1,
        readout_ns=seen.rows.t_mid_ns - seen.stamp_ns,
    )
    moved_px = np.linalg.norm(seen.flow_global[..., :2], axis=-1).max()
    print(f"{seen.index}: rows are displaced by up to {moved_px:.1f} px")
