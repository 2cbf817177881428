"""What beginners get wrong: one plain message for each, at once, and nothing silently else."""

from __future__ import annotations

import json
import math
import pathlib
import pickle
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import camsim
from camsim._samples import Samples
from conftest import ROOT, SMALL, run_program

T_S = np.linspace(0, 4, 41)
ALONG = np.c_[20 * T_S, 0 * T_S, 0 * T_S - 100]


def tree(**keys: Any) -> dict[str, Any]:
    made: dict[str, Any] = {
        "flight": {"log": camsim.PoseTable(T_S, position_ned_m=ALONG), "attitude": "track"},
        "camera": {"size_px": [64, 48], "focal_px": np.array([60.0, 60.0]), "mount": {"angles_deg": np.array([0, -90, 0])}},
        "scene": {"pattern": {"image": np.full((8, 8, 3), 128, dtype=np.uint8), "width_m": 100.0}},
    }
    for key, value in keys.items():
        table, _, leaf = key.rpartition("__")
        target = made
        for name in table.split("__"):
            target = target.setdefault(name, {})
        target[leaf] = value
    return made


RANDOM = np.random.default_rng(1)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"scene__pattern__image": RANDOM.random((800, 800, 3))}, r"^scene\.pattern\.image: float64 .* give uint8 sRGB"),
        ({"scene__pattern__image": np.zeros((20, 20), np.uint16)}, r"^scene\.pattern\.image: uint16 .* give uint8 sRGB"),
        ({"scene__pattern__image": np.zeros((20, 20, 4), np.uint8)}, r"^scene\.pattern\.image: .*leave alpha out"),
        ({"scene__pattern__image": RANDOM.random((300, 300, 3)).tolist()}, r"^scene\.pattern\.image: a list of more than"),
        ({"scene__terrain__dem": RANDOM.random((500, 500))}, r"^scene\.terrain\.dem: .*camsim\.HeightMap"),
        ({"flight__log": RANDOM.random((500, 4))}, r"^flight\.log: .*camsim\.PoseTable"),
    ],
)
def test_arrays_that_are_no_values_are_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(camsim.InputError, match=message):
        camsim.Scenario.from_dict(tree(**keys))
    with pytest.raises(camsim.InputError, match=message):
        camsim.Scenario.demo().replace({key.replace("__", "."): value for key, value in keys.items()})


def test_messages_name_what_was_given_and_no_file_of_camsim() -> None:
    names = re.compile(r"camsim-|" + re.escape(tempfile.gettempdir()))
    demo = camsim.Scenario.demo()
    with pytest.raises(camsim.InputError) as of_demo:
        demo.replace({"camera.sise_px": [64, 48]})
    with pytest.raises(camsim.InputError, match=r"^flight\.log \(the camsim\.PoseTable\)") as of_log:
        camsim.Scenario.from_dict(tree(flight__log=camsim.PoseTable([0.0, 1.0], position_ned_m=np.full((2, 3), math.nan))))
    with pytest.raises(camsim.InputError, match="^camera:") as of_camera:
        camsim.apply({"sise_px": [4, 3]}, np.zeros((3, 4, 3), np.uint8), focal_px=[4, 4])
    flat = camsim.HeightMap.around(np.zeros((8, 8)), lat_deg=80, lon_deg=8, step_m=10)
    picture = np.full((8, 8, 3), 128, np.uint8)
    with pytest.warns(camsim.ScenarioWarning) as of_warnings:
        demo.replace({"scene.terrain.dem": flat, "scene.terrain.ortho": picture, "camera.photometric.vignette": picture})
    texts = [str(error.value) for error in (of_demo, of_log, of_camera)] + [str(warning.message) for warning in of_warnings]
    for text in texts:
        assert not names.search(text), text


def test_a_size_without_its_principal_point_is_named_with_the_remedy() -> None:
    demo = camsim.Scenario.demo()
    with pytest.warns(camsim.ScenarioWarning, match=r"camera\.principal_point_px.* of 320 x 240.* set camera\.resized\.size_px"):
        demo.replace({"camera.size_px": [320, 240]})
    small = demo.replace({"camera.resized.size_px": [320, 240]})
    assert small.lens.size_px == (320, 240) and small.lens.focal_px == (210, 210.5)
    assert small.warnings == demo.warnings
    # The point of a ray is half as far from the corner.
    rays = np.array([[0.1, -0.2, 1.0], [-0.5, 0.3, 1.0]])
    assert np.abs(small.lens.project(rays) + 0.5 - 0.5 * (demo.lens.project(rays) + 0.5)).max() < 1e-12
    full, half = demo[0].color, small[0].color
    assert half.shape == (240, 320, 4)
    mean = full[..., :3].reshape(240, 2, 320, 2, 3).mean(axis=(1, 3))
    # Noise of 0.01 is halved by four pixels.
    assert np.sqrt(np.mean((half[..., :3] - mean) ** 2)) < 0.012
    again = pickle.loads(pickle.dumps(small))
    assert again.lens.focal_px == small.lens.focal_px and np.array_equal(again[0].color, half)
    with pytest.raises(camsim.InputError, match=r"camera\.resized\.binning.*another factor is camera\.resized\.scale"):
        demo.replace({"camera.resized.binning": 1.5})


