#!/usr/bin/env python3
"""OpenCV calibrates a double sphere, a 14-parameter and a Kannala-Brandt lens from camsim's pictures of a chessboard. Are they those of the scenario?

    pip install opencv-python-headless pycolmap numpy
    python3 scripts/judges/lens_calibration.py camsim [--pictures FOLDER] [--page docs/results/lens-calibration.md]

For each lens 40 poses that together show the board all over the picture. OpenCV finds the corners and calibrates; a double sphere by `cv2.fisheye`, whose
Kannala-Brandt polynomial cannot hold it exactly. The coefficients of such polynomials trade with one another, so what is compared is where they image rays:
on a grid of the pixels that corners cover. The true pixels are those of formulas in numpy or of cv2.projectPoints, not camsim's. Made with
OpenCV 5.0.0, numpy 2.4.
"""

import argparse
import csv
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile

import cv2
import numpy as np
from common import check, finish, versions

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "goldens"))
from board_opencv import board_points, find, rotation  # noqa: E402
from lens_models import by_opencv, double_sphere, kannala_brandt, matrix  # noqa: E402

POSES, CANDIDATES = 40, 60
COLUMNS, ROWS, SQUARE_M = 9, 6, 0.065
# The detector wants to see part of the outer squares, and some pixels between corners.
RIM_PX, LEAST_PX = 14.0, 13.0
WIDEST = np.radians(80.0)
CELL_PX = 24
# Corners are wrong by less than 0.1 px, which the mean of many makes less; more at the border of the picture.
MOST_RMS_PX, MOST_PX = 0.05, 0.2
SCENARIO = """[flight]
log = "poses.csv"
format = "csv-ned"
[tracker]
kind = "hold"
[camera]
size_px = [{width}, {height}]
focal_px = [{fx}, {fy}]
principal_point_px = [{cx}, {cy}]
fps = 1.0
phase = 0.5
lens = {{ model = "{model}", coefficients = {k} }}
photometric = {{ output = "luma8" }}
[scene]
board = {{ kind = "chessboard", columns = {columns}, rows = {rows}, size_m = {square}, at = "origin", angles_deg = [0, 90, 0] }}
sky = [0.5, 0.5, 0.5]
[output]
channels = ["color"]
format = ["png"]
"""


def lens(name, model, size, focal, centre, k, project):
    (width, height), (fx, fy), (cx, cy) = size, focal, centre
    return dict(name=name, model=model, width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy, k=k, project=project)


LENSES = [
    # basalt's calibration of TUM-VI's cam0.
    lens("double sphere", "double-sphere", (512, 512), (158.28600034966977, 158.2743455478755), (254.96116578191653, 256.8894394501779),
         [-0.17213086034353243, 0.5931177593944744], double_sphere),
    lens("14 parameters", "brown-conrady-prism", (752, 480), (458.654, 457.296), (367.215, 248.375),
         [0.3, 0.02, 4e-4, -3e-4, 0.002, 0.55, 0.06, 0.004, 2e-3, -5e-4, -1e-3, 4e-4, 0.03, -0.02], by_opencv),
    # Kalibr's calibration of the left camera of UZH-FPV.
    lens("Kannala-Brandt", "kannala-brandt", (640, 480), (278.66723066149086, 278.48991409740296), (319.75221200593535, 241.96858910358173),
         [-0.013721808247486035, 0.020727425669427896, -0.012786476702685545, 0.0025242267320687625], kannala_brandt),
]


def is_fisheye(c):
    return c["model"] != "brown-conrady-prism"


NOTES = """Pairs are RMS and largest distance. A found lens is compared where it images the rays of every fourth pixel, in rows and columns, of the cells of
24 px in which there were corners.

*Turned*: the poses of a calibration take up any turn of the camera about its position, so a lens is known but for that. The axis of a fisheye is its centre
of symmetry, and is found. Tilt, prism and tangential terms trade with the principal point: the 14 parameters are judged after the turn that makes the
differences least. Focal length and principal point of the double sphere are compared with those of the nearest Kannala-Brandt lens.

The last row but one shows OpenCV with corners that are exact: what is left there is that a double sphere is no Kannala-Brandt lens. The rest is the
detector's error of a corner, averaged over 2160 of them.
"""


# Poses.

