"""Variations: the same as those of the command line, in any order."""

from __future__ import annotations

import json
import pathlib
import pickle

import camsim
import numpy as np
import pytest
from conftest import SMALL, run_program

LAWS = {
    "camera.shutter.exposure_ms": camsim.Uniform(2, 10),
    "camera.mount.angles_deg": camsim.Plus(camsim.Normal([0, 0, 0], [1, 1, 90], clip=(-180, 180))),
    "camera.lens": camsim.Choice(
        [{"model": "pinhole"}, {"model": "brown-conrady", "coefficients": [-0.2, 0.05]}], weights=[1, 2]
    ),
    "flight.window_s": camsim.Piece(0.5),
}


@pytest.fixture
def scenario(pattern: pathlib.Path) -> camsim.Scenario:
    sets = {**SMALL, "camera.photometric.noise_sigma": 0.01, "flight.window_s": [0, 2], "camera.fps": 10}
    return camsim.Scenario.load(pattern, sets=sets, backend="cpu")


def test_variations_are_those_of_the_command_line(scenario: camsim.Scenario, tmp_path: pathlib.Path) -> None:
    variations = camsim.randomize(scenario, LAWS, seed=7, count=20)
    tree = scenario.to_dict()
    tree["randomize"] = {"seed": 7, "variations": 20, **{key: law.to_dict() for key, law in LAWS.items()}}
    text = "".join(f"{json.dumps(key)} = {camsim._toml.value_text(value, key)}\n" for key, value in tree.items())
    (tmp_path / "random.toml").write_text(text)
    out = tmp_path / "out"
    words = ["--variations", "3,17", "--frames", "1", "--format", "exr", "--set", "output.exr_pixel=float"]
    run_program("render", tmp_path / "random.toml", "-o", out, "--backend", "cpu", *words)
    for index in (17, 3):
        folder = out / f"variation_{index:06}"
        run = json.loads((folder / "run.json").read_text())
        assert run["variation"]["values"] == variations.drawn(index)
        ours = variations[index]
        assert ours.drawn == variations.drawn(index) and ours.variation == index
        ours[1].save(tmp_path / "ours.exr")
        compared = camsim.compare(tmp_path / "ours.exr", folder / "color" / "frame_000001.exr")
        assert compared.max == 0


def test_draws_do_not_depend_on_order_or_process(scenario: camsim.Scenario) -> None:
    variations = camsim.randomize(scenario, LAWS, seed=7, count=100)
    drawn = [variations.drawn(index) for index in range(100)]
    sent = pickle.loads(pickle.dumps(variations))
    assert [sent.drawn(index) for index in reversed(range(100))] == drawn[::-1]
    assert np.array_equal(sent[5][0].color, variations[5][0].color)
    exposures = [values["camera.shutter.exposure_ms"] for values in drawn]
    assert 2 <= min(exposures) < 3 and 9 < max(exposures) <= 10
    assert len(variations) == 100 and len(variations[5]) == 5
    assert variations.drawn(-1) == drawn[99]


def test_other_laws_leave_values_alone(scenario: camsim.Scenario) -> None:
    both = camsim.randomize(scenario, LAWS, seed=7)
    one = camsim.randomize(scenario, {"camera.shutter.exposure_ms": {"uniform": [2, 10]}}, seed=7)
    key = "camera.shutter.exposure_ms"
    assert [both.drawn(k)[key] for k in range(9)] == [one.drawn(k)[key] for k in range(9)]
    # A key that was set before is drawn; one that is set afterwards is not.
    scenario.set(key, 4)
    again = camsim.randomize(scenario, {key: camsim.Uniform(2, 10)}, seed=7)
    assert again.drawn(3)[key] == one.drawn(3)[key]
    fixed = camsim.Variations(again.scenario.replace({key: 5}))
    assert key not in fixed.drawn(3) and fixed[3].to_dict()["camera"]["shutter"]["exposure_ms"] == 5


def test_what_cannot_be_drawn_is_said(scenario: camsim.Scenario) -> None:
    for laws, message in (
        ({"camera.fsp": camsim.Uniform(1, 2)}, "did you mean `camera.fps`"),
        ({"camera.fps": camsim.Uniform(2, 1)}, "uniform goes from 2 down to 1"),
        ({"camera.fps": 3}, "expected a distribution"),
    ):
        with pytest.raises(camsim.InputError, match=message):
            camsim.randomize(scenario, laws)  # type: ignore[arg-type]
    wild = camsim.randomize(scenario, {"camera.fps": camsim.Uniform(-2, -1)})
    with pytest.raises(camsim.InputError, match=r"variation 3 \(camera.fps = -1\."):
        wild[3]
    with pytest.raises(TypeError, match="have no number"):
        len(wild)
    with pytest.raises(camsim.InputError, match="no \\[randomize\\]"):
        camsim.Variations(scenario)
