"""Scenarios: keys, errors, explanations, copies, travel to other processes."""

from __future__ import annotations

import json
import multiprocessing
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import textwrap
import warnings
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest

import camsim
from conftest import PROGRAM, ROOT, SMALL, run_program, set_words
from readers import read_png


def test_a_frame_has_a_pose_and_a_picture_in_srgb(pattern: pathlib.Path, tmp_path: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern, sets=SMALL)
    frame = scenario.render(4, ["color"])
    rows = frame.rows
    middle = len(rows) // 2
    # The stamp is that of the middle of the picture, between two rows.
    for mine, above, below in zip(
        frame.pose.position_ned_m, rows.position_ned_m[middle - 1], rows.position_ned_m[middle], strict=True
    ):
        assert min(above, below) - 1e-9 <= mine <= max(above, below) + 1e-9
    matrix = frame.pose.matrix
    assert matrix.shape == (4, 4) and np.allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.allclose(matrix[:3, 3], frame.pose.position_ned_m)
    frame.save(tmp_path / "x.png", "srgb8")
    written = read_png(tmp_path / "x.png")
    assert frame.to_srgb8().dtype == np.uint8 and np.array_equal(frame.to_srgb8(), written[..., :3])
    shown = frame._repr_png_()
    assert shown is not None and shown[:8] == b"\x89PNG\r\n\x1a\n"
    assert scenario.render(4, ["depth"])._repr_png_() is None


def test_a_scenario_is_a_sequence_of_frames(pattern: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern, sets=SMALL)
    assert len(scenario) == 60
    assert scenario.channels == ["color", "rows", "coords"]
    assert [frame.index for frame in scenario.frames(3, 9, 3)] == [3, 6]
    assert [frame.index for frame in scenario[-2:]] == [58, 59]
    assert [frame.index for frame in scenario.frames(5, 2, -1)] == [5, 4, 3]
    assert scenario[-1].index == 59
    with pytest.raises(IndexError):
        scenario[60]
    first = scenario.render(0, ["color", "depth", "object"])
    assert list(first) == ["color", "depth", "object"] and len(first) == 3
    assert first["color"] is first.color and first.size_px == (160, 120)
    assert "rows" not in first and len(first.rows) == 120
    with pytest.raises(AttributeError, match="no channel 'flow'"):
        _ = first.flow
    with pytest.raises(KeyError, match="no channel"):
        first["flow"]
    assert scenario.objects == [("pattern", 0)]
    assert list(scenario.frames(0, 3, progress=True))[2].index == 2


def test_keys_are_set_and_replaced(pattern: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern, sets=SMALL)
    before = scenario[5].color
    sharp = scenario.replace({"camera.shutter.exposure_ms": 0, "camera.shutter.readout_ms": 0})
    assert not np.array_equal(sharp[5].color, before)
    assert np.array_equal(scenario[5].color, before)
    scenario.set("camera.shutter.exposure_ms", 0)
    scenario.set("camera.shutter.readout_ms", 0)
    assert np.array_equal(scenario[5].color, sharp[5].color)
    assert scenario.to_dict()["camera"]["shutter"]["readout_ms"] == 0
    scenario.set("camera.lens", {"model": "kannala-brandt", "coefficients": np.array([0.01, 0.0])})
    scenario.set("flight.window_s", (10, 10.5))
    assert len(scenario) == 15 and scenario.lens.model == "kannala-brandt"
    same = camsim.Scenario.from_dict(scenario.to_dict())
    assert np.array_equal(same[3].color, scenario[3].color)


