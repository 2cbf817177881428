"""What the algorithms of `camsim study` share: the files of a run, and the result."""

import csv
import json
import math
import pathlib
import sys
import tomllib

import cv2
import numpy as np

DATA, RESULT = map(pathlib.Path, sys.argv[1:3])


def rows(name):
    with (DATA / name).open(newline="") as file:
        return list(csv.DictReader(file))


def frames():
    """The rows of frames.csv that have a picture."""
    return [row for row in rows("frames.csv") if row["color_png"]]


def grey(path):
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        sys.exit(f"{path}: is no picture")
    return picture


def tracks():
    """Exact positions by frame, then point: x, y in pixels, and whether nothing hides it."""
    found = {}
    for row in rows("tracks.csv"):
        found.setdefault(int(row["frame"]), {})[int(row["point"])] = (
            float(row["x_px"]),
            float(row["y_px"]),
            row["visible"] == "1",
        )
    return found


def points_ned_m():
    return {int(row["point"]): [float(row[name]) for name in ("n_m", "e_m", "d_m")] for row in rows("points.csv")}


def rotation(row):
    """Matrix of the quaternion in columns qw, qx, qy, qz."""
    w, x, y, z = (float(row[name]) for name in ("qw", "qx", "qy", "qz"))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def calibration():
    """Size, matrix, coefficients of cv2, and whether they are those of cv2.fisheye."""
    camera = tomllib.loads((DATA / "camera.toml").read_text())
    lens = camera.get("lens", {"model": "pinhole"})
    width, height = camera["size_px"]
    cx, cy = camera.get("principal_point_px", [(width - 1) / 2, (height - 1) / 2])
    fx, fy = camera["focal_px"]
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    coefficients = np.array(lens.get("coefficients", []), float)
    if lens["model"] not in ("pinhole", "brown-conrady", "kannala-brandt"):
        sys.exit(f"the lens model {lens['model']} is none of cv2: use pinhole, brown-conrady or kannala-brandt")
    is_fisheye = lens["model"] == "kannala-brandt"
    least = 4 if is_fisheye else 5
    coefficients = np.r_[coefficients, np.zeros(max(0, least - len(coefficients)))]
    return (width, height), matrix, coefficients, is_fisheye


def board_corners():
    """Frame by frame: its row, numbers of the board's points in it, and their pixels as cv2.cornerSubPix finds them from
    the exact ones on."""
    exact = tracks()
    for row in frames():
        seen = {point: at for point, at in exact.get(int(row["frame"]), {}).items() if at[2]}
        picture = grey(DATA / row["color_png"])
        height, width = picture.shape
        inside = {p: at for p, at in seen.items() if 8 <= at[0] < width - 8 and 8 <= at[1] < height - 8}
        if len(inside) < 8:
            continue
        start = np.array([at[:2] for at in inside.values()], np.float32)
        stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 40, 1e-3)
        found = cv2.cornerSubPix(picture, start[:, None].copy(), (4, 4), (-1, -1), stop)[:, 0]
        # Beyond its window it has found another corner.
        near = np.linalg.norm(found - start, axis=1) < 4
        yield row, np.array(list(inside))[near], found[near]


def pairs_with_flow():
    """Picture after picture of the layout flo: a picture, the next one, the exact flow from the one to the other, and the
    pixels at which it is known and the next picture shows the same."""
    training = DATA / "training"
    for flow in sorted(training.glob("flow/*/*.flo")):
        scene, name = flow.parent.name, flow.with_suffix(".png").name
        pictures = sorted((training / "final" / scene).glob("*.png"))
        following = [path for path in pictures if path.name > name]
        if not following:
            continue
        true = cv2.readOpticalFlow(str(flow))
        valid = np.isfinite(true).all(axis=2)
        for kind in ("invalid", "occlusions"):
            mask = training / kind / scene / name
            if mask.exists():
                valid &= grey(mask) == 0
        yield grey(training / "final" / scene / name), grey(following[0]), true, valid


def write(**numbers):
    """The result: NaN becomes null, which JSON has."""
    clean = {name: float(value) if math.isfinite(value) else None for name, value in numbers.items()}
    RESULT.write_text(json.dumps(clean, indent=1) + "\n")


def spread(prefix, values, unit):
    """Median, root mean square and 90th percentile."""
    values = np.asarray(values, float)
    if len(values) == 0:
        return dict.fromkeys([f"{prefix}_{what}_{unit}" for what in ("median", "rms", "p90")], math.nan)
    return {
        f"{prefix}_median_{unit}": np.median(values),
        f"{prefix}_rms_{unit}": np.sqrt(np.mean(values**2)),
        f"{prefix}_p90_{unit}": np.percentile(values, 90),
    }
