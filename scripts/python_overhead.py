#!/usr/bin/env python3
"""What Python adds to rendering: frames through `scenario.frames()` against `camsim render --format none`, in turns.

PYTHONPATH=python python scripts/python_overhead.py target/release/camsim assets/demo.toml 120
Prints wall and processor time of each, loading included: the shortest, and the median of the turns' ratios, which does not
mind what else the machine does.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time

program, scenario, count = sys.argv[1:4]
TURNS = int(sys.argv[4]) if len(sys.argv) > 4 else 4
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
        words = {
            "camsim render": [*render, "--format", "none", "--outputs", "color", "--quiet"],
            "python": [sys.executable, "-c", LOOP, scenario, count],
        }
        for name in sorted(words, reverse=turn % 2 == 1):
            runs[name].append(measured(words[name]))
best = {name: [min(part) for part in zip(*times)] for name, times in runs.items()}
for name, (wall_s, processor_s) in best.items():
    print(f"{name:14} {wall_s:7.2f} s wall, {processor_s:7.2f} s of the processor, {int(count) / wall_s:6.1f} frames/s")
for k, what in enumerate(("wall time", "processor time")):
    ratios = [ours[k] / theirs[k] - 1 for theirs, ours in zip(*runs.values())]
    shortest = best["python"][k] / best["camsim render"][k] - 1
    print(f"python against camsim render, {what}: {statistics.median(ratios):+.1%} (median of {TURNS} turns), shortest {shortest:+.1%}")
