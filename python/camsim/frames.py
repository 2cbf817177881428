"""Frames one after the other."""

from __future__ import annotations

import importlib
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
        self._stream = _Stream(native, numbers, channels)
        self._twins: dict[str, _Stream | _Burst] = {}
        for spec in twins:
            name, instants, of_twin = spec["name"], spec.get("instants"), spec.get("channels") or channels
            if instants is None:
                self._twins[name] = _Stream(native.twin(name, None), numbers, of_twin)
            else:
                pictures = [native.twin(name, instant) for instant in range(instants)]
                self._twins[name] = _Burst(pictures, numbers, of_twin)

    def __next__(self) -> Frame:
        frame = self._stream.next()[0]
        self._left -= 1
        frame.twins = {name: twin.next() for name, twin in self._twins.items()}
        return frame

    def __len__(self) -> int:
        """Number of frames that are still to come."""
        return self._left

    def close(self) -> None:
        """Renders no more than the frames under way."""
        for stream in (self._stream, *self._twins.values()):
            stream.close()
        self._left = 0


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
    return None if channels is None else list(channels)


def with_bar(frames: Frames) -> Iterator[Frame]:
    """Frames with a bar by tqdm, if that is installed."""
    try:
        tqdm = importlib.import_module("tqdm.auto").tqdm
    except ImportError:
        return frames
    return iter(tqdm(frames, total=len(frames), unit="frame"))
