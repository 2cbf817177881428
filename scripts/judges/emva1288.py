#!/usr/bin/env python3
"""EMVA 1288 release 4.0 on stacks of raw pictures, by the reference implementation `emva1288`: does it find the keys again?

    pip install emva1288 pillow numpy
    python3 scripts/judges/emva1288.py camsim          # the program; renders flat and dark stacks, prints a table

A camera that stands still looks at a white sky (flat) or a black one (dark). The irradiance is constant and the exposure rises, two pictures a step;
photons per pixel are worked out here from irradiance, area, wavelength and time. The spatial stacks have 64 pictures each. Every picture has a frame number of
its own, so that no noise is used twice.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
from importlib.metadata import version

import numpy as np
from emva1288.process.data import Data1288
from emva1288.process.loader import LoadImageData
from emva1288.process.results import Results1288
from PIL import Image

SIZE = (640, 480)
E_PER_DN, QE, READ_E, FULL_E, DARK_E_S, DSNU_E, PRNU = 2.6, 0.6, 2.45, 40_000.0, 200.0, 3.0, 0.01
# The dark current is stated at 25 degrees and doubles twice.
SENSOR = dict(
    mosaic="mono", pixel_um=3.45, wavelength_nm=530.0, quantum_efficiency=QE, read_noise_e=READ_E, full_well_e=FULL_E,
    gain_e_per_dn=E_PER_DN, black_dn=64.0, bits=14, dark_current_e_s=DARK_E_S / 4, dark_doubling_c=8.0, temperature_c=41.0,
    dsnu_e=DSNU_E, prnu=PRNU,
)
FULL_MS = 20.0
# Full well at FULL_MS.
PHOTONS_MS = FULL_E / QE / FULL_MS
W_M2 = PHOTONS_MS * 1e3 / (3.45e-6**2) * 6.62607015e-34 * 299_792_458.0 / 530e-9
STEPS = np.concatenate([np.linspace(0.01, 0.9, 28), np.linspace(0.92, 1.06, 29)])
SPATIAL, L = 0.5, 64


def table(values):
    return "{ " + ", ".join(f"{k} = {v!r}".replace("'", '"') for k, v in values.items()) + " }"


class Camera:
    def __init__(self, program, folder):
        self.program, self.folder, self.frame = program, folder, 0
        with open(folder / "log.csv", "w", newline="") as out:
            rows = csv.writer(out)
            rows.writerow(["t_s", "lat_deg", "lon_deg", "alt_m", "roll_deg", "pitch_deg", "yaw_deg"])
            rows.writerows([t, 46.7, 9.85, 2100.0, 0.0, 0.0, 0.0] for t in (0.0, 5.0, 10.0))
        Image.new("L", (4, 4)).save(folder / "none.png")
        (folder / "flat.toml").write_text(f"""seed = 20261127
[flight]
log = "log.csv"
format = "csv-lla"
[tracker]
kind = "linear"
[camera]
size_px = {list(SIZE)}
fps = 100
mount = {{ angles_deg = [0, 90, 0] }}
sensor = {table(SENSOR)}
[scene]
pattern = {{ image = "none.png", width_m = 10 }}
[output]
channels = ["raw"]
format = ["png"]
""")

    def take(self, level, exposure_ms, count):
        """Raw pictures of a sky of this linear level."""
        out = self.folder / f"out{self.frame}"
        frames = range(self.frame, self.frame + count)
        self.frame += count
        command = [
            self.program, "render", self.folder / "flat.toml", "-o", out, "--frames", f"{frames.start}..{frames.stop}", "--backend", "cpu",
            "--set", f"scene.sky=[{level}, {level}, {level}]", "--set", f"camera.sensor.white_w_m2={W_M2!r}",
            "--set", f"camera.sensor.exposure_ms={exposure_ms}",
        ]
        subprocess.run([str(word) for word in command], check=True, capture_output=True)
        return [out / "raw" / f"frame_{frame:06}.png" for frame in frames]


def stacks(camera):
    temporal = {}
    for share in STEPS:
        ms = round(FULL_MS * share, 4)
        temporal[ms * 1e6] = {0.0: camera.take(0, ms, 2), PHOTONS_MS * ms: camera.take(1, ms, 2)}
    ms = FULL_MS * SPATIAL
    spatial = {ms * 1e6: {0.0: camera.take(0, ms, L), PHOTONS_MS * ms: camera.take(1, ms, L)}}
    return {"temporal": temporal, "spatial": spatial}


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        camera = Camera(sys.argv[1], pathlib.Path(folder))
        images = stacks(camera)
        loaded = LoadImageData(images, fload=lambda path: np.asarray(Image.open(path)))
        found = Results1288(Data1288(loaded.data).data, pixel_area=3.45**2)
    rows = [
        ("system gain K", "DN/e-", 1 / E_PER_DN, found.K),
        ("quantum efficiency", "%", 100 * QE, found.QE),
        ("temporal dark noise", "e-", READ_E, found.sigma_d),
        ("saturation capacity", "e-", FULL_E, found.u_e_sat),
        ("dark current, by mean", "e-/s", DARK_E_S, found.u_I_mean),
        ("dark current, by variance", "e-/s", DARK_E_S, found.u_I_var),
        ("DSNU1288", "e-", DSNU_E, found.DSNU1288),
        ("PRNU1288", "%", 100 * PRNU, found.PRNU1288),
    ]
    print("| figure | unit | given | found | off |\n|---|---|---|---|---|")
    worst = 0.0
    for name, unit, given, value in rows:
        off = 100 * (value / given - 1)
        worst = max(worst, abs(off))
        print(f"| {name} | {unit} | {given:.5g} | {value:.5g} | {off:+.2f} % |")
    linearity = max(abs(found.LE_min), abs(found.LE_max))
    print(f"| linearity error | % | 0 | {linearity:.3f} | {linearity:.3f} % |")
    packages = ", ".join(f"{package} {version(package)}" for package in ("emva1288", "numpy", "pillow"))
    print(f"\nworst: {worst:.2f} %; linearity {linearity:.3f} %; {camera.frame} pictures of {SIZE[0]}x{SIZE[1]}; {packages}")
    return 0 if worst < 2 and linearity < 0.5 else 1


if __name__ == "__main__":
    sys.exit(main())
