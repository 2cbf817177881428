#!/usr/bin/env python3
"""Goldens of the lens models beside Brown-Conrady and Kannala-Brandt: pixels of rays by OpenCV, COLMAP and the papers' formulas.

Writes tests/data/lens_models.csv (the cameras) and tests/data/lens_models_forward.csv (x, y, z of a ray and its pixel). Reads the
calibrations of shared data/calib/other_models_real.csv, whose folder is the argument, and those of published_lenses.csv beside this
script, collected from public repositories: its last column says where from.

    pip install opencv-contrib-python-headless pycolmap numpy
    python3 scripts/goldens/lens_models.py DATA/calib

Made with cv2 4.14.0 (cv2.omnidir is only in opencv-contrib 4), pycolmap 4.2.1 and numpy 2.4; others should give the same digits to 1e-9 px.
Double sphere, UCM, f-theta and Kannala-Brandt beyond 90 degrees have no program here: their formulas are written out in Cartesian
coordinates, after arXiv 1807.08957 and the definitions in docs/reference/LENSES.md.
"""

import csv
import json
import pathlib
import sys

import cv2
import numpy as np
import pycolmap

DATA = pathlib.Path(__file__).resolve().parents[2] / "tests" / "data"
ZERO = np.zeros(3)


def matrix(c):
    return np.array([[c["fx"], 0.0, c["cx"]], [0.0, c["fy"], c["cy"]], [0.0, 0.0, 1.0]])


def by_opencv(c, rays):
    k = np.zeros(12 if len(c["k"]) <= 12 else 14)
    k[: len(c["k"])] = c["k"]
    return cv2.projectPoints(rays, ZERO, ZERO, matrix(c), k)[0].reshape(-1, 2)


def by_omnidir(c, rays):
    d = np.zeros((1, 4))
    d[0, : len(c["k"]) - 1] = c["k"][1:]
    points = np.ascontiguousarray(rays.reshape(-1, 1, 3))
    return cv2.omnidir.projectPoints(points, ZERO, ZERO, matrix(c), float(c["k"][0]), d)[0].reshape(-1, 2)


def by_colmap(name):
    def project(c, rays):
        # COLMAP's first pixel has its centre at (0.5, 0.5).
        parameters = [c["fx"], c["fy"], c["cx"] + 0.5, c["cy"] + 0.5, *c["k"]]
        if name == "EQUIRECTANGULAR":
            parameters = [c["width"], c["height"]]
        camera = pycolmap.Camera(model=name, width=int(c["width"]), height=int(c["height"]), params=parameters)
        images = [camera.img_from_cam(ray) for ray in rays]
        return np.array([[np.nan] * 2 if image is None else np.ravel(image) for image in images]) - 0.5

    return project


def pixels(c, x, y):
    return np.stack([c["fx"] * x + c["cx"], c["fy"] * y + c["cy"]], axis=1)


def double_sphere(c, rays):
    (x, y, z), (xi, alpha) = rays.T, c["k"]
    d1 = np.sqrt(x * x + y * y + z * z)
    shifted = xi * d1 + z
    below = alpha * np.sqrt(x * x + y * y + shifted * shifted) + (1 - alpha) * shifted
    return pixels(c, x / below, y / below)


def ucm(c, rays):
    (x, y, z), alpha = rays.T, c["k"][0]
    below = alpha * np.sqrt(x * x + y * y + z * z) + (1 - alpha) * z
    return pixels(c, x / below, y / below)


def angle_and_axis(rays):
    across = np.hypot(rays[:, 0], rays[:, 1])
    return np.arctan2(across, rays[:, 2]), rays[:, :2] / np.maximum(across, 1e-300)[:, None]


def kannala_brandt(c, rays):
    theta, axis = angle_and_axis(rays)
    k = np.zeros(4)
    k[: len(c["k"])] = c["k"]
    r = theta + sum(k[i] * theta ** (2 * i + 3) for i in range(4))
    return pixels(c, *(axis * r[:, None]).T)


def linear(c, axis, r):
    C, d, e = c["k"][5:8] if len(c["k"]) >= 8 else (1.0, 0.0, 0.0)
    x, y = (axis * r[:, None]).T
    return pixels(c, C * x + d * y, e * x + y)