NED_FROM_BOARD = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def angles_of(ned_from_camera):
    """Roll, pitch, yaw in degrees of a camera that looks along the nose."""
    turn = ned_from_camera @ rotation(0.0, 0.0, 0.0).T
    return np.degrees([np.arctan2(turn[2, 1], turn[2, 2]), -np.arcsin(np.clip(turn[2, 0], -1, 1)), np.arctan2(turn[1, 0], turn[0, 0])])


def random_pose(random, c):
    """A camera before the board; the board's middle may be anywhere in the picture, up to 40 degrees from facing the camera."""
    reach = 1.3 * np.hypot(c["width"] / c["fx"], c["height"] / c["fy"]) / 2
    theta, phi = min(reach, WIDEST) * np.sqrt(random.random()), random.uniform(0, 2 * np.pi)
    axis = np.array([-np.sin(phi), np.cos(phi), 0.0])
    ray = cv2.Rodrigues(theta * axis)[0]
    tilt = cv2.Rodrigues(np.radians(random.uniform(15, 40)) * np.append(unit(random), 0.0))[0]
    roll = cv2.Rodrigues(np.array([0.0, 0.0, np.radians(random.uniform(-30, 30))]))[0]
    camera_from_board = ray @ tilt @ roll
    ned_from_camera = NED_FROM_BOARD @ camera_from_board.T
    position = -ned_from_camera @ ray[:, 2] * random.uniform(0.25, 0.7) * c["fx"] / 300
    # As the file holds it.
    return np.round(position, 6), np.round(angles_of(ned_from_camera), 5)


def unit(random):
    phi = random.uniform(0, 2 * np.pi)
    return np.array([np.cos(phi), np.sin(phi)])


def in_camera(points, pose):
    position, angles = pose
    return (points @ NED_FROM_BOARD.T - position) @ rotation(*np.radians(angles))


def corners_of(c, points, pose):
    """True pixels of the corners; `None` where the detector has too little to see."""
    rays = in_camera(points, pose)
    if np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]).max() > WIDEST:
        return None
    px = c["project"](c, rays)
    grid = px.reshape(ROWS, COLUMNS, 2)
    apart = min(np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1))
    inside = px.min() > RIM_PX and (px < np.array([c["width"], c["height"]]) - 1 - RIM_PX).all()
    return px if inside and apart > LEAST_PX else None


