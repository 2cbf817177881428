#!/usr/bin/env python3
"""OpenCV reads flow and depth back to the values of the EXR files.

    pictures.py RUN      an output folder with datasets/tum, kitti and flo
"""

import pathlib
import re
import sys

import cv2
import numpy as np
import OpenEXR
from common import check, finish, rows, versions


def exr(path, *names):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return [np.array(channels[name].pixels) for name in names]


def judge_depth(name, picture, truth, per_metre):
    read = cv2.imread(str(picture), cv2.IMREAD_UNCHANGED)
    assert read.dtype == np.uint16 and read.ndim == 2, picture
    check(f"{name}: depth, steps", np.abs(read - truth * per_metre).max(), 0.5 + 1e-3)


def main(run):
    scene = run / "datasets"
    versions("opencv-python-headless", "OpenEXR", "numpy")
    pictures = [line.split()[1] for line in (scene / "tum" / "depth.txt").read_text().splitlines() if line[0] != "#"]
    page = (scene / "tum" / "README.md").read_text()
    per_metre = float(re.search(r"planar z in (\S+) steps", page).group(1))
    for frame, picture in list(zip(rows(run / "frames.csv"), pictures))[:2]:
        judge_depth(f"TUM frame {frame['frame']}", scene / "tum" / picture, exr(run / frame["depth"], "Z")[0], per_metre)
    twin = run / "pinhole"
    for frame in rows(twin / "frames.csv")[:2]:
        number = f"{int(frame['frame']):06}"
        judge_depth(f"KITTI frame {number}", scene / "kitti" / "depth" / "00" / "image_2" / f"{number}.png", exr(twin / frame["depth"], "Z")[0], 256)
        dx, dy, state = exr(twin / frame["flow"], "dx", "dy", "state")
        for kind, states in (("flow_noc", (1, 4)), ("flow_occ", (1, 2, 3, 4))):
            # OpenCV gives blue, green, red.
            read = cv2.imread(str(scene / "kitti" / "training" / kind / f"{number}_10.png"), cv2.IMREAD_UNCHANGED)
            valid, v, u = (read[..., k].astype(float) for k in range(3))
            known = np.isin(state, states) & (np.abs(dx) < 511) & (np.abs(dy) < 511)
            check(f"KITTI {kind} {number}: pixels whose validity differs", np.sum((valid == 1) != known), 0)
            error = np.maximum(np.abs((u - 32768) / 64 - dx), np.abs((v - 32768) / 64 - dy))[known].max()
            check(f"KITTI {kind} {number}: flow, px", error, 0.5 / 64 + 1e-4)
    folder = scene / "flo" / "training"
    flows = sorted((folder / "flow" / "cam0_000").iterdir())
    check("flow files beside pictures", abs(len(flows) + 1 - len(list((folder / "final" / "cam0_000").iterdir()))), 0)
    for frame, path in list(zip(rows(run / "frames.csv"), flows))[:2]:
        dx, dy, state = exr(run / frame["flow"], "dx", "dy", "state")
        read = cv2.readOpticalFlow(str(path))
        known = state > 0
        check(f".flo {frame['frame']}: flow, px", np.abs(read - np.dstack([dx, dy]))[known].max(), 0)
        hidden = cv2.imread(str(folder / "occlusions" / "cam0_000" / (path.stem + ".png")), cv2.IMREAD_UNCHANGED)
        check(f".flo {frame['frame']}: occlusions that differ", np.sum((hidden == 255) != np.isin(state, (2, 3))), 0)
    finish()


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
