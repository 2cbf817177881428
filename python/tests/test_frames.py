"""Frames and their arrays."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest

import camsim


def test_frames_have_the_channels_that_were_asked_for(pattern: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern)
    assert len(scenario) == 60
    frames = list(scenario.frames(3, 9, 3, channels=["color", "depth", "object"]))
    assert [frame.index for frame in frames] == [3, 6]
    first = frames[0]
    assert list(first) == ["color", "depth", "object"]
    assert first.color.shape == (480, 640, 4) and first.color.dtype == np.float32
    assert first.depth.shape == (480, 640) and first.depth.dtype == np.float32
    assert first.object.shape == (480, 640) and first.object.dtype == np.uint16
    with pytest.raises(AttributeError, match="flow"):
        _ = first.flow
    assert np.array_equal(scenario.render(3, ["color"]).color, first.color)
