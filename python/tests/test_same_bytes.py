"""Frames are, bit for bit, those that the command line writes."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest

import camsim
from conftest import ROOT, SMALL, run_program, set_words
from readers import numbers, read_exr, read_png, read_table

PLANES = {
    "color": "RGBA",
    "depth": "Z",
    "range": ["range"],
    "normal": "xyz",
    "normal_world": "ned",
    "coverage": ["coverage"],
    "flow": ["dx", "dy", "state"],
    "flow_back": ["dx", "dy", "state"],
    "flow_global": ["dx", "dy", "state"],
    "motion": ["vx", "vy"],
    "blur_path": ["x0", "y0", "x1", "y1"],
    "coords": ["u", "v", "x", "y", "dt", "n", "e", "d"],
}

FLOWS = ["flow", "flow_back", "flow_global", "motion", "blur_path"]
IMU = {"imu": [{"name": "imu0", "gyro": {"noise_density": 1e-4}}]}

CASES: dict[str, tuple[str, list[str], dict[str, Any]]] = {
    "demo": ("assets/demo.toml", ["color", "depth", "valid", "rows"], {}),
    "pattern": ("assets/pattern.toml", ["color", "coords", "rows"], {}),
    "effects": ("benches/all_effects.toml", ["color", "range", "normal", "normal_world"], {}),
    "houses": ("benches/houses.toml", ["color", "object", "class", "coverage"], {"scene.gltf.0.class": 7}),
    "flows": ("assets/pattern.toml", FLOWS, {}),
    "global": ("assets/demo.toml", ["color", "depth"], {"camera.shutter.readout_ms": 0, "camera.shutter.exposure_ms": 0}),
    "interlaced": ("assets/demo.toml", ["color", "coords"], {"camera.shutter.interlace_ms": 16.0}),
    "global-reset": ("assets/demo.toml", ["rows"], {"camera.shutter.allow_overlap": True, "camera.shutter.reset": "global"}),
    "sideways": ("assets/demo.toml", ["color", "rows"], {"camera.shutter.readout": "left-to-right"}),
    "fisheye": (
        "assets/demo.toml",
        ["color", "valid", "range"],
        {"camera.lens": '{ model = "kannala-brandt", coefficients = [-0.01, 0.002] }', "camera.focal_px": [90.0, 90.0]},
    ),
    "paper": ("assets/demo.toml", ["color"], {"quality.preset": "paper"}),
    "noisy": ("assets/pattern.toml", ["color"], {"camera.photometric.noise_sigma": 0.05, "seed": 99}),
}


@pytest.mark.parametrize("name", CASES)
def test_frames_are_those_of_the_command_line(name: str, tmp_path: pathlib.Path) -> None:
    file, channels, more = CASES[name]
    sets = SMALL | more
    words = ["render", ROOT / file, "-o", tmp_path, "--frames", "3..5", "--format", "exr", "--quiet"]
    files = {"output.exr_pixel": "float", "output.exr_compression": "none"}
    run_program(*words, "--outputs", ",".join(channels), *set_words(sets | files))
    scenario = camsim.Scenario.load(ROOT / file)
    for key, value in sets.items():
        scenario.set(key, _python_value(value))
    frames = list(scenario.frames(3, 5, channels=channels))
    table = read_table(tmp_path / "frames.csv")
    assert [frame.index for frame in frames] == [int(cell) for cell in table["frame"]]
    assert [frame.stamp_ns for frame in frames] == [int(cell) for cell in table["stamp_ns"]]
    for k, frame in enumerate(frames):
        assert list(frame.source.size_px) == [int(table[f"ideal_{side}_px"][k]) for side in ("width", "height")]
        assert frame.source.t_ns == int(table["ideal_t_ns"][k])
        for channel in channels:
            _compare(channel, frame, tmp_path / table["color_exr" if channel == "color" else channel][k])


def _python_value(value: Any) -> Any:
    if isinstance(value, str) and value.startswith("{"):
        return {"model": "kannala-brandt", "coefficients": [-0.01, 0.002]}
    return value


def _compare(channel: str, frame: camsim.Frame, path: pathlib.Path) -> None:
    if channel == "rows":
        rows = read_table(path)
        assert frame.rows.t_mid_ns.tolist() == [int(cell) for cell in rows["t_mid_ns"]]
        assert np.array_equal(frame.rows.position_ned_m, numbers(rows, "n", "e", "d"))
        assert np.array_equal(frame.rows.ned_from_camera_wxyz, numbers(rows, "qw", "qx", "qy", "qz"))
        assert np.array_equal(frame.rows.velocity_ned_m_s, numbers(rows, "vn", "ve", "vd"))
        # Files have the column where rows differ in it.
        exposure_ns = frame.rows.exposure_ns.tolist()
        assert exposure_ns == [int(cell) for cell in rows.get("exposure_ns", exposure_ns[:1] * len(exposure_ns))]
        return
    array = frame[channel]
    if path.suffix == ".png":
        stored = read_png(path)
        assert stored.dtype == array.dtype
    else:
        planes = read_exr(path)
        names = PLANES[channel]
        assert sorted(planes) == sorted(names)
        stored = np.stack([planes[name] for name in names], axis=-1)
        stored = stored[:, :, 0] if len(names) == 1 else stored
    assert array.tobytes() == np.ascontiguousarray(stored).tobytes()
    assert array.max() > 0, "an empty picture would prove nothing"


def test_a_rig_is_its_cameras(tmp_path: pathlib.Path) -> None:
    scenario = {
        "flight": {"log": "demo_flight.csv", "height": "msl", "origin": [38.9492, -107.0698, 2810.0], "window_s": [10, 12]},
        "scene": {"pattern": {"image": "acircles.png", "width_m": 3000.0, "at": "origin"}},
        "cameras": [
            {"name": name, "size_px": [80, 60], "focal_px": [f, f], "mount": {"angles_deg": [0, -90, 0]}}
            for name, f in (("left", 52.0), ("right", 60.0))
        ],
    }
    rig = camsim.Scenario.from_dict(scenario, folder=ROOT / "assets").cameras
    assert list(rig) == ["left", "right"]
    file = tmp_path / "rig.toml"
    file.write_text(rig["left"].to_toml(), encoding="utf-8")
    files = {"output.exr_pixel": "float", "output.exr_compression": "none"}
    run_program("render", file, "-o", tmp_path / "out", "--frames", "2", "--outputs", "color", "--format", "exr", *set_words(files))
    for name, one in rig.items():
        frame = one[2]
        assert frame.camera == name
        planes = read_exr(tmp_path / "out" / name / "color" / "frame_000002.exr")
        assert np.array_equal(frame.color, np.stack([planes[part] for part in "RGBA"], axis=-1))
    assert not np.array_equal(rig["left"][2].color, rig["right"][2].color)
    assert list(camsim.load_rig(file)) == ["left", "right"]


def test_saved_pictures_are_those_of_the_command_line(demo: pathlib.Path, tmp_path: pathlib.Path) -> None:
    run_program("render", demo, "-o", tmp_path, "--frames", "7", "--outputs", "color", "--format", "png", *set_words(SMALL))
    frame = camsim.Scenario.load(demo, sets=SMALL)[7]
    frame.save(tmp_path / "saved.png")
    assert np.array_equal(read_png(tmp_path / "saved.png"), read_png(tmp_path / "color" / "frame_000007.png"))
