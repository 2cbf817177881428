"""Frames one after the other."""

from __future__ import annotations

import importlib
import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from . import _camsim
from ._errors import InputError
from .frame import Frame


class Frames(Iterator[Frame]):
    """Frames on their way: an iterator with a length, and `close`."""

    def __init__(
        self,
        native: _camsim.Scenario,
        numbers: range,
        channels: list[str] | None,
        twins: Sequence[Mapping[str, Any]],
    ) -> None:
        self._left = len(numbers)
        self._bar: Any = None
        self._stream = _Stream(native, numbers, channels)
        self._twins: dict[str, _Stream | _Burst] = {}
        for spec in twins:
            name, instants, of_twin = spec["name"], spec.get("instants"), spec.get("channels") or channels
            if instants is None:
                self._twins[name] = _Stream(native.twin(name, None), numbers, of_twin)
            else:
                pictures = [native.twin(name, instant) for instant in range(instants)]
                self._twins[name] = _Burst(pictures, numbers, of_twin)

    def _with_bar(self) -> Frames:
        """Shows a bar by tqdm from now on, if that is installed."""
        try:
            self._bar = importlib.import_module("tqdm.auto").tqdm(total=self._left, unit="frame")
        except ImportError:
            pass
        return self

    def __next__(self) -> Frame:
        try:
            frame = self._stream.next()[0]
        except BaseException:
            self._end_bar()
            raise
        self._left -= 1
        if self._bar is not None:
            self._bar.update()
        frame.twins = {name: twin.next() for name, twin in self._twins.items()}
        return frame

    def __len__(self) -> int:
        """Number of frames that are still to come."""
        return self._left

    def __repr__(self) -> str:
        return f"<camsim.Frames: {self._left} frames to come>"

    def close(self) -> None:
        """Lets the frames under way finish, and renders no more."""
        for stream in (self._stream, *self._twins.values()):
            stream.close()
        self._left = 0
        self._end_bar()

    def _end_bar(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


class _Stream:
    """Frames that are rendered ahead."""

    def __init__(self, native: _camsim.Scenario, numbers: range, channels: list[str] | None) -> None:
        self._camera, self._encoding = native.camera, native.encoding
        first = numbers[0] if numbers else 0
        self._stream = native.stream(first, numbers.step, len(numbers), channels)

    def next(self) -> list[Frame]:
        return [Frame(next(self._stream), self._camera, self._encoding)]

    def close(self) -> None:
        self._stream.close()


class _Burst:
    """Pictures of a burst. They may be many, so they are rendered one by one, by one renderer."""

    def __init__(self, natives: list[_camsim.Scenario], numbers: range, channels: list[str] | None) -> None:
        self._natives = natives
        self._numbers = iter(numbers)
        self._channels = channels

    def next(self) -> list[Frame]:
        number = next(self._numbers)
        return [
            Frame(native.render_one(number, self._channels), native.camera, native.encoding)
            for native in self._natives
        ]

    def close(self) -> None:
        self._numbers = iter(())


def channel_names(channels: Iterable[str] | None) -> list[str] | None:
    """A list of names, if there is one."""
    if isinstance(channels, str):
        raise InputError(f'channels: write channels=["{channels}"], a list of names')
    try:
        names = None if channels is None else list(channels)
    except TypeError:
        raise TypeError(f'channels: write a list of names, ["color", "depth"], not {type(channels).__name__}') from None
    for name in names or ():
        if not isinstance(name, str):
            raise TypeError(f"channels: names are text, not {type(name).__name__}: {name!r}")
    return names


def frame_number(index: Any, count: int, what: str = "frame") -> int:
    """The number of one of `count` frames, which may be counted from the end."""
    try:
        number = operator.index(index)
    except TypeError:
        hint = f'; scenario.render(0, ["{index}"]) gives a channel of a frame' if isinstance(index, str) else ""
        raise TypeError(f"{what}s are numbered by whole numbers, not {type(index).__name__}{hint}") from None
    if not -count <= number < count:
        whose = "the scenario has" if what == "frame" else "there are"
        raise IndexError(f"{what} {number}: {whose} {count} {what}s")
    return number % count
