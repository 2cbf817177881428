#!/usr/bin/env python3
"""Peak memory of `camsim export` for each layout, over 200 and over 2000 pictures of 48x32 pixels (a run of 20 frames, ten and a hundred times
over). Writes docs/results/export-memory.md; fails where 2000 pictures take more than MOST_MB above 200.

    python3 scripts/exports/memory.py target/release/camsim
"""

import os
import pathlib
import subprocess
import sys
import tempfile

from sample import FORMATS, FRAMES, render, repeated

COUNTS = [200, 2000]
# Rows of frames.csv are held: some hundred bytes a picture, of twins too.
MOST_MB = 4.0
TABLE = pathlib.Path(__file__).parents[2] / "docs" / "results" / "export-memory.md"


def peak_mb(program, run, layout, target):
    """Peak resident memory of an export."""
    command = [program, "-q", "export", str(run), "--as", layout, "-o", str(target)]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    message = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{layout}: {message}")
    return usage.ru_maxrss / 1024.0


def main(program):
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        run = render(program, work / "scene")
        runs = [repeated(run, work / f"run{count}", count // FRAMES) for count in COUNTS]
        rows, worst = [], 0.0
        for layout in FORMATS:
            peaks = [peak_mb(program, run, layout, work / f"{layout}-{run.name}") for run in runs]
            worst = max(worst, peaks[1] - peaks[0])
            rows.append(f"| `{layout}` | {peaks[0]:.1f} | {peaks[1]:.1f} |")
            print(rows[-1], flush=True)
    TABLE.write_text(
        "# Peak memory of exports\n\n`python3 scripts/exports/memory.py target/release/camsim`: resident memory of `camsim export`, MiB, with what the "
        "program itself takes. Pictures of 48x32 pixels.\n\n"
        f"| layout | {COUNTS[0]} pictures | {COUNTS[1]} pictures |\n|---|---|---|\n" + "\n".join(rows) + "\n\n"
        f"{COUNTS[1]} pictures take at most {worst:.1f} MiB more than {COUNTS[0]}: rows of `frames.csv`, and of its twins'.\n"
    )
    if worst > MOST_MB:
        raise SystemExit(f"memory grows by {worst:.1f} MiB")


if __name__ == "__main__":
    main(sys.argv[1])
