#!/usr/bin/env python3
"""Writes the scenes that the judges look at into a folder: python3 scene.py DIR

A camera flies before a chessboard: gs.toml with a global shutter and OpenCV's lens, fisheye.toml with OpenCV's fisheye lens, rs.toml with a
rolling shutter, exposure, delay and a lens of eight coefficients, rig.toml with two cameras of which one takes every second picture, stereo.toml
with two fisheye cameras, an IMU without random walks and a satellite receiver.
"""

import math
import pathlib
import sys

SCENE = """\
[flight]
log = "log.csv"
window_s = [1.0, {end_s}]
[tracker]
kind = "linear"
[camera]
size_px = [320, 240]
focal_px = [264.0, 265.5]
principal_point_px = [161.3, 118.2]
fps = 10.0
[camera.mount]
angles_deg = [1.0, -2.0, -5.0]
offset_m = [0.1, -0.05, 0.02]
[camera.lens]
model = "{model}"
coefficients = {coefficients}
[camera.shutter]
{shutter}
[scene.board]
kind = "chessboard"
columns = 8
rows = 5
size_m = 0.26
angles_deg = [0.0, 90.0, 0.0]
[output]
format = ["png"]
channels = {channels}
stamps = "zero"
epoch_ns = 1700000000000000000
[output.tracks]
points = "board"
"""

ALL = '["color", "depth", "flow"]'
KINDS = {
    "gs": dict(model="brown-conrady", coefficients=[-0.25, 0.06, 0.001, -0.0015], shutter="", end_s=1.6, channels=ALL),
    "fisheye": dict(model="kannala-brandt", coefficients=[-0.02, 0.005, -0.001, 0.0002], shutter="", end_s=1.4, channels='["color"]'),
    "rs": dict(
        model="brown-conrady",
        coefficients=[-0.25, 0.06, 0.001, -0.0015, 0.01, 0.02, 0.01, 0.003],
        shutter="readout_ms = 30.0\nexposure_ms = 8.0\ndelay_ms = 5.0",
        end_s=1.4,
        channels=ALL,
    ),
}

# The second camera of the rig.
RIGHT = """\
[[cameras]]
name = "right"
size_px = [320, 240]
focal_px = [250.0, 250.0]
fps = 5.0
[cameras.mount]
angles_deg = [-2.0, 1.0, -8.0]
offset_m = [0.05, 0.15, -0.01]
[cameras.lens]
model = "kannala-brandt"
coefficients = [-0.02, 0.005, -0.001, 0.0002]
"""


def rig():
    text = SCENE.format(**{**KINDS["gs"], "channels": '["color"]', "end_s": 2.0})
    text = text.replace("[camera]", '[[cameras]]\nname = "left"').replace("[camera.", "[cameras.")
    return text.replace("[scene.board]", RIGHT + "[scene.board]")


# A second camera like the first one, and sensors.
SENSORS = """\
[[cameras]]
name = "right"
size_px = [320, 240]
focal_px = [264.0, 265.5]
principal_point_px = [161.3, 118.2]
fps = 10.0
[cameras.mount]
angles_deg = [1.0, -2.0, -5.0]
offset_m = [0.1, 0.15, 0.03]
[cameras.lens]
model = "kannala-brandt"
coefficients = [-0.02, 0.005, -0.001, 0.0002]
[[imu]]
name = "imu0"
rate_hz = 200
axes = "flu"
clock_offset_ms = 2.0
gyro = { noise_density = 1.7e-4 }
accel = { noise_density = 2e-3 }
[[gnss]]
name = "gnss0"
"""


def stereo():
    text = SCENE.format(**{**KINDS["fisheye"], "end_s": 1.4})
    text = text.replace('log = "log.csv"', 'log = "log.csv"\norigin = [47.0, 8.0, 400.0]')
    text = text.replace("[camera]", '[[cameras]]\nname = "left"').replace("[camera.", "[cameras.")
    return text.replace("[scene.board]", SENSORS + "[scene.board]")


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    rows = ["t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg"]
    for i in range(40):
        t = 0.1 * i
        position = (-3.0 + 0.25 * t, 0.5 * math.sin(0.8 * t) - 0.1, 0.25 * math.cos(1.1 * t))
        turn = (4 * math.sin(t), 3 * math.cos(0.9 * t), 6 * math.sin(0.7 * t))
        rows.append(",".join(str(value) for value in (t, *position, *turn)))
    (folder / "log.csv").write_text("\n".join(rows) + "\n")
    for name, keys in KINDS.items():
        (folder / f"{name}.toml").write_text(SCENE.format(**keys))
    (folder / "rig.toml").write_text(rig())
    (folder / "stereo.toml").write_text(stereo())


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
