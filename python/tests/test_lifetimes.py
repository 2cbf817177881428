"""Arrays keep their memory, frames end in any order, and nothing grows."""

from __future__ import annotations

import gc
import os
import pathlib
import random
import sys
import threading
import weakref

import numpy as np
import pytest

import camsim
from conftest import LONG, SMALL

ALL = ["color", "depth", "valid", "coords", "range", "object", "flow", "blur_path"]


def test_arrays_outlive_all_that_made_them(pattern: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern, sets=SMALL)
    frames = list(scenario.frames(0, 4, channels=ALL))
    copies = [{name: array.copy() for name, array in frame.items()} for frame in frames]
    arrays = [dict(frame) for frame in frames]
    rows = [frame.rows for frame in frames]
    row_copies = [one.position_ned_m.copy() for one in rows]
    del scenario, frames
    gc.collect()
    # Whatever memory was freed is written over.
    _ = [np.full((120, 160, 4), -1.0, dtype=np.float32) for _ in range(64)]
    for kept, copy in zip(arrays, copies, strict=True):
        assert all(np.array_equal(kept[name], copy[name]) for name in copy)
    assert all(np.array_equal(one.position_ned_m, copy) for one, copy in zip(rows, row_copies, strict=True))


def test_arrays_are_what_the_renderer_has_made(pattern: pathlib.Path) -> None:
    frame = camsim.Scenario.load(pattern, sets=SMALL).render(0, ["color", "depth"])
    for array in frame.values():
        assert not array.flags.owndata and array.flags.writeable and array.flags.c_contiguous
        owner = weakref.ref(array.base)
        view = array[10:20]
        del array
        view[:] = 1.0
        assert owner() is not None
    assert np.from_dlpack(frame.color).ctypes.data == frame.color.ctypes.data


def test_freeing_in_any_order_under_threads(pattern: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern, sets=SMALL)
    expected = [frame.color.copy() for frame in scenario.frames(0, 6)]
    faults: list[str] = []

    def work(seed: int) -> None:
        order = random.Random(seed)
        held: list[tuple[int, np.ndarray[tuple[int, ...], np.dtype[np.float32]]]] = []
        stream = scenario.frames(0, 6, channels=ALL)
        for frame in stream:
            held.append((frame.index, frame.color))
            if order.random() < 0.5:
                index, color = held.pop(order.randrange(len(held)))
                if not np.array_equal(color, expected[index]):
                    faults.append(f"frame {index}")
            if seed == 0 and frame.index == 2:
                stream.close()
        if any(not np.array_equal(color, expected[index]) for index, color in held):
            faults.append(f"thread {seed}")

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    del scenario
    for thread in threads:
        thread.join()
    assert faults == []


def test_streams_beside_each_other_and_left_early(pattern: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern, sets=SMALL)
    pairs = zip(scenario.frames(0, 5), scenario.frames(5, 10), strict=True)
    assert [(one.index, other.index) for one, other in pairs] == [(k, k + 5) for k in range(5)]
    for _ in range(5):
        for frame in scenario.frames():
            if frame.index == 1:
                break
    left = scenario.frames(0, 10)
    next(left)
    assert len(left) == 9
    left.close()
    with pytest.raises(StopIteration):
        next(left)


def resident_mb() -> float:
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE") / 2**20


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_ten_thousand_frames_without_growth(pattern: pathlib.Path) -> None:
    tiny = {"camera.size_px": [32, 24], "camera.focal_px": [21, 21], "camera.principal_point_px": [15.5, 11.5]}
    tiny |= {"camera.fps": 1000.0, "flight.window_s": [10, 21], "camera.shutter.readout_ms": 0.9, "camera.shutter.exposure_ms": 0.0}
    tiny |= {"camera.mount.vibration": []}
    scenario = camsim.Scenario.load(pattern, sets=tiny)
    frames = 10_000 if LONG else 2_000
    at = {frames // 4: 0.0, frames - 1: 0.0}
    for frame in scenario.frames(0, frames, channels=["color", "depth"]):
        if frame.index in at:
            gc.collect()
            at[frame.index] = resident_mb()
    first, last = at.values()
    # A leak of one 12 KB picture a frame would be 18 MB at least; heaps breathe by a few.
    assert last - first < 8.0, f"{first:.1f} MB after a quarter of the frames, {last:.1f} MB at the end"
