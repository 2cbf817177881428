"""Twins of a frame, and the reference renderer: as the command line makes them."""

from __future__ import annotations

import json
import pathlib
import pickle
from typing import Any

import camsim
import numpy as np
import pytest
from conftest import SMALL, run_program
from numpy.typing import NDArray
from readers import read_exr

TWINS = [
    {"name": "sharp", "ideal": True},
    {"name": "clear", "noise": False, "channels": ["color", "depth"]},
    {"name": "burst", "instants": 3},
]


@pytest.fixture
def scenario(pattern: pathlib.Path) -> camsim.Scenario:
    sets = {**SMALL, "camera.shutter.exposure_ms": 8.0, "camera.photometric.noise_sigma": 0.02, "output.twin": TWINS}
    return camsim.Scenario.load(pattern, sets=sets, backend="cpu")


def written(scenario: camsim.Scenario, folder: pathlib.Path, *words: str) -> pathlib.Path:
    """The folder of what the command line renders of a scenario."""
    file = folder / "scenario.json"
    file.write_text(json.dumps({"scenario": json.loads(scenario._native.json(True))}))
    files = ["--set", "output.exr_pixel=float", "--set", "output.exr_compression=none", "--format", "exr"]
    run_program("render", file, "-o", folder / "out", *words, *files, "--quiet")
    return folder / "out"


def color(path: pathlib.Path) -> NDArray[np.float32]:
    planes = read_exr(path)
    return np.stack([planes[name] for name in "RGBA"], axis=-1)


def test_twins_are_those_of_the_command_line(scenario: camsim.Scenario, tmp_path: pathlib.Path) -> None:
    out = written(scenario, tmp_path, "--frames", "3..5", "--outputs", "color", "--backend", "cpu")
    frames = list(scenario.frames(3, 5, channels=["color"], twins=True))
    assert [frame.index for frame in frames] == [3, 4]
    for frame in frames:
        name = f"frame_{frame.index:06}"
        assert list(frame.twins) == ["sharp", "clear", "burst"]
        assert np.array_equal(frame.color, color(out / "color" / f"{name}.exr"))
        assert np.array_equal(frame.twin("sharp").color, color(out / "sharp" / "color" / f"{name}.exr"))
        assert np.array_equal(frame.twin("clear").color, color(out / "clear" / "color" / f"{name}.exr"))
        assert sorted(frame.twin("clear")) == ["color", "depth"] and sorted(frame.twin("sharp")) == ["color"]
        burst = [color(path) for path in sorted((out / "burst" / "color").glob(f"{name}*.exr"))]
        assert len(burst) == len(frame.twins["burst"]) == 3
        for k, picture in enumerate(burst):
            assert np.array_equal(frame.twin("burst", k).color, picture)
        assert not np.array_equal(frame.twin("burst", 0).color, frame.twin("burst", 2).color)
        with pytest.raises(KeyError, match="no twin 'blurred'"):
            frame.twin("blurred")
    with pytest.raises(KeyError, match="twins=True"):
        scenario[3].twin("sharp")


def test_twins_are_scenarios(scenario: camsim.Scenario) -> None:
    assert scenario.twins == {"sharp": 1, "clear": 1, "burst": 3}
    sharp = scenario.twin("sharp")
    assert len(sharp) == len(scenario) and sharp.lens.model == "pinhole" and sharp.twins == {}
    assert sharp.to_dict()["camera"]["shutter"]["exposure_ms"] == 0
    picture = sharp[2].color
    assert np.array_equal(pickle.loads(pickle.dumps(sharp))[2].color, picture)
    one = pickle.loads(pickle.dumps(scenario.twin("burst", 1)))
    assert np.array_equal(one[2].color, scenario.twin("burst", 1)[2].color)
    # A change of a twin is one of the scenario that it is of.
    longer = sharp.replace({"camera.shutter.exposure_ms": 2.0})
    assert np.array_equal(longer[2].color, picture)
    with pytest.raises(camsim.InputError, match="there are sharp, clear, burst"):
        scenario.twin("dull")
    with pytest.raises(camsim.InputError, match="the instant is 0 to 2"):
        scenario.twin("burst", 3)
    with pytest.raises(camsim.InputError, match="leave the instant out"):
        scenario.twin("sharp", 0)


def test_a_stream_with_twins_can_be_left(scenario: camsim.Scenario) -> None:
    frames = scenario._frames(range(20), None, True)
    assert next(frames).twin("sharp").index == 0 and len(frames) == 19
    frames.close()
    assert list(frames) == [] and len(frames) == 0


TINY: dict[str, Any] = {
    "camera.size_px": [40, 30],
    "camera.focal_px": [26.0, 26.0],
    "camera.principal_point_px": [19.5, 14.5],
}


def test_the_reference_renderer_is_that_of_the_command_line(pattern: pathlib.Path, tmp_path: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern, sets=TINY, backend="reference")
    out = written(scenario, tmp_path, "--frames", "3,7", "--outputs", "color,depth")
    frames = list(scenario.frames(3, 8, 4, channels=["color", "depth"]))
    assert [frame.index for frame in frames] == [3, 7] and sorted(frames[0]) == ["color", "depth"]
    for frame in frames:
        assert np.array_equal(frame.color, color(out / "color" / f"frame_{frame.index:06}.exr"))
    single = scenario.render(7, ["color"])
    assert sorted(single) == ["color"] and np.array_equal(single.color, frames[1].color)
    fast = camsim.Scenario.load(pattern, sets=TINY, backend="cpu")
    assert 0 < camsim.compare(fast[3].color, frames[0].color).rmse < 0.02
    # As on the command line it becomes a part of the scenario.
    assert scenario.to_dict()["quality"]["solver"] == "reference"
    exact = camsim.Scenario.load(pattern, sets=TINY | {"quality.solver": "reference"})
    assert np.array_equal(exact.render(7, ["color"]).color, single.color)
    assert np.array_equal(pickle.loads(pickle.dumps(scenario)).render(7, ["color"]).color, single.color)
    told = run_program("explain", tmp_path / "scenario.json", "--frame", "7", "--quiet")
    assert scenario.explain(7).splitlines()[1:] == told.splitlines()[1:]


def test_what_the_reference_renderer_cannot_do_is_said(pattern: pathlib.Path) -> None:
    with pytest.raises(camsim.InputError, match="cannot be combined with --backend reference"):
        camsim.Scenario.load(pattern, sets={"quality.solver": "rk2"}, backend="reference")
    with pytest.raises(camsim.InputError, match='"gpu" and "reference"'):
        camsim.Scenario.load(pattern, backend="exact")


def test_the_demo_needs_no_file(monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path) -> None:
    monkeypatch.chdir(tmp_path)
    scenario = camsim.Scenario.demo(backend="cpu")
    assert len(scenario) == 120
    picture = scenario.replace(SMALL)[7].color
    assert 0.05 < picture[..., :3].mean() < 0.95
    sent = pickle.loads(pickle.dumps(scenario.replace(SMALL)))
    assert np.array_equal(sent[7].color, picture)
