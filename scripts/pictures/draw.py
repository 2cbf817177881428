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
# At 800 pixels a letter is 11 pixels high.
WIDTH = 8.0
plt.rcParams.update(
    {"font.size": 11, "axes.titlesize": 11, "figure.constrained_layout.use": True, "image.interpolation": "antialiased"}
)


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
    """With all its colours, where these fit into 300 kB."""
    path = PICTURES / f"{name}.png"
    for dpi in (110, 100):
        figure.savefig(path, dpi=dpi, bbox_inches="tight", pad_inches=0.04)
        colours = Image.open(path).convert("RGB")
        colours.save(path, optimize=True)
        if path.stat().st_size < 300_000:
            break
    else:
        palette = colours.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=3)
        colours.quantize(palette=palette, dither=Image.Dither.NONE).save(path, optimize=True)
    plt.close(figure)
    print(path, path.stat().st_size // 1024, "KiB")


def pair(name, left, right):
    """Two pictures side by side, pixel by pixel."""
    left, right = picture(left), picture(right)
    both = Image.new("RGB", (2 * left.width + 8, left.height), "white")
    both.paste(left, (0, 0))
    both.paste(right, (left.width + 8, 0))
    path = PICTURES / f"{name}.png"
    both.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=3).save(path, optimize=True)
    print(path, path.stat().st_size // 1024, "KiB")


def pairs():
    frame = "color/frame_000060.png"
    pair("demo", f"demo/perfect/{frame}", f"demo/{frame}")
    pair("shadows", f"shadows_false/{frame}", f"shadows_true/{frame}")
    pair("propeller", "propeller/color/frame_000002.png", "propeller/global/color/frame_000002.png")


def show_depth(axis, path):
    depth = planes(path)["Z"]
    axis.imshow(np.where(depth > 0, depth, np.nan), cmap="turbo_r", norm="log")


def apply():
    figure, (left, middle, right) = panels(3, WIDTH, 2.4)
    left.imshow(picture("input/color/frame_000002.png"))
    left.set_title("a perfect picture ...")
    show_depth(middle, "input/depth/frame_000002.exr")
    middle.set_title("... with its depth")
    right.imshow(picture("applied.png"))
    right.set_title("... as the camera takes it")
    save(figure, "apply")


def board():
    figure, (left, right) = panels(2, WIDTH, 3.3)
    frame = picture("board/color/frame_000012.png")
    west, north, east, south = 130, 90, 250, 180
    left.imshow(frame)
    left.add_patch(plt.Rectangle((west, north), east - west, south - north, fill=False, color="tab:red"))
    left.set_title("the picture")
    right.imshow(frame, interpolation="nearest")
    for row in table("board/tracks.csv"):
        x, y = float(row["x_px"]), float(row["y_px"])
        if west + 3 < x < east - 12 and north + 6 < y < south - 3:
            right.plot(x, y, "+", color="tab:red", markersize=9, markeredgewidth=1.2)
            right.annotate(
                row["point"],
                (x, y),
                (3, 3),
                textcoords="offset points",
                color="tab:red",
                fontsize=10,
                bbox={"facecolor": "white", "alpha": 0.8, "pad": 0.5, "linewidth": 0},
            )
    right.set(xlim=(west, east), ylim=(south, north))
    right.set_title("its exact corners, by their ids")
    save(figure, "boards")


def camera_files():
    figure, (left, middle, right) = panels(3, WIDTH, 2.4, width_ratios=(752 / 480, 1, 400 / 240))
    left.imshow(picture("opencv/color/frame_000032.png"))
    # The crop_px of scripts/pictures.sh.
    left.add_patch(plt.Rectangle((320, 200), 400, 240, fill=False, color="tab:red", linewidth=1.5))
    left.set_title("an OpenCV file")
    middle.imshow(picture("kalibr/color/frame_000032.png"))
    middle.set_title("a Kalibr file")
    right.imshow(picture("part/color/frame_000032.png"))
    right.set_title("the red part, 2 x 2 binned")
    save(figure, "camera_files")


def channels():
    """The tiles of the sheet that camsim has made, with their names."""
    sheet = np.array(picture("village/channels.png"))
    names = "color depth range normal normal_world object coverage flow flow_back flow_global motion blur_path".split()
    figure, axes = plt.subplots(3, 4, figsize=(WIDTH, 5.5))
    height, width = sheet.shape[0] // 3, sheet.shape[1] // 4
    for k, (axis, name) in enumerate(zip(axes.flat, names, strict=True)):
        top, left = k // 4 * height, k % 4 * width
        axis.imshow(sheet[top : top + height, left : left + width])
        axis.set(xticks=[], yticks=[])
        axis.set_title(name, pad=3)
    save(figure, "channels")


def export():
    figure = plt.figure(figsize=(WIDTH, 3.6))
    left, right = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="3d", computed_zorder=False)
    lines = [
        line.split() for line in (WORK / "colmap/sparse_text/0/points3D.txt").read_text().splitlines() if line[0] != "#"
    ]
    points = {int(line[0]): np.array(line[1:7], float) for line in lines}
    images = [
        line for line in (WORK / "colmap/sparse_text/0/images.txt").read_text().splitlines() if not line.startswith("#")
    ]
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
    for axis in (right.xaxis, right.yaxis):
        axis.labelpad = 8
    right.set_box_aspect((1, 1, 0.45))
    right.view_init(elev=28, azim=-110)
    right.locator_params(nbins=3)
    save(figure, "export")


