#!/usr/bin/env python3
"""camsim.Lens against OpenCV, in turns: time and error of a million points from pixels to ideal points.

pip install numpy opencv-python-headless; PYTHONPATH=python python scripts/python_lens.py
OpenCV is timed with its own number of iterations, which leaves errors on wide lenses, and with as many as reach its best.
"""

import sys
import time

import cv2
import numpy as np

import camsim

POINTS = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
TURNS = 5
BROWN = [-0.28, 0.07, 0.0006, -0.0004]
LENSES = {
    "pinhole": [],
    "brown-conrady, 4": BROWN,
    "brown-conrady, 5": [*BROWN, -0.006],
    "brown-conrady, 8": [*BROWN, -0.006, 0.01, 0.002, -0.001],
    "brown-conrady-prism, 12": [*BROWN, -0.006, 0.01, 0.002, -0.001, 1e-3, -4e-4, 2e-3, 3e-4],
    "brown-conrady-prism, 14": [*BROWN, -0.006, 0.01, 0.002, -0.001, 1e-3, -4e-4, 2e-3, 3e-4, 0.01, -0.02],
    "kannala-brandt": [-0.02, 0.004, -0.003, 0.0005],
}
ENDS = {"default": None, "100 steps": (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-13)}


def timed_ms(work):
    begin = time.perf_counter()
    made = work()
    return 1e3 * (time.perf_counter() - begin), made


def by_opencv(model, pixels, matrix, k, criteria):
    """The function of OpenCV for a model."""
    undistort = cv2.fisheye.undistortPoints if model == "kannala-brandt" else cv2.undistortPoints
    named = {} if criteria is None else {"criteria": criteria}
    return lambda: undistort(pixels.reshape(-1, 1, 2), matrix, k, **named).reshape(-1, 2)


def off_px(model, ideal, pixels, matrix, k):
    """Largest distance by OpenCV's own forward formula."""
    project = cv2.fisheye.projectPoints if model == "kannala-brandt" else cv2.projectPoints
    rays = np.c_[ideal, np.ones(len(ideal))].reshape(-1, 1, 3)
    back = project(rays, np.zeros(3), np.zeros(3), matrix, k)[0].reshape(-1, 2)
    return np.linalg.norm(back - pixels, axis=1).max()


print(f"{'':24}      camsim              OpenCV, default              OpenCV, 100 steps")
print(f"{'lens':24} {'ms':>7} {'off, px':>9}   {'ms':>7} {'off, px':>9} {'ratio':>6}   {'ms':>7} {'off, px':>9} {'ratio':>6}")
for name, coefficients in LENSES.items():
    model = name.split(",")[0]
    lens = camsim.Lens((640, 480), (420.0, 421.0), (318.3, 241.2), model=model, coefficients=coefficients)
    pixels = np.random.default_rng(1).uniform([0.0, 0.0], [639.0, 479.0], (POINTS, 2))
    k = np.array(coefficients) if coefficients else np.zeros(4)
    methods = {"camsim": lambda: lens.undistort(pixels)}
    methods |= {end: by_opencv(model, pixels, lens.matrix, k, criteria) for end, criteria in ENDS.items()}
    times = {method: [] for method in methods}
    made = {}
    for _ in range(TURNS):
        for method, work in methods.items():
            ms, made[method] = timed_ms(work)
            times[method].append(ms)
    own_ms = min(times["camsim"])
    off = {method: off_px(model, ideal, pixels, lens.matrix, k) for method, ideal in made.items()}
    line = f"{name:24} {own_ms:7.1f} {off['camsim']:9.1e}"
    for end in ENDS:
        cv_ms = min(times[end])
        line += f"   {cv_ms:7.1f} {off[end]:9.1e} {cv_ms / own_ms:6.1f}"
    print(line)
