"""Frames for Ray Data, rendered by actors that each hold a renderer (``pip install '.[ray]'`` in a clone).

>>> import camsim, camsim.ray
>>> variations = camsim.randomize(scenario, {"camera.shutter.readout_ms": camsim.Uniform(5, 30)}, seed=7, count=100_000)
>>> frames = camsim.ray.dataset(variations, channels=["color", "depth"], concurrency=(1, 64))
>>> frames.write_parquet("frames")

A sample is a function of its number, so one that is rendered again after a machine was lost has the same bytes. All
machines need the files that the scenario names at the same paths.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    import ray.data
except ImportError as error:
    raise ImportError("camsim.ray needs Ray Data: pip install '.[ray]' in a clone of camsim") from error

from ._samples import Samples, stacked
from .randomize import Variations
from .scenario import Scenario


class _Renderer:
    """An actor. Its renderer is opened at its first batch, and kept."""

    def __init__(self, samples: Samples) -> None:
        self._samples = samples

    def __call__(self, batch: Mapping[str, NDArray[np.int64]]) -> dict[str, NDArray[Any]]:
        rendered = [self._samples[int(number)] for number in batch["id"]]
        columns: dict[str, NDArray[Any]] = {}
        for name, first in rendered[0].items():
            if isinstance(first, dict):
                for key in first:
                    columns[key] = np.array([sample[name].get(key, np.nan) for sample in rendered])
            else:
                columns[name] = stacked([np.asarray(sample[name]) for sample in rendered])
        return columns


def dataset(
    source: Scenario | Variations,
    *,
    channels: Iterable[str] | None = None,
    frames: Iterable[int] | None = None,
    concurrency: int | tuple[int, int] = 1,
    num_cpus: float = 1,
    batch_size: int = 4,
) -> Any:
    """A `ray.data.Dataset` with a row for each sample: an array of each channel (height x width x components), `sample`,
    `frame` and `stamp_ns`; of variations also `variation` and the drawn numbers by key.

    :param source: A scenario, or variations with a count.
    :param channels: Names as in `docs/reference/CHANNELS.md`; those of `output.channels` if omitted.
    :param frames: Numbers of the frames; all of a scenario, and the first of each variation, if omitted.
    :param concurrency: Number of actors, or the fewest and the most.
    :param num_cpus: Processors of each actor.
    :param batch_size: Samples that an actor renders at once.
    """
    return _rendered(Samples(source, channels, frames), concurrency, num_cpus, batch_size)


def _rendered(samples: Samples, concurrency: int | tuple[int, int], num_cpus: float, batch_size: int) -> Any:
    blocks = max(1, -(-len(samples) // batch_size))
    # Not `ray.data.range`: its tasks need processors. After a machine is lost, its renderers may take all that are left,
    # and those tasks then wait forever.
    numbers = ray.data.from_items([{"id": number} for number in range(len(samples))], override_num_blocks=blocks)
    return numbers.map_batches(
        _Renderer,
        fn_constructor_args=(samples,),
        batch_size=batch_size,
        batch_format="numpy",
        concurrency=concurrency,
        num_cpus=num_cpus,
    )
