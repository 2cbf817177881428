"""Frames for PyTorch: a map-style dataset that renders its samples (``pip install '.[torch]'`` in a clone).

>>> import camsim, camsim.torch
>>> from torch.utils.data import DataLoader
>>> variations = camsim.randomize(scenario, {"camera.shutter.readout_ms": camsim.Uniform(5, 30)}, seed=7, count=1000)
>>> dataset = camsim.torch.Dataset(variations, channels=["color", "flow_global"])
>>> for batch in DataLoader(dataset, batch_size=4, shuffle=True, num_workers=2):
...     train(batch["color"], batch["flow_global"])

Each worker opens a renderer of its own when it is asked for its first sample. Where workers are forks (Linux), render
nothing in the main process before they start, or give the loader ``multiprocessing_context="spawn"``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    import torch
except ImportError as error:
    raise ImportError("camsim.torch needs PyTorch: pip install '.[torch]' in a clone of camsim") from error

from ._samples import Samples
from .randomize import Variations
from .scenario import Scenario


class Dataset(torch.utils.data.Dataset[Any]):  # type: ignore[misc, unused-ignore]
    """Frames of a scenario, or of its variations, as tensors.

    A sample is a dictionary: a tensor for each channel, components first (``color`` is 4 x height x width: linear R, G,
    B and A, which is 1 where a ray exists), and the integers ``sample``, ``frame`` and ``stamp_ns``; of variations also
    ``variation``, and in ``drawn`` the drawn numbers by key. Channels of 16 bits become int32.

    Samples are functions of their number: shuffling, workers and restarts change no bit.
    """

    def __init__(
        self,
        source: Scenario | Variations,
        *,
        channels: Iterable[str] | None = None,
        frames: Iterable[int] | None = None,
        transform: Callable[[dict[str, Any]], Any] | None = None,
    ) -> None:
        """
        :param source: A scenario, or variations with a count.
        :param channels: Names as in `docs/reference/CHANNELS.md`; those of `output.channels` if omitted.
        :param frames: Numbers of the frames; all of a scenario, and the first of each variation, if omitted.
        :param transform: Called with each sample.
        """
        self._samples = Samples(source, channels, frames)
        self._transform = transform

    def __len__(self) -> int:
        return len(self._samples)

    def __getitem__(self, index: int) -> Any:
        parts = self._samples[index]
        sample = {name: _tensor(part) if isinstance(part, np.ndarray) else part for name, part in parts.items()}
        return sample if self._transform is None else self._transform(sample)


def _tensor(image: NDArray[Any]) -> torch.Tensor:
    """An image with its components first, of the same memory."""
    if image.dtype == np.uint16:
        image = image.astype(np.int32)
    tensor = torch.from_numpy(image)
    return tensor.permute(2, 0, 1) if tensor.ndim == 3 else tensor