def f_theta(c, rays):
    theta, axis = angle_and_axis(rays)
    return linear(c, axis, np.polyval([*c["k"][4::-1], 0.0], theta))


def f_theta_inverse(c, rays):
    """The smallest positive root of the polynomial, by numpy's companion matrix."""
    theta, axis = angle_and_axis(rays)
    r = []
    for t in theta:
        roots = np.roots([*c["k"][4::-1], -t])
        real = roots[np.abs(roots.imag) < 1e-9].real
        r.append(min(real[real >= -1e-12]))
    return linear(c, axis, np.array(r))


BY = {
    "brown-conrady-prism": (by_opencv, 1.2),
    "mei": (by_omnidir, 1.8),
    "fisheye624": (by_colmap("RAD_TAN_THIN_PRISM_FISHEYE"), 1.5),
    "eucm": (by_colmap("EUCM"), 1.5),
    "division": (by_colmap("DIVISION"), 1.4),
    "fov": (by_colmap("FOV"), 1.5),
    "equirectangular": (by_colmap("EQUIRECTANGULAR"), 3.1),
    "double-sphere": (double_sphere, 1.9),
    "ucm": (ucm, 1.9),
    "kannala-brandt": (kannala_brandt, 1.92),
    "f-theta": (f_theta, 1.2),
    "f-theta-inverse": (f_theta_inverse, 1.2),
}


def cameras(folder):
    """Cameras: name, model, size, fx, fy, cx, cy, coefficients, whether the calibration was published."""
    def camera(name, model, size, f, c, k, kind="made", source=""):
        (width, height), (fx, fy), (cx, cy) = size, f, c
        k = list(map(float, k))
        return dict(name=name, model=model, width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy, k=k, kind=kind, source=source)

    found = []
    with open(folder / "other_models_real.csv", newline="") as file:
        for row in csv.DictReader(file):
            size = (int(row["width"]), int(row["height"]))
            p = json.loads(row["parameters_json"])
            if row["model"] == "MEI":
                f, c = (p["gamma1"], p["gamma2"]), (p["u0"], p["v0"])
                found.append(camera(row["name"], "mei", size, f, c, [p[key] for key in ("xi", "k1", "k2", "p1", "p2")], "published", row["source"]))
            elif row["model"].startswith("double sphere"):
                f, c = (p["fx"], p["fy"]), (p["cx"], p["cy"])
                found.append(camera(row["name"], "double-sphere", size, f, c, [p["xi"], p["alpha"]], "published", row["source"]))
    # COLMAP's own test values (src/colmap/sensor/models_test.cc), which are a lens of Project Aria.
    aria = [-0.0232, 0.0924, -0.0591, 0.003, 0.0048, -0.0009, 0.0002, 0.0005, -0.0009, -0.0001, 0.00007, -0.00017]
    found.append(camera("colmap_test_aria", "fisheye624", (640, 480), (241.6, 241.6), (319.2, 240.7), aria, "published", "colmap/colmap src/colmap/sensor/models_test.cc"))
    euroc = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0, 0.0, 0.0, 0.0]
    k4a = [0.5, -2.6, 0.0008, -0.0003, 1.5, 0.38, -2.4, 1.4]
    for name, k in [
        ("euroc_with_prism", euroc + [1e-3, -4e-4, 2e-3, 3e-4]),
        ("euroc_tilted", euroc + [0.0, 0.0, 0.0, 0.0, 0.03, -0.02]),
        ("rational_prism_tilt", k4a + [5e-3, 1e-3, -4e-3, 2e-3, -0.06, 0.04]),
        ("strong_prism", [0.0] * 8 + [0.1, -0.05, -0.08, 0.03]),
        ("strong_tilt", [-0.1, 0.02, 0.01, -0.01] + [0.0] * 4 + [0.01, 0.0, -0.01, 0.0, 0.35, -0.3]),
    ]:
        found.append(camera(name, "brown-conrady-prism", (752, 480), (458.654, 457.296), (367.215, 248.375), k))
    strong = [-0.05, 0.02, -0.005, 0.001, 5e-4, 2e-4, -0.01, 0.02, 0.03, -0.01, 0.02, -0.01]
    found.append(camera("strong_624", "fisheye624", (640, 640), (220.0, 222.0), (318.0, 321.0), strong))
    for name, k in [("eucm_wide", [0.571, 1.18]), ("eucm_folds", [0.9, 0.5]), ("eucm_tele", [0.3, 1.5])]:
        found.append(camera(name, "eucm", (640, 480), (380.0, 381.0), (318.0, 241.0), k))
    for name, k in [("division_barrel", [-0.3]), ("division_strong", [-1.4]), ("division_pincushion", [0.1])]:
        found.append(camera(name, "division", (640, 480), (400.0, 398.0), (322.0, 238.0), k))
    for name, k in [("fov_ptam", [0.93]), ("fov_small", [0.1]), ("fov_wide", [1.8])]:
        found.append(camera(name, "fov", (640, 480), (300.0, 301.0), (318.0, 241.0), k))
    for name, k in [("ucm_fisheye", [0.6]), ("ucm_stereographic", [0.5]), ("ucm_narrow", [0.2])]:
        found.append(camera(name, "ucm", (640, 480), (330.0, 331.0), (318.0, 241.0), k))
    found.append(camera("panorama", "equirectangular", (720, 360), (360 / np.pi,) * 2, (359.5, 179.5), []))
    found.append(camera("kb_220_degrees", "kannala-brandt", (1000, 1000), (260.0, 260.0), (499.5, 499.5), [-0.02, 0.001, -2e-4, 1e-5]))
    polynomial = [1.0, -0.02, 0.01, -0.03, 0.002]
    found.append(camera("f_theta", "f-theta", (1920, 1208), (920.0, 920.0), (957.0, 605.0), polynomial))
    found.append(camera("f_theta_skewed", "f-theta", (1920, 1208), (920.0, 920.0), (957.0, 605.0), polynomial + [1.01, 0.002, -0.003]))
    inverse = [1.0, 0.02, -0.01, 0.03, -0.002]
    found.append(camera("f_theta_inverse", "f-theta-inverse", (1920, 1208), (920.0, 920.0), (957.0, 605.0), inverse + [0.99, 0.001, 0.002]))
    with open(pathlib.Path(__file__).with_name("published_lenses.csv"), newline="") as file:
        for row in csv.DictReader(file):
            fx, fy, cx, cy = (float(row[key]) for key in ("fx", "fy", "cx", "cy"))
            size, k = (int(row["width"]), int(row["height"])), row["coefficients"].split()
            found.append(camera(row["name"], row["model"], size, (fx, fy), (cx, cy), k, row["kind"], row["source"]))
    return found


