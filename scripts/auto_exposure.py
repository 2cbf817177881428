#!/usr/bin/env python3
"""A flight from snow into a forest with automatic exposure: plots exposure time, gain and level of every frame.

    pip install numpy opencv-python matplotlib
    python3 scripts/auto_exposure.py target/release/camsim docs/pictures/auto_exposure.png

The ground, the log and the scenario are made here. Levels are means of the rendered pictures, linear.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile

import cv2
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SIDE, WIDTH_M, SPEED_M_S, HEIGHT_M, SECONDS, FPS = 3000, 3000.0, 60.0, 150.0, 12, 25
TARGET = 0.18
CASES = [("speed 0.2, delay 1", 0.2, 1, True), ("speed 0.2, delay 1, no sensor", 0.2, 1, False), ("speed 0.6, delay 4", 0.6, 4, True)]
SHOWN = [120, 145, 150, 155, 162, 175, 250]


def noise(rng, cells):
    """Smooth noise with this many cells a side, about 0, standard deviation 1."""
    return cv2.resize(rng.standard_normal((cells, cells)).astype(np.float32), (SIDE, SIDE), interpolation=cv2.INTER_CUBIC)


def ground(path):
    """Snow in the west, forest in the east, with a clearing."""
    rng = np.random.default_rng(4)
    fine, drifts, crowns = noise(rng, SIDE), noise(rng, 60), noise(rng, 500)
    snow = np.stack([0.78 + 0.04 * drifts + 0.02 * fine] * 3, -1) * [1.04, 1.0, 0.98]
    trees = 0.03 * np.exp(0.5 * crowns + 0.3 * fine)
    forest = np.stack([trees * 0.6, trees * 1.1, trees * 0.9], -1)
    edge = SIDE // 2 + 8 * noise(rng, 100)[:, :1]
    east = 1 / (1 + np.exp(-(np.arange(SIDE)[None, :] - edge) / 3))[..., None]
    linear = np.clip(snow * (1 - east) + forest * east, 0, 1)
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    clearing = (((x - SIDE * 0.59) / 30) ** 2 + ((y - SIDE * 0.5) / 60) ** 2 < 1)[..., None]
    linear = np.where(clearing, 0.25 + 0.02 * fine[..., None], linear).clip(0, 1)
    stored = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    cv2.imwrite(str(path), np.round(255 * stored).astype(np.uint8))


def scenario(folder, speed, delay, has_sensor):
    rows = [f"{t},0,{SPEED_M_S * (t - SECONDS / 2)},{-HEIGHT_M},0,0,90" for t in range(SECONDS + 1)]
    (folder / "log.csv").write_text("t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n" + "\n".join(rows) + "\n")
    sensor = '[camera.sensor]\nwhite_e = 8000\nread_noise_e = 3\nfull_well_e = 12000\nmosaic = "rggb"\n'
    text = f"""
[flight]
log = "log.csv"
[camera]
size_px = [320, 240]
focal_px = [600, 600]
fps = {FPS}
mount = {{ angles_deg = [0, -90, 0] }}
[camera.shutter]
readout_ms = 20
exposure_ms = 4
[camera.photometric]
output = "linear-f16"
{sensor if has_sensor else ""}
[camera.auto_exposure]
target = {TARGET}
speed = {speed}
delay = {delay}
exposure_ms = [0.1, 10]
[scene]
pattern = {{ image = "ground.png", width_m = {WIDTH_M} }}
[output]
format = ["png"]
"""
    path = folder / "flight.toml"
    path.write_text(text)
    return path


def run(camsim, folder, name, case):
    """Exposures, gains, mean levels and a few pictures."""
    _, speed, delay, has_sensor = case
    out = folder / name
    subprocess.run([camsim, "render", scenario(folder, speed, delay, has_sensor), "-o", out, "-q"], check=True)
    with (out / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    pictures = [cv2.imread(str(out / row["color_png"]), cv2.IMREAD_UNCHANGED)[..., 2::-1] / 65535.0 for row in rows]
    # A sensor's 1 is its full well: 12000 electrons with gain 1 are 1 of its numbers' range as well.
    levels = [(picture @ [0.2126, 0.7152, 0.0722]).mean() for picture in pictures]
    shown = [pictures[k] for k in SHOWN if k < len(pictures)]
    columns = [np.array([float(row[column]) for row in rows]) for column in ("exposure_ms", "gain")]
    return *columns, np.array(levels), shown


def plot(results, path):
    figure, axes = plt.subplots(4, 1, figsize=(9, 9), height_ratios=[1, 1, 1, 0.9])
    for (label, *_), (exposures, gains, levels, _) in zip(CASES, results, strict=True):
        for axis, values in zip(axes, (exposures, gains, levels), strict=False):
            axis.plot(values, label=label, linewidth=1.2)
    for axis, title in zip(axes, ("exposure time, ms", "gain", "mean of the picture"), strict=False):
        axis.set_ylabel(title)
        axis.set_yscale("log")
        axis.grid(alpha=0.3, which="both")
    axes[2].axhline(TARGET, color="black", linewidth=0.8, linestyle="dotted")
    axes[2].set_xlabel("frame")
    axes[0].legend(fontsize=8)
    strip = np.concatenate([np.pad(p, ((0, 0), (0, 4), (0, 0)), constant_values=1) for p in results[0][3]], 1)
    axes[3].imshow(np.clip(strip, 0, 1) ** (1 / 2.2))
    axes[3].set_axis_off()
    axes[3].set_title("frames " + ", ".join(map(str, SHOWN)), fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main():
    camsim, path = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        ground(folder / "ground.png")
        results = [run(camsim, folder, f"case{k}", case) for k, case in enumerate(CASES)]
    for (label, *_), (exposures, gains, levels, _) in zip(CASES, results, strict=True):
        light = exposures * gains
        # Between the border and the clearing.
        forest = slice(162, 230)
        settled = np.median(light[205:230])
        over = levels[forest].max() / TARGET - 1
        late = 162 + int(np.argmax(light[forest] > 0.9 * settled))
        print(f"{label}: {exposures[100]:.3f} ms x {gains[100]:.2f} over snow, {exposures[220]:.3f} ms x {gains[220]:.2f} over forest,", end=" ")
        print(f"level {levels[100]:.3f} and {levels[220]:.3f}, within 10 % from frame {late} on, highest level {100 * over:.1f} % above the target")
    plot(results, path)


main()
