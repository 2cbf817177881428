"""Arranges what scripts/pictures.sh has rendered: draw.py WORK PICTURES."""

import csv
import json
import pathlib
import sys
import tomllib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import OpenEXR
from PIL import Image

WORK, PICTURES = map(pathlib.Path, sys.argv[1:3])
plt.rcParams.update({"font.size": 8, "figure.constrained_layout.use": True, "image.interpolation": "antialiased"})


def picture(path):
    """A PNG over white, where it is transparent."""
    rgba = Image.open(WORK / path).convert("RGBA")
    return Image.alpha_composite(Image.new("RGBA", rgba.size, "white"), rgba).convert("RGB")


def planes(path):
    """The channels of an EXR file, by name."""
    with OpenEXR.File(str(WORK / path), separate_channels=True) as file:
        return {name: channel.pixels.copy() for name, channel in file.channels().items()}


def table(path):
    with (WORK / path).open() as file:
        return list(csv.DictReader(file))


def columns(path):
    """A table of numbers as arrays, NaN where a cell is empty."""
    rows = table(path)
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def panels(count, width, height, **more):
    figure, axes = plt.subplots(1, count, figsize=(width, height), **more)
    for axis in np.atleast_1d(axes):
        axis.set_axis_off()
    return figure, axes


def save(figure, name):
    """As a palette: a third of the size, without a visible difference."""
    path = PICTURES / f"{name}.png"
    figure.savefig(path, dpi=110)
    plt.close(figure)
    colours = Image.open(path).convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE)
    colours.save(path, optimize=True)
    print(path, path.stat().st_size // 1024, "KiB")


def show_depth(axis, path):
    depth = planes(path)["Z"]
    axis.imshow(np.where(depth > 0, depth, np.nan), cmap="turbo_r", norm="log")


def apply():
    figure, (left, middle, right) = panels(3, 8.2, 2.5)
    left.imshow(picture("input/color/frame_000002.png"))
    left.set_title("a perfect camera's picture ...")
    show_depth(middle, "input/depth/frame_000002.exr")
    middle.set_title("... with its depth")
    right.imshow(picture("applied.png"))
    right.set_title("lens, rolling shutter, exposure, noise")
    save(figure, "apply")


def board():
    figure, (left, right) = panels(2, 8.2, 3.2)
    frame = picture("board/color/frame_000012.png")
    west, north, east, south = 120, 80, 280, 200
    left.imshow(frame)
    left.add_patch(plt.Rectangle((west, north), east - west, south - north, fill=False, color="tab:red"))
    left.set_title("the picture")
    right.imshow(frame, interpolation="nearest")
    for row in table("board/tracks.csv"):
        x, y = float(row["x_px"]), float(row["y_px"])
        if west + 3 < x < east - 12 and north + 6 < y < south - 3:
            right.plot(x, y, "+", color="tab:red", markersize=9, markeredgewidth=1.2)
            right.annotate(row["point"], (x, y), (3, 3), textcoords="offset points", color="tab:red", fontsize=7, bbox={"facecolor": "white", "alpha": 0.8, "pad": 0.5, "linewidth": 0})
    right.set(xlim=(west, east), ylim=(south, north))
    right.set_title("its exact corners, by their ids")
    save(figure, "boards")


def export():
    figure = plt.figure(figsize=(8.2, 3.3))
    left, right = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="3d", computed_zorder=False)
    lines = [line.split() for line in (WORK / "colmap/sparse_text/0/points3D.txt").read_text().splitlines() if line[0] != "#"]
    points = {int(line[0]): np.array(line[1:7], float) for line in lines}
    images = [line for line in (WORK / "colmap/sparse_text/0/images.txt").read_text().splitlines() if not line.startswith("#")]
    poses, seen = images[::2], np.array(images[1::2][2].split(), float).reshape(-1, 3)
    name = poses[2].split()[9]
    left.imshow(picture(f"colmap/images/{name}"))
    left.scatter(seen[:, 0], seen[:, 1], s=3, c="yellow", edgecolors="black", linewidths=0.2)
    left.set_title(f"images/{name} and its points")
    left.set_axis_off()
    cloud = np.array(list(points.values()))
    cloud = cloud[cloud[:, 1] < 4500]
    right.scatter(*cloud[:, :3].T, s=4, c=cloud[:, 3:] / 255, depthshade=False)
    centres = []
    for pose in poses:
        w, x, y, z, *t = np.array(pose.split()[1:8], float)
        # camera_from_world
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        centre = -turn.T @ t
        centres.append(centre)
        right.quiver(*centre, *(turn.T @ [0, 0, 700]), color="tab:red", linewidth=0.7, arrow_length_ratio=0.1)
    right.plot(*np.array(centres).T, color="tab:red", marker="o", markersize=2)
    right.set(xlabel="east, m", ylabel="north, m", zlabel="up, m", title="poses and points of sparse/0")
    right.set_box_aspect((1, 1, 0.45))
    right.view_init(elev=28, azim=-110)
    right.tick_params(labelsize=6)
    right.locator_params(nbins=4)
    save(figure, "export")


