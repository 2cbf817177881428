#!/usr/bin/env python3
"""EMVA 1288 release 4.0 on stacks of raw pictures, by the reference implementation `emva1288`: does it find the keys again?

    pip install emva1288 numpy
    cargo build --release -p camsim-core --example flat_fields
    python3 scripts/judges/emva.py target/release/examples/flat_fields

The program takes even light and darkness. The irradiance is constant and the exposure rises, two pictures a step; photons per pixel are worked out here, from
irradiance, area, wavelength and time. The spatial stacks have 64 pictures each. Every picture has a frame number of its own, so that no noise is used twice.
"""

import pathlib
import subprocess
import sys
import tempfile
from importlib.metadata import version

import numpy as np
from emva1288.process.data import Data1288
from emva1288.process.loader import LoadImageData
from emva1288.process.results import Results1288

# emva1288 1.0.2 calls it; NumPy 2 has it no more.
np.asfarray = lambda values: np.asarray(values, dtype=float)

SIZE = (640, 480)
E_PER_DN, QE, READ_E, FULL_E, DARK_E_S, DSNU_E, PRNU = 2.6, 0.6, 2.45, 40_000.0, 200.0, 3.0, 0.01
# The dark current is stated at 25 degrees and doubles twice.
SENSOR = dict(
    pixel_um=3.45, wavelength_nm=530, quantum_efficiency=QE, read_noise_e=READ_E, full_well_e=FULL_E, gain_e_per_dn=E_PER_DN,
    black_dn=64, bits=14, dark_current_e_s=DARK_E_S / 4, dark_doubling_c=8, temperature_c=41, dsnu_e=DSNU_E, prnu=PRNU,
)
FULL_MS = 20.0
# Full well at FULL_MS.
PHOTONS_MS = FULL_E / QE / FULL_MS
W_M2 = PHOTONS_MS * 1e3 / (3.45e-6**2) * 6.62607015e-34 * 299_792_458.0 / 530e-9
STEPS = np.concatenate([np.linspace(0.01, 0.9, 28), np.linspace(0.92, 1.06, 29)])
SPATIAL, L = 0.5, 64


class Camera:
    """Collects what is to be taken, and takes it."""

    def __init__(self, program, folder):
        self.program, self.folder, self.frame = program, folder, 0
        self.lines, self.stacks = [], []

    def take(self, level, exposure_ms, count):
        """Files of raw pictures of light of this level."""
        stack = self.folder / f"{self.frame}.stack"
        files = [str(self.folder / f"{self.frame + i}.u16") for i in range(count)]
        self.lines.append(f"{level} {exposure_ms} {self.frame} {count} {stack}\n")
        self.stacks.append((stack, files))
        self.frame += count
        return files

    def run(self):
        keys = [f"{key}={value!r}" for key, value in {**SENSOR, "white_w_m2": W_M2}.items()]
        command = [self.program, f"{SIZE[0]}x{SIZE[1]}", "20261127", *keys]
        subprocess.run(command, input="".join(self.lines), text=True, check=True)
        # The loader wants a file for each picture.
        for stack, files in self.stacks:
            for file, picture in zip(files, np.fromfile(stack, "<u2").reshape(len(files), -1), strict=True):
                picture.tofile(file)
            stack.unlink()


def picture(path):
    return np.fromfile(path, "<u2").reshape(SIZE[1], SIZE[0])


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
        camera.run()
        loaded = LoadImageData(images, fload=picture)
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
    packages = ", ".join(f"{package} {version(package)}" for package in ("emva1288", "numpy"))
    print(f"\nworst: {worst:.2f} %; linearity {linearity:.3f} %; {camera.frame} pictures of {SIZE[0]}x{SIZE[1]}; {packages}")
    return 0 if worst < 2 and linearity < 0.5 else 1


if __name__ == "__main__":
    sys.exit(main())
