"""Arrays as the native half takes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import InputError


def rows_of(values: ArrayLike, width: int, what: str) -> NDArray[np.float64]:
    """Values as rows of `width` numbers, side by side in memory; a single row becomes one of many."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape == (width,):
        array = array.reshape(1, width)
    if array.ndim != 2 or array.shape[1] != width:
        raise InputError(f"{what}: an array of shape (N, {width}) is needed, not {array.shape}")
    return array


def picture_of(values: ArrayLike, what: str) -> NDArray[np.float32]:
    """A picture as height x width x channels of float32; integers become shares of their largest value."""
    array: NDArray[Any] = np.asarray(values)
    if array.ndim == 2:
        array = array[:, :, np.newaxis]
    if array.ndim != 3:
        raise InputError(f"{what}: a picture of shape (height, width) or (height, width, channels) is needed, not {array.shape}")
    if array.dtype == np.bool_:
        return np.ascontiguousarray(array, dtype=np.float32)
    if array.dtype in (np.uint8, np.uint16):
        return np.ascontiguousarray(array, dtype=np.float32) / np.float32(np.iinfo(array.dtype).max)
    return np.ascontiguousarray(array, dtype=np.float32)


def linear_of(color: ArrayLike, what: str) -> NDArray[np.float32]:
    """A colour picture in linear light: bytes are sRGB, floats are linear already."""
    array: NDArray[Any] = np.asarray(color)
    if array.dtype != np.uint8:
        return picture_of(array, what)
    stored = np.arange(256) / 255.0
    table = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4).astype(np.float32)
    linear = table[array]
    if array.ndim == 3 and array.shape[2] == 4:
        linear[:, :, 3] = array[:, :, 3] / np.float32(255)
    return picture_of(linear, what)