def test_saving_makes_the_folder(tmp_path: pathlib.Path) -> None:
    frame = camsim.Scenario.from_dict(tree())[0]
    frame.save(tmp_path / "no" / "folder" / "a.png")
    assert (tmp_path / "no" / "folder" / "a.png").is_file()
    assert camsim.compare(frame.color, frame.color).psnr_db == math.inf
    file = tmp_path / "no" / "folder" / "a.png"
    assert camsim.compare(file, file).psnr_db == math.inf


def test_small_arrays_are_lists() -> None:
    scenario = camsim.Scenario.from_dict(tree(camera__lens={"model": "kannala-brandt", "coefficients": np.array([0.01, 0.0])}))
    assert scenario.lens.focal_px == (60, 60) and scenario.lens.coefficients[0] == 0.01
    assert scenario.replace({"camera.focal_px": np.array([50, 51])}).lens.focal_px == (50, 51)


def test_raw_pictures_are_those_of_the_command_line(tmp_path: pathlib.Path) -> None:
    sensor = {"white_e": 10000, "mosaic": "rggb", "adc_bits": 12, "gain_e_per_dn": 3.0, "black_dn": 64}
    scenario = camsim.Scenario.from_dict(tree(camera__sensor=sensor, output__channels=["raw"]))
    frame = scenario.render(3, ["raw"])
    assert list(frame) == ["raw"] and frame.raw.dtype == np.uint16 and frame.raw.shape == (48, 64)
    assert [np.array_equal(each.raw, frame.raw) for each in scenario.frames(3, 4)] == [True]
    file = tmp_path / "raw.toml"
    file.write_text(scenario.to_toml(), encoding="utf-8")
    run_program("render", file, "-o", tmp_path / "out", "--frames", "3..4", "--quiet")
    (stored,) = (tmp_path / "out" / "raw").iterdir()
    read = pytest.importorskip("readers").read_png(stored)
    assert np.array_equal(read, frame.raw)
    colours = scenario.replace({"camera.sensor.mosaic": "none"})
    assert colours[0].raw.shape == (48, 64, 3)
    with pytest.raises(camsim.InputError, match=r"add \[camera.sensor\]"):
        camsim.Scenario.from_dict(tree()).render(0, ["raw"])


def test_no_instant_gives_no_pose() -> None:
    trajectory = camsim.Scenario.from_dict(tree()).trajectory
    for states in (trajectory.at([math.nan, 1.0, math.inf]), trajectory.camera_at([math.nan, 1.0, -math.inf])):
        for name, values in vars(states).items():
            assert np.isnan(values[[0, 2]]).all() and np.isfinite(values[1]).all(), name
    assert np.isnan(trajectory.at(math.nan).position_ned_m).all()
    # Beyond its log the platform flies on.
    assert np.abs(trajectory.at(104.0).position_ned_m - [2080, 0, -100]).max() < 1e-6
    with pytest.raises(camsim.InputError, match=r"shape \(N,\)"):
        trajectory.at(np.zeros((2, 2)))
    with pytest.raises(camsim.InputError, match="whole nanoseconds"):
        trajectory.at_ns(1.5)
    with pytest.raises(camsim.InputError, match="whole nanoseconds"):
        trajectory.camera_at_ns(2**70)
    with pytest.raises(TypeError, match="pickle its scenario"):
        pickle.dumps(trajectory)


def test_pictures_with_nan_have_no_figures() -> None:
    black = np.zeros((20, 20), np.float32)
    one = black.copy()
    one[3, 4] = math.nan
    for other in (np.full_like(black, math.nan), one):
        told = camsim.compare(other, black)
        assert told.ssim is not None
        assert all(math.isnan(figure) for figure in (told.rmse, told.max, told.psnr_db, told.ssim))
        assert told.non_finite == np.count_nonzero(np.isnan(other)) and told.differing == told.non_finite / 400
    alike = camsim.compare(one, one)
    assert (alike.rmse, alike.non_finite, alike.psnr_db) == (0, 1, math.inf)


