#!/usr/bin/env python3
"""camsim.Lens against OpenCV, in turns: time and error of a million points from pixels to ideal points and back.

pip install numpy opencv-python-headless; PYTHONPATH=python python scripts/python_lens.py
"""

import time

import cv2
import numpy as np

import camsim

POINTS = 1_000_000
TURNS = 3
LENSES = {
    "brown-conrady, 5": [-0.28, 0.07, 0.0006, -0.0004, -0.006],
    "brown-conrady, 8": [-0.28, 0.07, 0.0006, -0.0004, -0.006, 0.01, 0.002, -0.001],
    "kannala-brandt": [-0.02, 0.004, -0.003, 0.0005],
}


def best_ms(work):
    """The shortest of one call."""
    begin = time.perf_counter()
    made = work()
    return 1e3 * (time.perf_counter() - begin), made


print("lens               OpenCV, ms   camsim, ms   ratio   OpenCV off by, px   camsim off by, px")
for name, coefficients in LENSES.items():
    model = name.split(",")[0]
    lens = camsim.Lens((640, 480), (420.0, 421.0), (318.3, 241.2), model=model, coefficients=coefficients)
    pixels = np.random.default_rng(1).uniform([0.0, 0.0], [639.0, 479.0], (POINTS, 2))
    k = np.array(coefficients)
    undistort = cv2.fisheye.undistortPoints if model == "kannala-brandt" else cv2.undistortPoints
    theirs = ours = None
    times = [[], []]
    for _ in range(TURNS):
        ms, theirs = best_ms(lambda: undistort(pixels.reshape(-1, 1, 2), lens.matrix, k).reshape(-1, 2))
        times[0].append(ms)
        ms, ours = best_ms(lambda: lens.undistort(pixels))
        times[1].append(ms)
    # Both are judged by OpenCV's own forward formula.
    project = cv2.fisheye.projectPoints if model == "kannala-brandt" else cv2.projectPoints
    off_px = []
    for ideal in (theirs, ours):
        rays = np.c_[ideal, np.ones(POINTS)].reshape(-1, 1, 3)
        back = project(rays, np.zeros(3), np.zeros(3), lens.matrix, k)[0].reshape(-1, 2)
        off_px.append(np.linalg.norm(back - pixels, axis=1).max())
    cv_ms, own_ms = map(min, times)
    print(f"{name:18} {cv_ms:10.0f}   {own_ms:10.0f}   {cv_ms / own_ms:5.1f}   {off_px[0]:17.2e}   {off_px[1]:17.2e}")
