#!/usr/bin/env python3
"""Ends exports and a rendering by `kill -9`, and lets them run into a full disk. Whatever is there then under a final name must be, byte for byte,
what an undisturbed run writes; the same command must complete it.

    python3 scripts/exports/faults.py target/release/camsim

The full disk is a small tmpfs, which only root may mount; otherwise that part is skipped, aloud.
"""

import contextlib
import filecmp
import json
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time

from sample import FORMATS, FRAMES, camsim, files, render, repeated

KILLS = 4
TEMPORARY = re.compile(r"\.tmp$")
# They say how far a run is, so they differ until it is finished.
STATE = {"export.json", "run.json", "frames.csv"}


def fail(text):
    raise SystemExit(f"FAIL {text}")


def check_whole(what, folder, whole):
    """Files by their final names are those of `whole`; returns how many there are."""
    count = 0
    for name, path in files(folder).items():
        # `.tracks` has the parts of tracks.csv, until a run is finished.
        if TEMPORARY.search(name) or name.startswith(("datasets/", ".tracks/")):
            continue
        if name not in whole:
            fail(f"{what}: {name} is no file of an undisturbed run")
        if pathlib.Path(name).name in STATE:
            if name.endswith(".json"):
                json.loads(path.read_text())
        elif not filecmp.cmp(path, whole[name], shallow=False):
            fail(f"{what}: {name} is not whole: {path.stat().st_size} bytes")
        count += 1
    return count


def check_complete(what, folder, whole):
    """All is there, without temporary files."""
    here = files(folder)
    left = [name for name in here if TEMPORARY.search(name)]
    missing = [name for name in whole if name not in here and not name.startswith("datasets/")]
    if left or missing:
        fail(f"{what}: temporary {left}, missing {missing}")
    check_whole(what, folder, whole)


def kills(what, command, folder, whole, seconds):
    """Kills the command at random instants, then lets it end."""
    counts = []
    for _ in range(KILLS):
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(random.uniform(0.0, 0.9) * seconds)
        child.send_signal(signal.SIGKILL)
        child.wait()
        counts.append(check_whole(what, folder, whole) if folder.exists() else 0)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        fail(f"{what}: {done.stderr}")
    check_complete(what, folder, whole)
    print(f"  {what}: killed {KILLS} times, with {counts} of {len(whole)} files, each whole; completed", flush=True)


@contextlib.contextmanager
def small_disk(folder, size):
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)
        folder.rmdir()


def full_disk(what, work, program, arguments, whole):
    """Runs the command on a disk with room for half of it."""
    size = sum(max(4096, path.stat().st_size) for name, path in whole.items() if not name.startswith("datasets/"))
    with small_disk(work / "disk", size // 2) as disk:
        target = disk / "out"
        done = camsim(program, *arguments, "-o", target)
        if done.returncode == 0:
            fail(f"{what}: a full disk is no error")
        if "No space left" not in done.stderr:
            fail(f"{what}: the error does not say why: {done.stderr}")
        left = [name for name in files(target) if TEMPORARY.search(name)]
        if left:
            fail(f"{what}: temporary files remain: {left}")
        count = check_whole(what, target, whole)
    print(f"  {what}: full disk, {count} of {len(whole)} files, each whole", flush=True)


def main(program):
    random.seed(12)
    is_root = os.name == "posix" and os.geteuid() == 0
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        run = render(program, work / "scene")
        scene = work / "scene" / "scene.toml"
        rendering = ["render", scene, "--frames", f"0..{FRAMES}", "--backend", "cpu", "--set", "output.datasets=[]"]
        plain = work / "plain"
        began = time.monotonic()
        if camsim(program, *rendering, "-o", plain).returncode:
            fail("render")
        seconds = time.monotonic() - began
        whole = files(plain)
        command = [program, "-q", *map(str, rendering), "-o", str(work / "killed"), "--resume"]
        kills("render", command, work / "killed", whole, seconds)
        if is_root:
            full_disk("render", work, program, rendering, whole)
        long = repeated(run, work / "long", 20)
        for layout in FORMATS:
            arguments = ["export", long, "--as", layout]
            began = time.monotonic()
            if camsim(program, *arguments, "-o", work / layout).returncode:
                fail(layout)
            seconds = time.monotonic() - began
            whole = files(work / layout)
            target = work / f"{layout}-killed"
            kills(layout, [program, "-q", *map(str, arguments), "-o", str(target)], target, whole, seconds)
            if is_root:
                full_disk(layout, work, program, arguments, whole)
    if not is_root:
        print("FULL DISK SKIPPED: only root may mount the small disk that it needs", flush=True)
    print("all files are whole or not there")


if __name__ == "__main__":
    main(sys.argv[1])