def test_files_with_nan_have_no_figures(tmp_path: pathlib.Path) -> None:
    frame = camsim.Scenario.demo().replace(SMALL)[0]
    paths = [tmp_path / "one.exr", tmp_path / "other.exr"]
    frame.save(paths[0])
    frame.color[3, 4, 1] = math.nan
    frame.save(paths[1])
    assert json.loads(run_program("compare", *paths, "--json"))["rmse"] is None
    assert "NaN" in run_program("compare", *paths, "--quiet")
    told = camsim.compare(*paths)
    assert math.isnan(told.rmse) and math.isnan(told.max) and told.non_finite == 1


def test_tables_are_merged() -> None:
    scenario = camsim.Scenario.demo()
    before = scenario.to_dict()["camera"]
    changed = scenario.replace({"camera": {"fps": 10, "shutter": {"readout_ms": 5}}}).to_dict()["camera"]
    assert changed == before | {"fps": 10, "shutter": before["shutter"] | {"readout_ms": 5}}
    scenario.set("camera.shutter", {"exposure_ms": 1})
    assert scenario.to_dict()["camera"]["shutter"] == before["shutter"] | {"exposure_ms": 1}
    scenario.set("camera.shutter", None)
    assert scenario.to_dict()["camera"]["shutter"]["readout_ms"] == 0
    sensor = scenario.replace({"camera": {"sensor": {"white_e": 1000}, "photometric": {"noise_sigma": None}}})
    law = {"camera.shutter.exposure_ms": {"uniform": [2, 10]}}
    assert 2 <= scenario.replace({"randomize": law}).variations.drawn(3)["camera.shutter.exposure_ms"] <= 10
    assert "sensor" in sensor.to_dict()["camera"]
    assert "sensor" not in sensor.replace({"camera": {"sensor": None}}).to_dict()["camera"]


def test_variations_are_checked_before_the_first_is_given() -> None:
    scenario = camsim.Scenario.demo()
    variations = camsim.randomize(scenario, {"camera.shutter.exposure_ms": camsim.Uniform(-1, 10)}, seed=7, count=50)
    first = next(k for k in range(50) if variations.drawn(k)["camera.shutter.exposure_ms"] < 0)
    assert first > 0
    for checked in (lambda: iter(variations), variations.check, lambda: variations.check(1, first + 1)):
        with pytest.raises(camsim.InputError, match=rf"variation {first} .*exposure_ms = -"):
            checked()
    variations.check(0, first)
    endless = camsim.randomize(scenario, {"camera.shutter.exposure_ms": camsim.Uniform(1, 10)})
    endless.check(10**6, 10**6 + 10)
    with pytest.raises(IndexError, match="63 bits"):
        endless[10**20]
    with pytest.raises(IndexError, match="variation 50: there are 50"):
        variations[50]


def test_lenses_travel_and_are_equal() -> None:
    lens = camsim.Lens((640, 480), (420, 421), model="brown-conrady", coefficients=np.array([[-0.2, 0.06, 0, 0, 0]]))
    again = pickle.loads(pickle.dumps(lens))
    assert again == lens and hash(again) == hash(lens)
    assert lens != camsim.Lens((640, 480), (420, 421)) and lens != 3
    points = RANDOM.uniform(-1, 1, (5, 1, 3)) + [0, 0, 3]
    pixels = lens.project(points)
    assert pixels.shape == (5, 1, 2) and np.array_equal(pixels[:, 0], lens.project(points[:, 0]))
    assert lens.unproject(pixels).shape == (5, 1, 3) and lens.jacobian(points).shape == (5, 1, 2, 3)
    assert lens.valid(points).shape == (5, 1)