def main():
    print(f"cv2 {cv2.__version__}, pycolmap {pycolmap.__version__}, numpy {np.__version__}", file=sys.stderr)
    random = np.random.default_rng(48)
    sets, rows = [], []
    for c in cameras(pathlib.Path(sys.argv[1])):
        project, widest = BY[c["model"]]
        if c["model"].startswith("f-theta") and len(c["k"]) == 9:
            widest = min(widest, c["k"][8])
        sets.append([c["name"], c["model"], *(repr(c[key]) for key in ("width", "height")), *(repr(float(c[key])) for key in ("fx", "fy", "cx", "cy")),
                     " ".join(repr(k) for k in c["k"]), c["kind"], c["source"]])
        theta, phi = widest * np.sqrt(random.random(24)), random.random(24) * 2 * np.pi
        length = 0.5 + 4.0 * random.random(24)
        rays = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1) * length[:, None]
        for ray, px in zip(rays, project(c, rays)):
            if np.isfinite(px).all():
                rows.append([c["name"], *(repr(float(value)) for value in (*ray, *px))])
    for name, header, lines in (
        ("lens_models.csv", "name,model,width,height,fx,fy,cx,cy,coefficients,kind,source", sets),
        ("lens_models_forward.csv", "set,x,y,z,x_px,y_px", rows),
    ):
        with open(DATA / name, "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header.split(","))
            writer.writerows(lines)
    print(f"{len(sets)} cameras, {len(rows)} rays", file=sys.stderr)


if __name__ == "__main__":
    main()
