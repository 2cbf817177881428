#!/usr/bin/env python3
"""Goldens of the lens models: forward by OpenCV, inverse by brute force.

Reads tests/data/lens_sets.csv, writes tests/data/lens_opencv_forward.csv and tests/data/lens_inverse.csv.
Made with cv2 5.0.0 (opencv-python-headless) and numpy 2.4; any version of either should give the same digits to 1e-12.

    pip install opencv-python-headless numpy
    python3 scripts/goldens/lens_opencv.py

The inverse shares nothing with the library's: the border of the principal branch comes from finite differences of OpenCV's forward
function on a dense polar grid, and the pre-image from a pattern search over that grid (no Newton, no fixed point).
"""

import csv
import pathlib
import sys

import cv2
import numpy as np

DATA = pathlib.Path(__file__).resolve().parents[2] / "tests" / "data"
MAX_FIELD = np.radians(89.0)
RAYS, STEPS = 720, 700


def forward(model, k, uv):
    """Ideal -> distorted normalised coordinates, f64."""
    uv = np.ascontiguousarray(uv, dtype=np.float64).reshape(-1, 1, 2)
    eye, zero = np.eye(3), np.zeros(3)
    if model == "kannala-brandt":
        return cv2.fisheye.distortPoints(uv, eye, np.resize(np.append(k, np.zeros(4)), 4)).reshape(-1, 2)
    xyz = np.concatenate([uv, np.ones_like(uv[..., :1])], axis=2)
    full = np.zeros(8)
    full[: len(k)] = k
    return cv2.projectPoints(xyz, zero, zero, eye, full)[0].reshape(-1, 2)


def polar(r, phi):
    return np.stack([r * np.cos(phi), r * np.sin(phi)], axis=-1)


def determinant(model, k, r, phi):
    """det J by central differences, in polar coordinates (r > 0)."""
    shape = np.broadcast(r, phi).shape
    r, phi = np.broadcast_to(r, shape).ravel(), np.broadcast_to(phi, shape).ravel()
    h = 1e-6 * (1.0 + r)
    d_r = (forward(model, k, polar(r + h, phi)) - forward(model, k, polar(r - h, phi))) / (2 * h)[:, None]
    g = 1e-6
    d_phi = (forward(model, k, polar(r, phi + g)) - forward(model, k, polar(r, phi - g))) / (2 * g * r)[:, None]
    return (d_r[:, 0] * d_phi[:, 1] - d_r[:, 1] * d_phi[:, 0]).reshape(shape)


def pole(model, k):
    """Radius of the first zero of a rational lens's denominator; beyond, the determinant may be positive again."""
    below = np.append(k[5:8], np.zeros(3))[:3] if model == "brown-conrady" else np.zeros(3)
    roots = np.roots([*below[::-1], 1.0])
    real = roots[np.abs(roots.imag) < 1e-12].real
    return np.sqrt(min(real[real > 0.0], default=np.inf))


def branch(model, k):
    """Polar grid (radii, angles), its image, and which of its points lie before the first fold of their ray."""
    radii = np.tan(np.linspace(0.0, MAX_FIELD, STEPS + 1)[1:])
    angles = np.arange(RAYS) * 2 * np.pi / RAYS
    grid_r, grid_phi = np.meshgrid(radii, angles, indexing="ij")
    det = determinant(model, k, grid_r, grid_phi)
    regular = np.logical_and.accumulate((det > 0.0) & (grid_r < pole(model, k)), axis=0)
    image = forward(model, k, polar(grid_r.ravel(), grid_phi.ravel())).reshape(grid_r.shape + (2,))
    return radii, angles, image, regular


def before_fold(model, k, r, phi):
    """Whether det J stays positive from the axis to (r, phi), on 400 radii."""
    return r < pole(model, k) and bool((determinant(model, k, np.linspace(r / 400, r * (1 - 1e-7), 400), phi) > 0.0).all())


def search(model, k, prepared, target):
    """Pre-image on the principal branch and its residual, by refining the best cells of the grid."""
    radii, angles, image, regular = prepared
    distance = np.where(regular, np.linalg.norm(image - target, axis=2), np.inf)
    best = (np.inf, None)
    candidates = np.argsort(distance, axis=None)[:400:57]
    for flat in candidates:
        i, j = np.unravel_index(flat, distance.shape)
        if not np.isfinite(distance[i, j]):
            continue
        centre_theta, centre_phi = np.arctan(radii[i]), angles[j]
        box_theta, box_phi = 2 * MAX_FIELD / STEPS, 4 * np.pi / RAYS
        offsets = np.linspace(-1.0, 1.0, 9)
        residual = np.inf
        for _ in range(75):
            theta = np.clip(centre_theta + box_theta * offsets, 0.0, min(MAX_FIELD, np.arctan(pole(model, k))))
            phi = centre_phi + box_phi * offsets
            t, p = np.meshgrid(theta, phi, indexing="ij")
            errors = np.linalg.norm(forward(model, k, polar(np.tan(t).ravel(), p.ravel())) - target, axis=1)
            at = int(np.argmin(errors))
            residual, centre_theta, centre_phi = errors[at], t.ravel()[at], p.ravel()[at]
            box_theta, box_phi = 0.6 * box_theta, 0.6 * box_phi
        r = np.tan(centre_theta)
        if residual < best[0] and (r < 1e-9 or before_fold(model, k, r, centre_phi)):
            best = (residual, polar(r, centre_phi))
        if best[0] < 1e-12:
            break
    return best


def main():
    print(f"cv2 {cv2.__version__}, numpy {np.__version__}", file=sys.stderr)
    random = np.random.default_rng(20)
    with open(DATA / "lens_sets.csv", newline="") as file:
        sets = list(csv.DictReader(file))
    forward_rows, inverse_rows, skipped = [], [], 0
    for row in sets:
        model, k = row["model"], np.array([float(x) for x in row["coefficients"].split()])
        width, height, fx, fy, cx, cy = (float(row[key]) for key in ("width", "height", "fx", "fy", "cx", "cy"))
        pixels = np.array([[x * (width - 1), y * (height - 1)] for x in (0.0, 0.31, 0.77, 1.0) for y in (0.0, 0.46, 1.0)])
        wanted = (pixels - [cx, cy]) / [fx, fy]
        reach = min(np.linalg.norm(wanted, axis=1).max(), 3.0)
        uv = polar(1.2 * reach * np.sqrt(random.random(10)), random.random(10) * 2 * np.pi)
        uv[0] = 0.0
        for (u, v), (x, y) in zip(uv, forward(model, k, uv)):
            forward_rows.append([row["name"], repr(float(u)), repr(float(v)), repr(float(x)), repr(float(y))])
        prepared = branch(model, k)
        for x, y in wanted:
            residual, ideal = search(model, k, prepared, np.array([x, y]))
            if residual < 1e-11:
                inverse_rows.append([row["name"], repr(float(x)), repr(float(y)), repr(float(ideal[0])), repr(float(ideal[1])), 1])
            elif residual > 1e-4:
                inverse_rows.append([row["name"], repr(float(x)), repr(float(y)), "", "", 0])
            else:
                skipped += 1  # too close to a fold for a search to decide
    for name, header, rows in (
        ("lens_opencv_forward.csv", "set,u,v,x,y", forward_rows),
        ("lens_inverse.csv", "set,x,y,u,v,valid", inverse_rows),
    ):
        with open(DATA / name, "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header.split(","))
            writer.writerows(rows)
    print(f"{len(forward_rows)} forward, {len(inverse_rows)} inverse points, {skipped} skipped", file=sys.stderr)


if __name__ == "__main__":
    main()