def mistakes() -> list[tuple[Callable[[], Any], type[Exception], str]]:
    scenario = camsim.Scenario.demo().replace(SMALL)
    lens = camsim.Lens((640, 480), (420, 421))
    rows = np.zeros((41, 3))
    heights = np.zeros((9, 9))
    return [
        (lambda: scenario[120], IndexError, "^frame 120: the scenario has 120 frames$"),
        (lambda: scenario[-121], IndexError, "^frame -121: the scenario has 120 frames$"),
        (lambda: scenario.explain(999), IndexError, "^frame 999: the scenario has 120"),
        (lambda: camsim.verify(scenario, [500]), IndexError, "^frame 500: the scenario has 120"),
        (lambda: camsim.verify(scenario, []), camsim.InputError, "frames is empty"),
        (lambda: scenario["color"], TypeError, r'render\(0, \["color"\]\)'),  # type: ignore[call-overload]
        (lambda: scenario[1.0], TypeError, "whole numbers, not float"),  # type: ignore[call-overload]
        (lambda: scenario.frames(0, 1.5), TypeError, "whole numbers"),  # type: ignore[arg-type]
        (lambda: camsim.Scenario(), TypeError, "Scenario.load"),
        (lambda: camsim.Scenario.from_dict("a.toml"), TypeError, "Scenario.load reads files"),  # type: ignore[arg-type]
        (lambda: scenario.set(5, 5), TypeError, "keys of a scenario are text"),  # type: ignore[arg-type]
        (lambda: scenario.set("camera.fps", "fast"), camsim.InputError, r'^camera\.fps="fast": camera\.fps: '),
        (lambda: scenario.set("qqqq", 5), camsim.InputError, r"camsim\.default_scenario\(\)"),
        (lambda: scenario.render(0, [1]), TypeError, "^channels: names are text"),  # type: ignore[list-item]
        (lambda: Samples(scenario, ["color"], 5), TypeError, r"^frames: write frames=\[5\]"),  # type: ignore[arg-type]
        (lambda: camsim.Scenario.load({}), TypeError, "from_dict takes a dict"),  # type: ignore[arg-type]
        (lambda: camsim.randomize(scenario, [1]), TypeError, "^laws: a dict"),  # type: ignore[arg-type]
        (lambda: scenario.replace({"randomize": None}), camsim.InputError, "one by one"),
        (lambda: camsim.apply(scenario, rows, focal_px=50), camsim.InputError, "^focal_px: two numbers"),  # type: ignore[arg-type]
        (lambda: camsim.apply(scenario, rows, np.zeros(5), focal_px=[50, 50]), camsim.InputError, "^depth: .*height, width"),
        (lambda: camsim.apply(scenario, rows, motion=3, focal_px=[50, 50]), TypeError, "^motion: a camsim.Twist"),  # type: ignore[arg-type]
        (lambda: scenario[0].save("x.jpg"), camsim.InputError, r"x\.jpg: pictures are \.png or \.exr"),
        (lambda: camsim.Lens((-640, 480), (420, 420)), camsim.InputError, "^size_px: two whole numbers above 0"),
        (lambda: camsim.Lens((640, 480), 420), camsim.InputError, r"^focal_px: two numbers are needed, \(fx, fy\)"),  # type: ignore[arg-type]
        (lambda: camsim.Lens((640, 480), (420, 420), model="radtan"), camsim.InputError, 'write "brown-conrady"'),
        (lambda: lens.project(np.ma.masked_array(rows)), camsim.InputError, "^points: a masked array"),
        (lambda: lens.project(rows * 1j), camsim.InputError, "^points: .*not of complex numbers"),
        (lambda: lens.project("abc"), camsim.InputError, "^points: "),
        (lambda: camsim.PoseTable(T_S), camsim.InputError, "positions are missing"),
        (lambda: camsim.PoseTable(T_S, position_ned_m=rows, geodetic=rows), camsim.InputError, "not both"),
        (lambda: camsim.PoseTable(T_S, position_ned_m=rows[1:]), camsim.InputError, "t_s has 41 times, and position_ned_m has 40"),
        (lambda: camsim.PoseTable(T_S, position_ned_m=rows[:, :2]), camsim.InputError, r"position_ned_m: .*\(N, 3\)"),
        (
            lambda: camsim.PoseTable(T_S, position_ned_m=rows, ned_from_body_wxyz=np.zeros((41, 4))),
            camsim.InputError,
            "quaternions of zeros",
        ),
        (lambda: camsim.HeightMap.around(heights, lat_deg=46, lon_deg=8, step_m=-5), camsim.InputError, "step_m: must be above 0"),
        (lambda: camsim.HeightMap.around(np.zeros((9, 9, 1)), lat_deg=46, lon_deg=8, step_m=5), camsim.InputError, "rows, columns"),
        (lambda: camsim.HeightMap(heights, (8, 46), (0, 1)), camsim.InputError, "step: must be above 0"),
        (lambda: camsim.HeightMap(heights * math.nan, (8, 46), (1, 1)), camsim.InputError, "no finite height"),
    ]


def test_mistakes_have_plain_messages() -> None:
    for made, kind, message in mistakes():
        with pytest.raises(kind, match=message) as caught:
            made()
        assert "\n" not in str(caught.value)


def test_representations_are_short() -> None:
    scenario = camsim.Scenario.demo()
    scenario.set("imu", [{"name": "imu0", "rate_hz": 200}])
    picture = np.full((48, 64, 3), 128, np.uint8)
    camera = {"size_px": [64, 48], "focal_px": [60, 60], "fps": 30}
    things = [scenario.imu(), camsim.PoseTable(T_S, position_ned_m=ALONG), camsim.apply(camera, picture, focal_px=[60, 60])]
    for thing in (*things, scenario.trajectory, scenario.lens):
        assert len(repr(thing)) < 300 and repr(thing).startswith("<camsim.")


def test_nothing_is_left_to_be_warned_about() -> None:
    program = "import camsim, gc, os\ns = camsim.Scenario.demo()\nf = s._files.folder\ndel s\ngc.collect()\nassert not f.exists()"
    done = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, cwd=ROOT / "python")
    assert done.returncode == 0 and done.stderr == "", done.stderr