def long_runs():
    """The frames of each shard, and below them those of the merged folder, in columns of equal time."""
    stamps = {int(row["frame"]): int(row["stamp_ns"]) * 1e-9 for row in table("merged/frames.csv")}
    rows = [("shards/1", "tab:orange"), ("shards/2", "tab:blue"), ("frames", "black")]
    figure, axes = plt.subplots(3, len(stamps), figsize=(WIDTH, 3.9))
    owner = {}
    for line, (folder, colour) in zip(axes, rows, strict=True):
        line[0].set_ylabel(folder, color=colour, fontweight="bold")
        for axis, (frame, stamp) in zip(line, stamps.items(), strict=True):
            path = WORK / {"frames": "merged"}.get(folder, folder) / f"color/frame_{frame:06}.png"
            axis.set(xticks=[], yticks=[])
            axis.set_xlim(-8, 327)
            axis.set_ylim(247, -8)
            axis.set_aspect("equal")
            if not path.exists():
                axis.spines[:].set_visible(False)
                continue
            owner.setdefault(frame, colour)
            axis.imshow(picture(path), extent=(-0.5, 319.5, 239.5, -0.5))
            axis.set(xlim=(-8, 327), ylim=(247, -8))
            axis.spines[:].set(color=owner[frame], linewidth=3)
            axis.set_title(f"frame {frame}, {stamp:.0f} s", pad=4)
    save(figure, "long_runs")


def label(axis, box, text, taken):
    """A label beside a box, where it hides neither a box nor another label; none where there is no such room."""
    west, north, east, south = box
    width, height = 9.4 * len(text) + 6, 20
    x, y = (west + east) / 2, (north + south) / 2
    for left, top in (
        (x - width / 2, north - height - 2),
        (east + 3, y - height / 2),
        (west - width - 3, y - height / 2),
        (x - width / 2, south + 2),
    ):
        right, bottom = left + width, top + height
        is_inside = (
            axis.get_xlim()[0] < left
            and right < axis.get_xlim()[1]
            and axis.get_ylim()[1] < top
            and bottom < axis.get_ylim()[0]
        )
        if is_inside and all(
            right < other[0] or other[2] < left or bottom < other[1] or other[3] < top for other in taken
        ):
            axis.text(
                (left + right) / 2,
                (top + bottom) / 2,
                text,
                ha="center",
                va="center",
                fontsize=10,
                bbox={"facecolor": "white", "alpha": 0.75, "pad": 1, "linewidth": 0},
            )
            taken.append((left, top, right, bottom))
            return


