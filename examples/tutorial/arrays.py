"""Frames as numpy arrays: prints what each channel holds, and saves three frames for training.

python arrays.py [SCENARIO.toml] [FOLDER]
"""

import pathlib
import sys

import numpy as np

import camsim

scenario = camsim.Scenario.load(sys.argv[1] if sys.argv[1:] else "assets/demo.toml")
folder = pathlib.Path(sys.argv[2] if sys.argv[2:] else "out/arrays")
folder.mkdir(parents=True, exist_ok=True)
print(f"{len(scenario)} frames")

for frame in scenario.frames(30, 33, channels=["color", "depth", "flow", "valid"]):
    print(f"frame {frame.index}, stamp {frame.stamp_ns} ns")
    for name, array in frame.items():
        print(f"  {name}: {array.dtype}, {array.shape}, {array.min():.4g} to {array.max():.4g}")
    is_ground = frame.depth > 0
    is_seen_again = frame.flow[..., 2] == 1
    print(f"  {is_ground.mean():.1%} of the pixels have a depth, {is_seen_again.mean():.1%} are seen in the next frame")
    np.savez(
        folder / f"{frame.index:06}.npz",
        color=frame.color[..., :3].astype(np.float16),
        depth=frame.depth,
        flow=frame.flow[..., :2],
        is_ground=is_ground,
        is_seen_again=is_seen_again,
    )