def cells(px):
    return set(map(tuple, (px // CELL_PX).astype(int)))


def make_poses(c, points, seed):
    """Of some random poses that show the whole board each time the one that shows it in most new positions."""
    random, poses, covered = np.random.default_rng(seed), [], set()
    while len(poses) < POSES:
        found = []
        while len(found) < CANDIDATES:
            pose = random_pose(random, c)
            px = corners_of(c, points, pose)
            if px is not None:
                found.append((len(cells(px) - covered), len(found), pose, px))
        _, _, pose, px = max(found, key=lambda candidate: candidate[:2])
        poses.append((pose, px))
        covered |= cells(px)
    return poses, covered


# Pictures.


def render(program, c, poses, folder):
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "poses.csv", "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["t_s", "n_m", "e_m", "d_m", "roll_deg", "pitch_deg", "yaw_deg"])
        # One more, so that the last frame, half a second on, is inside the log.
        for i, ((position, angles), _) in enumerate(poses + poses[-1:]):
            out.writerow([i, *(f"{x:.6f}" for x in position), *(f"{a:.5f}" for a in angles)])
    (folder / "scenario.toml").write_text(SCENARIO.format(columns=COLUMNS, rows=ROWS, square=SQUARE_M, **c))
    command = [program] if shutil.which(program) else shlex.split(program)
    subprocess.run([*command, "render", folder / "scenario.toml", "-o", folder / "run", "--quiet"], check=True)
    return [cv2.imread(str(folder / f"run/color/frame_{i:06}.png"), cv2.IMREAD_GRAYSCALE) for i in range(len(poses))]


# Calibration.


def calibrate(c, points, corners):
    """Reprojection RMS and camera that OpenCV finds."""
    size, positions = (c["width"], c["height"]), [points.reshape(1, -1, 3)] * len(corners)
    corners = [px.reshape(1, -1, 2) for px in corners]
    if is_fisheye(c):
        # OpenCV 4 has them in cv2.fisheye.
        flags = sum(getattr(cv2.fisheye, name, None) or getattr(cv2, name) for name in ("CALIB_RECOMPUTE_EXTRINSIC", "CALIB_FIX_SKEW"))
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 300, 1e-12)
        rms, K, k, *_ = cv2.fisheye.calibrate(positions, corners, size, None, None, flags=flags, criteria=stop)
        return rms, camera_of(c, K, k, kannala_brandt)
    flags = cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL | cv2.CALIB_TILTED_MODEL
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 1000, 1e-14)
    positions, corners = ([value.astype(np.float32) for value in values] for values in (positions, corners))
    rms, K, k, *_ = cv2.calibrateCamera(positions, corners, size, None, None, flags=flags, criteria=stop)
    return rms, camera_of(c, K, k, by_opencv)


def camera_of(c, K, k, project):
    return {**c, "fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2], "k": k.ravel()[:14].tolist(), "project": project}


# Comparison.


def rays_of(c, px):
    """Rays of pixels by Newton steps on the true projection, in the plane of angles: (t cos phi, t sin phi)."""
    at = (px - [c["cx"], c["cy"]]) / [c["fx"], c["fy"]]
    for _ in range(60):
        h = 1e-6
        image = c["project"](c, bent(at))
        columns = [(c["project"](c, bent(at + h * axis)) - c["project"](c, bent(at - h * axis))) / (2 * h) for axis in np.eye(2)]
        step = np.linalg.solve(np.stack(columns, axis=2), (px - image)[..., None])[..., 0]
        length = np.linalg.norm(step, axis=1, keepdims=True)
        at = at + step * np.minimum(1.0, 0.2 / np.maximum(length, 1e-300))
    rays = bent(at)
    assert np.abs(c["project"](c, rays) - px).max() < 1e-6
    return rays


def bent(at):
    t = np.linalg.norm(at, axis=1, keepdims=True)
    return np.hstack([at * np.sinc(t / np.pi), np.cos(t)])


def turned(camera, rays, truth):
    """Differences in px after the turn of the camera that makes them least: the poses of a calibration take up any turn."""
    turn = np.zeros(3)
    off = lambda turn: camera["project"](camera, rays @ cv2.Rodrigues(turn)[0].T) - truth  # noqa: E731
    for _ in range(20):
        now, h = off(turn), 1e-6
        slope = np.stack([(off(turn + h * axis) - now).ravel() / h for axis in np.eye(3)], axis=1)
        turn = turn - np.linalg.lstsq(slope, now.ravel(), rcond=None)[0]
    return off(turn), np.degrees(np.linalg.norm(turn))


def kannala_brandt_fit(c, rays, truth):
    """The Kannala-Brandt lens nearest to a double sphere on these pixels, by linear least squares: f, f k1 .. f k4 about its own centre."""
    across = np.hypot(rays[:, 0], rays[:, 1])
    t, axis = np.arctan2(across, rays[:, 2]), rays[:, :2] / across[:, None]
    powers = np.stack([t ** (2 * i + 1) for i in range(5)], axis=1)
    stretched = (truth - [c["cx"], c["cy"]]) / [1.0, c["fy"] / c["fx"]]
    f = np.linalg.lstsq((powers[:, None, :] * axis[:, :, None]).reshape(-1, 5), stretched.ravel(), rcond=None)[0]
    return {**c, "fx": f[0], "fy": f[0] * c["fy"] / c["fx"], "k": (f[1:] / f[0]).tolist(), "project": kannala_brandt}


def rms(differences):
    return float(np.sqrt((differences**2).sum(1).mean()))


def most(differences):
    return float(np.linalg.norm(differences, axis=1).max())


def judge(program, c, folder, seed):
    points = board_points(dict(columns=COLUMNS, rows=ROWS, size_m=SQUARE_M))
    poses, covered = make_poses(c, points, seed)
    pictures = render(program, c, poses, folder)
    exact = [px for _, px in poses]
    found = [find(picture, COLUMNS, ROWS, px) for picture, px in zip(pictures, exact)]
    seen = [i for i, corners in enumerate(found) if corners is not None]
    off = np.concatenate([found[i] - exact[i] for i in seen])
    everywhere = np.array([[x, y] for x in range(0, c["width"], 4) for y in range(0, c["height"], 4)], dtype=float)
    truth = np.array([px for px in everywhere if tuple((px // CELL_PX).astype(int)) in covered])
    rays = rays_of(c, truth)
    reprojection, camera = calibrate(c, points, [found[i] for i in seen])
    _, by_exact = calibrate(c, points, exact)
    nearest = kannala_brandt_fit(c, rays, truth) if c["model"] == "double-sphere" else None
    return dict(
        c=c, seen=len(seen), covered=100 * len(truth) / len(everywhere), off=off, reprojection=reprojection, camera=camera, by_exact=by_exact,
        nearest=nearest, rays=rays, truth=truth, widest=np.degrees(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]).max()),
    )


def differences(j, camera):
    return camera["project"](camera, j["rays"]) - j["truth"]


def pair(values):
    return f"{rms(values):.4f}, {most(values):.4f}"


def table(judged):
    """Rows of Markdown: what, and a cell for each lens."""
    def off(keys):
        wanted = [(j["nearest"] or j["c"], j["camera"]) for j in judged]
        return [", ".join(f"{camera[key] - true[key]:+.3f}" for key in keys) for true, camera in wanted]

    turns = [turned(j["camera"], j["rays"], j["truth"]) for j in judged]
    return [
        ["lens", *(f"{j['c']['name']}, {j['c']['width']}x{j['c']['height']}" for j in judged)],
        ["found by", *("`cv2.fisheye.calibrate`" if is_fisheye(j["c"]) else "`cv2.calibrateCamera`" for j in judged)],
        ["pictures with all corners", *(f"{j['seen']} of {POSES}" for j in judged)],
        ["share of the picture that they cover", *(f"{j['covered']:.0f} %" for j in judged)],
        ["largest angle off axis there", *(f"{j['widest']:.0f} degrees" for j in judged)],
        ["corners of the detector against the true ones, px", *(pair(j["off"]) for j in judged)],
        ["reprojection RMS, px", *(f"{j['reprojection']:.4f}" for j in judged)],
        ["**found lens against the true one, px**", *(pair(differences(j, j["camera"])) for j in judged)],
        ["**the same, turned, px**", *(pair(values) for values, _ in turns)],
        ["that turn, degrees", *(f"{degrees:.4f}" for _, degrees in turns)],
        ["focal lengths off, px", *off(["fx", "fy"])],
        ["principal point off, px", *off(["cx", "cy"])],
        ["lens found from the true corners, turned, px", *(pair(turned(j["by_exact"], j["rays"], j["truth"])[0]) for j in judged)],
        ["nearest Kannala-Brandt lens against the true one, px", *(pair(differences(j, j["nearest"])) if j["nearest"] else "" for j in judged)],
    ]


def page(rows):
    head = [
        ["command", "`python3 scripts/judges/lens_calibration.py target/release/camsim --page docs/results/lens-calibration.md`"],
        ["data", f"{POSES} pictures of a chessboard of {COLUMNS}x{ROWS} inner corners for each lens, default quality, 8 bits"],
        ["truth", "formulas in numpy (`scripts/goldens/lens_models.py`), `cv2.projectPoints` for 14 parameters"],
        ["versions", f"OpenCV {cv2.__version__}, numpy {np.__version__}"],
    ]
    lines = ["# Lenses that OpenCV finds again", "", "| | |", "|---|---|", *(f"| {' | '.join(row)} |" for row in head), ""]
    lines += [f"| {' | '.join(rows[0])} |", "|---" * len(rows[0]) + "|", *(f"| {' | '.join(row)} |" for row in rows[1:])]
    return "\n".join(lines) + "\n\n" + NOTES


def verdict(j):
    name = j["c"]["name"]
    check(f"{name}: pictures without corners", POSES - j["seen"], 0)
    check(f"{name}: RMS of corners against the truth, px", rms(j["off"]), 0.1)
    # Prism, tilt and tangential terms trade with the principal point, and that with a turn of the camera.
    values = differences(j, j["camera"]) if is_fisheye(j["c"]) else turned(j["camera"], j["rays"], j["truth"])[0]
    check(f"{name}: RMS of the found lens against the true one, px", rms(values), MOST_RMS_PX)
    check(f"{name}: largest difference, px", most(values), MOST_PX)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("program")
    arguments.add_argument("--pictures", type=pathlib.Path, help="folder that keeps the pictures")
    arguments.add_argument("--page", type=pathlib.Path, help="file for the results")
    arguments = arguments.parse_args()
    versions("numpy")
    print(f"  OpenCV {cv2.__version__}")
    with tempfile.TemporaryDirectory() as work:
        folder = arguments.pictures or pathlib.Path(work)
        judged = [judge(arguments.program, c, folder / c["model"], seed) for seed, c in enumerate(LENSES)]
    for j in judged:
        verdict(j)
    if arguments.page:
        arguments.page.write_text(page(table(judged)))
    finish()


if __name__ == "__main__":
    main()
