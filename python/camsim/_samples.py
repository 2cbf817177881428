"""Numbered samples of a scenario or of its variations, for loaders that ask for them in any order and process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .frames import channel_names, frame_number
from .randomize import Variations
from .scenario import Scenario


class Samples:
    """Frames by number. Of variations, sample i is frame `frames[i % n]` of variation `i // n`.

    Nothing is rendered, and no renderer is opened, before a sample is asked for; the object may be taken into a fork or
    pickled at any time before that, and pickled after it too.
    """

    def __init__(
        self,
        source: Scenario | Variations,
        channels: Iterable[str] | None,
        frames: Iterable[int] | None,
    ) -> None:
        if isinstance(frames, int):
            raise TypeError(f"frames: write frames=[{frames}], a list of numbers")
        names = channel_names(channels)
        self.source = source
        base = source.scenario if isinstance(source, Variations) else source
        if names is not None:
            # Refuses names that are no channels here, and not in a worker.
            base.replace({"output.channels": names})
        self.channels = base.channels if names is None else names
        self._held: tuple[int, Scenario] | None = None
        if isinstance(source, Variations):
            self.frames = [0] if frames is None else [int(frame) for frame in frames]
            self._length = len(source) * len(self.frames)
        else:
            self.frames = list(range(len(source)) if frames is None else frames)
            self._length = len(self.frames)

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, index: Any) -> dict[str, Any]:
        """Arrays by channel, with `sample`, `frame`, `stamp_ns` and, of a variation, `variation` and `drawn`."""
        number = frame_number(index, len(self), "sample")
        variation, index = divmod(number, len(self.frames))
        scenario = self._scenario(variation)
        frame = scenario.render(self.frames[index], self.channels)
        sample: dict[str, Any] = dict(frame)
        sample.update(sample=number, frame=frame.index, stamp_ns=frame.stamp_ns)
        if isinstance(self.source, Variations):
            sample.update(variation=variation, drawn=numbers(self.source.drawn(variation)))
        return sample

    def _scenario(self, variation: int) -> Scenario:
        if isinstance(self.source, Scenario):
            return self.source
        if self._held is None or self._held[0] != variation:
            self._held = (variation, self.source[variation])
        return self._held[1]

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_held": None}


def numbers(drawn: Mapping[str, Any]) -> dict[str, float]:
    """The drawn values that are numbers; elements of lists as `key.0`."""
    flat: dict[str, float] = {}
    for key, value in drawn.items():
        listed = {f"{key}.{k}": item for k, item in enumerate(value)} if isinstance(value, list) else {key: value}
        flat.update({name: item for name, item in listed.items() if isinstance(item, (int, float))})
    return flat


def stacked(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """One array of arrays of equal shape, or an array of objects."""
    if len({array.shape for array in arrays}) == 1:
        return np.stack(arrays)
    objects: NDArray[Any] = np.empty(len(arrays), dtype=object)
    objects[:] = arrays
    return objects
