#!/usr/bin/env python3
"""The algorithms of `camsim study` on a flight with a global and with a rolling shutter: are their errors those of working programs?

    study.py DIR     with a folder study-NAME of each
"""

import pathlib
import sys

from common import check, finish, rows, versions

# Errors of a working algorithm: some tenths of a pixel, millimetres at 10 m, a hundredth of the path.
MOST = {
    "tracking": {"error_median_px": 0.3, "lost": 0.2},
    "flow": {"error_median_px": 0.5},
    "pnp": {"position_median_mm": 60.0, "angle_median_deg": 0.5},
    "calibration": {"reprojection_px": 0.5, "map_rms_px": 5.0},
    "mapping": {"centre_percent": 1.0},
}


def main(folder):
    versions("opencv-python-headless", "pycolmap")
    for name, limits in MOST.items():
        table = rows(folder / f"study-{name}" / "study.csv")
        by_readout = {float(row["camera.shutter.readout_ms"]): row for row in table}
        for number, limit in limits.items():
            check(f"{name}, global shutter: {number}", float(by_readout[0.0][number] or "nan"), limit)
        print(f"  {name}, 40 ms of readout: " + ", ".join(f"{number} {by_readout[40.0][number]}" for number in limits))
    pnp = {float(row["camera.shutter.readout_ms"]): row for row in rows(folder / "study-pnp" / "study.csv")}
    ratio = float(pnp[0.0]["angle_median_deg"]) / float(pnp[40.0]["angle_median_deg"])
    check("pnp: error of the angle with a global shutter, over that with 40 ms of readout", ratio, 0.5)
    finish()


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
