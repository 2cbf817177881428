"""A small run with all that the layouts need, and longer ones made of it."""

import csv
import os
import pathlib
import re
import subprocess

FORMATS = ["euroc", "tum", "kitti", "colmap", "nerfstudio", "kalibr", "mcap", "carla-rs", "gopro", "webdataset", "flo"]
FRAMES = 20
FPS = 20.0

SCENE = """\
[flight]
log = "log.csv"
window_s = [1.0, 3.0]
[tracker]
kind = "linear"
[camera]
size_px = [48, 32]
focal_px = [40.0, 40.0]
fps = 20.0
[camera.lens]
model = "brown-conrady"
coefficients = [-0.2, 0.05]
[camera.shutter]
readout_ms = 20.0
exposure_ms = 4.0
[scene.board]
kind = "chessboard"
columns = 8
rows = 5
size_m = 0.26
angles_deg = [0.0, 90.0, 0.0]
[[imu]]
name = "imu0"
[output]
format = ["png"]
stamps = "zero"
epoch_ns = 1700000000000000000
datasets = [{datasets}]
[output.tracks]
points = "board"
"""


def camsim(program, *arguments):
    """Runs camsim; the finished process."""
    return subprocess.run([program, "-q", *map(str, arguments)], capture_output=True, text=True, check=False)


def render(program, folder, output="run"):
    """The run of FRAMES frames with their twins."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = ["t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg"]
    rows += [f"{0.5 * i},{-3.0 + 0.1 * i},{0.02 * i},0,0,0,{i}" for i in range(9)]
    (folder / "log.csv").write_text("\n".join(rows) + "\n")
    layouts = ", ".join(f'"{name}"' for name in FORMATS)
    (folder / "scene.toml").write_text(SCENE.format(datasets=layouts))
    done = camsim(program, "render", folder / "scene.toml", "-o", folder / output, "--frames", f"0..{FRAMES}", "--backend", "cpu")
    if done.returncode:
        raise SystemExit(done.stderr)
    return folder / output


def repeated(run, folder, times):
    """The run `times` over: frames with new numbers and stamps, files by other names."""
    folder.mkdir(parents=True)
    for path in sorted(run.rglob("*")):
        relative = path.relative_to(run)
        if relative.parts[0] == "datasets":
            continue
        target = folder / relative
        if path.is_dir():
            target.mkdir()
        elif re.match(r"frame_\d{6}\.", path.name):
            for k in range(times):
                os.link(path, target.with_name(renamed(path.name, k)))
        elif path.name in ("frames.csv", "tracks.csv"):
            repeat_rows(path, target, times)
        else:
            os.link(path, target)
    return folder


def renamed(text, k):
    return re.sub(r"frame_(\d{6})", lambda match: f"frame_{int(match[1]) + k * FRAMES:06d}", text)


def repeat_rows(path, target, times):
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    clocks = [i for i, name in enumerate(header) if name.endswith("t_ns") or name == "stamp_ns"]
    with open(target, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for k in range(times):
            for row in rows:
                row = [renamed(cell, k) for cell in row]
                row[0] = int(row[0]) + k * FRAMES
                for i in clocks:
                    row[i] = int(row[i]) + round(k * FRAMES * 1e9 / FPS)
                writer.writerow(row)


def files(folder):
    """Every file below a folder by its relative path."""
    folder = pathlib.Path(folder)
    return {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
