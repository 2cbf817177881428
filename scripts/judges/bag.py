#!/usr/bin/env python3
"""rosbags and mcap read the MCAP; its CameraInfo undistorts the rendered board, by OpenCV, to where its poses put the corners.

    bag.py RUN...      output folders with datasets/mcap
"""

import pathlib
import sys

import cv2
import numpy as np
from common import ENU_FROM_NED, check, finish, rows, versions
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

BOARD = (8, 5)


def matrix(transform):
    q, t = transform.rotation, transform.translation
    x, y, z, w = q.x, q.y, q.z, q.w
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = [t.x, t.y, t.z]
    return pose


def read(path):
    """Messages by topic, each with its time."""
    messages = {}
    with AnyReader([path]) as reader:
        for connection, time, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            messages.setdefault(connection.topic, []).append((time, message))
    return messages


def body_at(moves, time):
    """map from base_link, linear between the two nearest transformations; the flight is so between rows of its log."""
    times = [t for t, _ in moves]
    k = min(max(int(np.searchsorted(times, time)), 1), len(times) - 1)
    share = (time - times[k - 1]) / (times[k] - times[k - 1])
    pose = (1 - share) * moves[k - 1][1] + share * moves[k][1]
    u, _, v = np.linalg.svd(pose[:3, :3])
    pose[:3, :3] = u @ v
    return pose


def judge(name, folder):
    path = folder / "datasets" / "mcap" / "camsim.mcap"
    messages = read(path)
    frames = rows(folder / "frames.csv")
    with open(path, "rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        profile = reader.get_header().profile
    print(f"  {name}: profile {profile}, " + ", ".join(f"{topic} {len(of)}" for topic, of in sorted(messages.items())))
    check(f"{name}: messages that mcap and rosbags count differently", abs(summary.statistics.message_count - sum(map(len, messages.values()))), 0)
    pictures, infos = messages["/cam0/image_raw/compressed"], messages["/cam0/camera_info"]
    check(f"{name}: pictures missing", abs(len(pictures) - len(frames)), 0)
    check(f"{name}: stamps that differ, ns", max(abs(t - int(f["stamp_ns"])) for (t, _), f in zip(pictures, frames)), 0)
    fixed = {t.child_frame_id: matrix(t.transform) for _, m in messages["/tf_static"] for t in m.transforms}
    moves = [(time, matrix(m.transforms[0].transform)) for time, m in messages["/tf"]]
    points = np.array([[float(p[k]) for k in ("n_m", "e_m", "d_m")] for p in rows(folder / "points.csv")]) @ ENU_FROM_NED.T
    errors = []
    for (time, picture), (_, info) in zip(pictures, infos):
        grey = cv2.cvtColor(cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2GRAY)
        k, d = np.array(info.k).reshape(3, 3), np.array(info.d)
        if info.distortion_model == "equidistant":
            straight = cv2.fisheye.undistortImage(grey, k, d, Knew=k)
        else:
            straight = cv2.undistort(grey, k, d)
        found, corners = cv2.findChessboardCornersSB(straight, BOARD, flags=cv2.CALIB_CB_ACCURACY)
        if not found:
            continue
        world_from_camera = body_at(moves, time) @ fixed["cam0"]
        camera = (points - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]
        true = camera[:, :2] / camera[:, 2:] * [k[0, 0], k[1, 1]] + [k[0, 2], k[1, 2]]
        # The board looks the same upside down.
        found = corners.reshape(-1, 2)
        errors.append(min((np.linalg.norm(found[::step] - true, axis=1) for step in (1, -1)), key=np.mean))
    check(f"{name}: pictures without a board", len(pictures) - len(errors), 0)
    errors = np.concatenate(errors) if errors else np.array([np.nan])
    check(f"{name}: corners of the undistorted board, {info.distortion_model}, RMS px", np.sqrt(np.mean(errors**2)), 0.1)


def main(folders):
    versions("rosbags", "mcap", "opencv-python-headless")
    for folder in folders:
        judge(folder.parent.name, folder)
    finish()


if __name__ == "__main__":
    main([pathlib.Path(path) for path in sys.argv[1:]])