def long_runs():
    names = sorted(path.name for path in (WORK / "merged/color").iterdir())
    owner = {path.name: shard for shard in (1, 2) for path in (WORK / f"shards/{shard}/color").iterdir()}
    figure, axes = plt.subplots(2, 6, figsize=(8.2, 2.4))
    for axis, name in zip(axes.flat, names, strict=True):
        axis.imshow(picture(f"merged/color/{name}"))
        axis.set(xticks=[], yticks=[])
        axis.set_title(f"{int(name[6:12])}: shard {owner[name]}", fontsize=7, pad=2)
        for spine in axis.spines.values():
            spine.set(color="tab:orange" if owner[name] == 1 else "tab:blue", linewidth=2.5)
    save(figure, "long_runs")


def python():
    figure, (left, middle, right) = panels(3, 8.2, 2.6)
    left.imshow(picture("python/color/frame_000032.png"))
    left.set_title("frame.color")
    show_depth(middle, "python/depth/frame_000032.exr")
    middle.set_title("frame.depth")
    flow = planes("python/flow/frame_000032.exr")
    right.imshow(np.hypot(flow["dx"], flow["dy"]), cmap="magma", vmin=0)
    y, x = np.mgrid[24:480:48, 24:640:48]
    right.quiver(x, y, flow["dx"][y, x], flow["dy"][y, x], angles="xy", scale_units="xy", scale=0.25, color="white", width=0.008)
    right.set_title("frame.flow")
    save(figure, "python")


def randomize():
    rows = table("randomize/variations.csv")
    figure, axes = plt.subplots(2, 4, figsize=(6.4, 3.3))
    for axis, row in zip(axes.flat, rows, strict=True):
        axis.imshow(picture(f"randomize/{row['folder']}/color/frame_000000.png"))
        axis.set_axis_off()
        focal = json.loads(row["camera.focal_px"])[0]
        light, noise = float(row["camera.photometric.light"]), float(row["camera.photometric.noise_sigma"])
        exposure = float(row["camera.shutter.exposure_ms"])
        axis.set_title(f"f {focal:.0f} px, {exposure:.1f} ms, light {light:.2f},\nnoise {noise:.3f}, {json.loads(row['camera.lens'])['model']}", fontsize=6)
    save(figure, "randomize")


def rigs():
    frames = {name: picture(f"rig/{name}/color/frame_000032.png") for name in ("left", "front", "right", "down")}
    size = frames["front"].width
    sheet = Image.new("RGB", (3 * size, 2 * size), "white")
    places = {"left": (0, 0), "front": (size, 0), "right": (2 * size, 0), "down": (size, size)}
    cameras = tomllib.loads((WORK / "rig.toml").read_text())["cameras"]
    angles = {camera["name"]: [round(angle) for angle in camera["mount"]["angles_deg"]] for camera in cameras}
    figure, axis = panels(1, 6.4, 4.4)
    for name, place in places.items():
        sheet.paste(frames[name], place)
        axis.text(place[0] + 8, place[1] + 10, f"{name}: {angles[name]}", va="top", bbox={"facecolor": "white", "alpha": 0.8, "pad": 2, "linewidth": 0})
        axis.add_patch(plt.Rectangle(place, size, size, fill=False, color="white", linewidth=1))
    axis.imshow(sheet)
    save(figure, "rigs")


def sensors():
    imu, gnss = columns("sensors/sensors/imu.csv"), columns("sensors/sensors/gnss.csv")
    figure, axes = plt.subplots(2, 2, figsize=(8.2, 4.2))
    for axis, kind, unit, title in (
        (axes[0, 0], "gyro_x", "rad_s", "roll rate, rad/s"),
        (axes[0, 1], "accel_z", "m_s2", "specific force down, m/s^2"),
    ):
        t_s = imu["t_true_ns"] * 1e-9
        axis.plot(t_s, imu[f"{kind}_{unit}"], color="tab:orange", linewidth=0.4, label="measured")
        axis.plot(t_s, imu[f"true_{kind}_{unit}"], color="black", linewidth=0.8, label="true")
        axis.set(ylabel=title, xlabel="s")
        axis.legend(loc="upper right", fontsize=7)
    fixes = gnss["fix"] == 1
    axes[1, 0].plot(gnss["true_e_m"], gnss["true_n_m"], color="black", linewidth=0.8, label="true")
    axes[1, 0].plot(gnss["e_m"][fixes], gnss["n_m"][fixes], ".", color="tab:orange", markersize=2, label="fixes")
    axes[1, 0].set(xlabel="east, m", ylabel="north, m", aspect="equal", adjustable="datalim")
    axes[1, 0].legend(fontsize=7)
    for name, label in (("n_m", "north"), ("e_m", "east"), ("d_m", "down")):
        error = np.where(fixes, gnss[name] - gnss[f"true_{name}"], np.nan)
        axes[1, 1].plot(gnss["t_true_ns"] * 1e-9, error, linewidth=0.8, label=label)
    axes[1, 1].axvspan(24, 30, color="0.9")
    axes[1, 1].text(27, 0.02, "no fix", ha="center", va="bottom", transform=axes[1, 1].get_xaxis_transform())
    axes[1, 1].set(xlabel="s", ylabel="error of the fixes, m")
    axes[1, 1].legend(fontsize=7)
    save(figure, "sensors")


for draw in (apply, board, export, long_runs, python, randomize, rigs, sensors):
    draw()
