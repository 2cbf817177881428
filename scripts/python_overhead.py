#!/usr/bin/env python3
"""What Python adds to rendering: frames through `scenario.frames()` against `camsim render --format none`, in turns.

PYTHONPATH=python python scripts/python_overhead.py target/release/camsim assets/demo.toml 120
Prints wall and processor time of each, loading included, and the ratio of the shortest.
"""

import os
import subprocess
import sys
import tempfile
import time

TURNS = 4
program, scenario, count = sys.argv[1:]
LOOP = """
import sys, camsim
for frame in camsim.Scenario.load(sys.argv[1]).frames(0, int(sys.argv[2]), channels=["color"]):
    frame.color[0, 0, 0]
"""


def measured(words):
    """Seconds by the clock and of the processor."""
    before, begin = os.times(), time.perf_counter()
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    processor_s = after.children_user + after.children_system - before.children_user - before.children_system
    return time.perf_counter() - begin, processor_s


runs = {"camsim render": [], "python": []}
with tempfile.TemporaryDirectory() as folder:
    for turn in range(TURNS):
        render = [program, "render", scenario, "-o", f"{folder}/{turn}", "--frames", f"0..{count}"]
        runs["camsim render"].append(measured([*render, "--format", "none", "--outputs", "color", "--quiet"]))
        runs["python"].append(measured([sys.executable, "-c", LOOP, scenario, count]))
best = {name: [min(part) for part in zip(*times)] for name, times in runs.items()}
for name, (wall_s, processor_s) in best.items():
    print(f"{name:14} {wall_s:7.2f} s wall, {processor_s:7.2f} s of the processor, {int(count) / wall_s:6.1f} frames/s")
wall, processor = (ours / theirs - 1 for theirs, ours in zip(*best.values()))
print(f"python takes {wall:+.1%} wall, {processor:+.1%} of the processor")