@pytest.mark.parametrize(
    ("sets", "where"),
    [
        ({"camera.fpss": 3}, "did you mean"),
        ({"camera.fps": -1}, "camera.fps"),
        ({"camera.fps": "fast"}, "camera.fps"),
        ({"flight.log": "missing.csv"}, "missing.csv"),
        ({"scene.pattern.image": "missing.png"}, "missing.png"),
    ],
)
def test_errors_are_those_of_the_command_line(pattern: pathlib.Path, sets: dict[str, Any], where: str) -> None:
    with pytest.raises(camsim.InputError) as caught:
        camsim.Scenario.load(pattern, sets=sets)
    text = {key: json.dumps(value) for key, value in sets.items()}
    done = subprocess.run([PROGRAM, "explain", pattern, *set_words(text)], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.strip().replace("--set ", "") == f"error: {caught.value}"
    assert where in str(caught.value) and isinstance(caught.value, ValueError)


def test_other_wrong_usage(pattern: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern)
    with pytest.raises(camsim.InputError, match="the channels are color, depth"):
        scenario.render(0, ["colour"])
    with pytest.raises(camsim.InputError, match=r'channels=\["color"\]'):
        scenario.frames(channels="color")
    with pytest.raises(camsim.InputError, match="auto"):
        camsim.Scenario.load(pattern, backend="vulkan")
    with pytest.raises(camsim.InputError, match="no such camera|leave it out"):
        camsim.Scenario.load(pattern, camera="left")
    with pytest.raises(camsim.InputError, match="cannot read"):
        camsim.Scenario.load("nowhere.toml")
    with pytest.raises(camsim.InputError, match="imu"):
        scenario.imu()
    with pytest.raises(camsim.InputError, match="not complex"):
        scenario.set("camera.fps", 1j)
    before = scenario.to_dict()
    with pytest.raises(camsim.InputError):
        scenario.set("camera.fps", -5)
    assert scenario.to_dict() == before


def test_warnings_are_python_warnings(pattern: pathlib.Path) -> None:
    with pytest.warns(camsim.ScenarioWarning, match="longer than a frame's period"):
        scenario = camsim.Scenario.load(pattern, sets={"camera.shutter.exposure_ms": 50})
    assert any("longer" in warning for warning in scenario.warnings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scenario.replace({"seed": 3})


def test_explain_says_what_the_command_line_says(demo: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(demo, sets=SMALL | {"output.channels": ["color", "depth"]})
    words = ["explain", "assets/demo.toml", "--frame", "7", "--quiet", *set_words(SMALL | {"output.channels": '["color", "depth"]'})]
    told = json.loads(run_program(*words, "--json"))
    asked = scenario.explain(7, as_dict=True)
    assert asked["plan"] == told["plan"] and asked["source_frame"] == told["source_frame"]
    # The text names the log as the scenario does.
    assert scenario.explain(7).splitlines()[1:] == run_program(*words).splitlines()[1:]
    report = camsim.verify(scenario, [7])
    assert report["kept"] and report["frames"][0]["frame"] == 7
    assert report == json.loads(run_program("verify", *words[1:2], "--frames", "7", "--json", *words[4:]))


def test_scenarios_travel(pattern: pathlib.Path, monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path) -> None:
    monkeypatch.chdir(ROOT)
    scenario = camsim.Scenario.load("assets/pattern.toml", sets=SMALL)
    packed = pickle.dumps(scenario)
    expected = scenario[3].color
    monkeypatch.chdir(tmp_path)
    assert np.array_equal(pickle.loads(packed)[3].color, expected)
    frame = pickle.loads(pickle.dumps(scenario[3]))
    assert np.array_equal(frame.color, expected) and frame.index == 3 and len(frame.rows) == 120
    monkeypatch.chdir(ROOT)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert np.array_equal(pool.submit(_color, scenario, 3).result(timeout=120), expected)


def _color(scenario: camsim.Scenario, index: int) -> Any:
    return scenario[index].color


FORKED = """
    import multiprocessing, sys, camsim
    def work(queue):
        try:
            queue.put(float(scenario[2].color.sum()))
        except camsim.Error as error:
            queue.put(str(error))
    scenario = camsim.Scenario.load(sys.argv[1])
    assert len(scenario) == 60
    context = multiprocessing.get_context("fork")
    def asked():
        queue = context.SimpleQueue()
        process = context.Process(target=work, args=(queue,))
        process.start()
        answer = queue.get()
        process.join()
        return answer
    before = asked()
    assert before == float(scenario[2].color.sum())
    assert "forked" in asked()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_forks_render_unless_their_parent_has(pattern: pathlib.Path) -> None:
    code = textwrap.dedent(FORKED)
    subprocess.run([sys.executable, "-c", code, pattern], check=True, timeout=120)


INTERRUPTED = """
    import camsim, os, signal, sys, threading
    # What a script starts in the background has it ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    scenario = camsim.Scenario.load(sys.argv[1], sets={"flight.window_s": [0, 45]})
    interrupt = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    try:
        for frame in scenario.frames(channels=["color", "flow"]):
            if frame.index == 0:
                interrupt.start()
    except KeyboardInterrupt:
        print("stopped after", frame.index, "of", len(scenario))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of its own")
def test_ctrl_c_stops_a_stream(demo: pathlib.Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(INTERRUPTED), demo], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert "stopped after" in done.stdout


def test_python_m_camsim_is_the_command_line() -> None:
    def both(*words: str) -> tuple[Any, Any]:
        runs = [[sys.executable, "-m", "camsim"], [PROGRAM]]
        done = [subprocess.run([*run, *words], capture_output=True, text=True, cwd=ROOT) for run in runs]
        return tuple((one.returncode, one.stdout, one.stderr) for one in done)  # type: ignore[return-value]

    for words in (["--help"], ["--version"], ["render", "nowhere.toml"], ["explain", "assets/pattern.toml", "--quiet"]):
        ours, theirs = both(*words)
        assert ours == theirs
    assert camsim.__version__ in both("--version")[0][1]


def test_the_default_scenario_is_that_of_the_command_line() -> None:
    assert camsim.default_scenario() == run_program("render", "--print-default")


def test_signals_are_pythons_after_a_command() -> None:
    handler = signal.getsignal(signal.SIGINT)
    camsim.compare(ROOT / "assets" / "acircles.png", ROOT / "assets" / "acircles.png")
    assert signal.getsignal(signal.SIGINT) is handler