def objects():
    """The boxes are those of the pixels of each number."""
    figure, (left, right) = panels(2, WIDTH, 3.4)
    numbers = np.array(Image.open(WORK / "village/object/frame_000040.png"))
    left.imshow(picture("village/color/frame_000040.png"))
    left.set_title("color, with the names of objects.csv")
    right.imshow(picture("village/object_palette/frame_000040.png"))
    right.set_title("object, with its numbers")
    boxes = {}
    for row in table("village/objects.csv"):
        y, x = np.nonzero(numbers == int(row["number"]))
        if row["class"] != "1" and len(x) > 15:
            boxes[row["number"], row["name"], row["class"] == "3"] = x.min() - 1, y.min() - 1, x.max() + 1, y.max() + 1
    for axis in (left, right):
        axis.set(xlim=(20, 560), ylim=(345, 0))
        taken = list(boxes.values())
        # Vehicles first, then the large.
        for (number, name, is_vehicle), box in sorted(
            boxes.items(), key=lambda item: (not item[0][2], item[1][1] - item[1][3])
        ):
            if axis is left:
                west, north, east, south = box
                axis.add_patch(
                    plt.Rectangle(
                        (west, north),
                        east - west,
                        south - north,
                        fill=False,
                        color="yellow" if is_vehicle else "white",
                        linewidth=1.2,
                    )
                )
            label(axis, box, name if axis is left else number, taken)
    save(figure, "objects")


def python():
    figure, (left, middle, right) = panels(3, WIDTH, 2.4)
    left.imshow(picture("python/color/frame_000032.png"))
    left.set_title("frame.color")
    show_depth(middle, "python/depth/frame_000032.exr")
    middle.set_title("frame.depth")
    flow = planes("python/flow/frame_000032.exr")
    right.imshow(np.hypot(flow["dx"], flow["dy"]), cmap="magma", vmin=0)
    y, x = np.mgrid[24:480:48, 24:640:48]
    right.quiver(
        x, y, flow["dx"][y, x], flow["dy"][y, x], angles="xy", scale_units="xy", scale=0.25, color="white", width=0.008
    )
    right.set_title("frame.flow")
    save(figure, "python")


def randomize():
    rows = table("randomize/variations.csv")
    figure, axes = plt.subplots(2, 4, figsize=(WIDTH, 4.4))
    for axis, row in zip(axes.flat, rows, strict=True):
        axis.imshow(picture(f"randomize/{row['folder']}/color/frame_000000.png"))
        axis.set_axis_off()
        focal = json.loads(row["camera.focal_px"])[0]
        light, noise = float(row["camera.photometric.light"]), float(row["camera.photometric.noise_sigma"])
        exposure = float(row["camera.shutter.exposure_ms"])
        lens = json.loads(row["camera.lens"])["model"]
        axis.set_title(f"f {focal:.0f} px, {exposure:.1f} ms\nlight {light:.2f}, noise {noise:.3f}\n{lens}")
    save(figure, "randomize")


def rigs():
    frames = {name: picture(f"rig/{name}/color/frame_000032.png") for name in ("left", "front", "right", "down")}
    size = frames["front"].width
    sheet = Image.new("RGB", (3 * size, 2 * size), "white")
    places = {"left": (0, 0), "front": (size, 0), "right": (2 * size, 0), "down": (size, size)}
    cameras = tomllib.loads((WORK / "rig.toml").read_text())["cameras"]
    angles = {camera["name"]: [round(angle) for angle in camera["mount"]["angles_deg"]] for camera in cameras}
    figure, axis = panels(1, WIDTH, 5.4)
    for name, place in places.items():
        sheet.paste(frames[name], place)
        axis.text(
            place[0] + 8,
            place[1] + 10,
            f"{name}: {angles[name]}",
            va="top",
            bbox={"facecolor": "white", "alpha": 0.8, "pad": 2, "linewidth": 0},
        )
        axis.add_patch(plt.Rectangle(place, size, size, fill=False, color="white", linewidth=1))
    axis.imshow(sheet)
    save(figure, "rigs")


def sensors():
    imu, gnss = columns("sensors/sensors/imu.csv"), columns("sensors/sensors/gnss.csv")
    figure, axes = plt.subplots(2, 2, figsize=(WIDTH, 5.6))
    for axis, kind, unit, title in (
        (axes[0, 0], "gyro_x", "rad_s", "roll rate, rad/s"),
        (axes[0, 1], "accel_z", "m_s2", "specific force down, m/s^2"),
    ):
        t_s = imu["t_true_ns"] * 1e-9
        axis.plot(t_s, imu[f"{kind}_{unit}"], color="tab:orange", linewidth=0.4, label="measured")
        axis.plot(t_s, imu[f"true_{kind}_{unit}"], color="black", linewidth=0.8, label="true")
        axis.set(ylabel=title, xlabel="s")
        axis.margins(y=0.18)
        axis.legend(loc="upper right", ncols=2)
    fixes = gnss["fix"] == 1
    axes[1, 0].plot(gnss["true_e_m"], gnss["true_n_m"], color="black", linewidth=0.8, label="true")
    axes[1, 0].plot(gnss["e_m"][fixes], gnss["n_m"][fixes], ".", color="tab:orange", markersize=2, label="fixes")
    axes[1, 0].set(xlabel="east, m", ylabel="north, m", aspect="equal", adjustable="datalim")
    axes[1, 0].legend()
    for name, label in (("n_m", "north"), ("e_m", "east"), ("d_m", "down")):
        error = np.where(fixes, gnss[name] - gnss[f"true_{name}"], np.nan)
        axes[1, 1].plot(gnss["t_true_ns"] * 1e-9, error, linewidth=0.8, label=label)
    axes[1, 1].axvspan(24, 30, color="0.9")
    axes[1, 1].text(27, 0.98, "no fix", ha="center", va="top", transform=axes[1, 1].get_xaxis_transform())
    axes[1, 1].set(xlabel="s", ylabel="error of the fixes, m")
    axes[1, 1].margins(y=0.2)
    axes[1, 1].legend(loc="lower left", ncols=3, columnspacing=1.0)
    save(figure, "sensors")


def tracks():
    """The positions of the last 15 frames: those of each point are a trail."""
    rows = columns("tracks/tracks.csv")
    moves = np.array([row["moves"] == "1" for row in table("tracks/points.csv")])
    last = int(rows["frame"].max())
    figure, (left, right) = panels(2, WIDTH, 3.6)
    frame = picture(f"village/color/frame_{last:06}.png")
    west, north, east, south = 150, 150, 470, 390
    for axis in (left, right):
        axis.imshow(frame, alpha=0.75)
        size = 1 if axis is left else 2
        for point in np.unique(rows["point"][rows["frame"] == last]).astype(int):
            own = rows["point"] == point
            x, y, hidden = rows["x_px"][own], rows["y_px"][own], rows["visible"][own] == 0
            colour = "cyan" if moves[point] else "yellow"
            axis.plot(x, y, color=colour, linewidth=0.7 * size, alpha=0.8)
            axis.plot(np.where(hidden, x, np.nan), np.where(hidden, y, np.nan), color="red", linewidth=0.7 * size)
            axis.plot(x[-1], y[-1], ".", color="red" if hidden[-1] else colour, markersize=2.5 * size)
    left.add_patch(plt.Rectangle((west, north), east - west, south - north, fill=False, color="white", linewidth=1.2))
    left.set_title("tracks of 15 frames")
    right.set(xlim=(west, east), ylim=(south, north))
    right.set_title("the part in the white frame")
    for colour, label in (("yellow", "visible"), ("cyan", "on what moves"), ("red", "hidden")):
        right.plot([], [], color=colour, linewidth=2, label=label)
    figure.legend(
        *right.get_legend_handles_labels(), loc="outside lower center", ncols=3, facecolor="0.4", labelcolor="white"
    )
    save(figure, "tracks")


for draw in (
    apply,
    board,
    camera_files,
    channels,
    pairs,
    export,
    long_runs,
    objects,
    python,
    randomize,
    rigs,
    sensors,
    tracks,
):
    draw()
