"""Arrays as the native half takes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import InputError


def numbers_of(values: ArrayLike, what: str) -> NDArray[np.float64]:
    """Values as real numbers, of any shape; masked and complex ones are refused."""
    if isinstance(values, np.ma.MaskedArray):
        raise InputError(f"{what}: a masked array is ambiguous: give its values, or those that are not masked (.compressed())")
    try:
        array = np.asarray(values)
        if array.dtype.kind in "biuf":
            return np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what}: an array of numbers is needed: {error}") from None
    if array.size == 0:
        return np.zeros(array.shape)
    kind = "complex numbers" if array.dtype.kind == "c" else f"{array.dtype}"
    raise InputError(f"{what}: an array of real numbers is needed, not of {kind}")


def rows_of(values: ArrayLike, width: int, what: str) -> NDArray[np.float64]:
    """Values as rows of `width` numbers, side by side in memory; a single row becomes one of many."""
    array = np.ascontiguousarray(numbers_of(values, what))
    if array.shape == (width,):
        array = array.reshape(1, width)
    if array.shape == (0,):
        array = array.reshape(0, width)
    if array.ndim != 2 or array.shape[1] != width:
        raise InputError(f"{what}: an array of shape (N, {width}) is needed, not {array.shape}")
    return array


def points_of(values: ArrayLike, width: int, what: str) -> tuple[NDArray[np.float64], tuple[int, ...]]:
    """Points as rows of `width` numbers, and the shape of what they were given in: (N,), or (N, 1) as OpenCV has them."""
    array = numbers_of(values, what)
    if array.ndim > 2 and array.shape[-1] == width:
        return np.ascontiguousarray(array.reshape(-1, width)), array.shape[:-1]
    rows = rows_of(array, width, what)
    return rows, (len(rows),)


def pair_of(values: Any, what: str, meaning: str) -> list[float]:
    """Two finite numbers."""
    try:
        pair = [float(value) for value in values]
    except (TypeError, ValueError):
        pair = []
    if len(pair) != 2:
        raise InputError(f"{what}: two numbers are needed, ({meaning}), not {values!r}")
    return pair


def picture_of(values: ArrayLike, what: str) -> NDArray[np.float32]:
    """A picture as height x width x channels of float32; integers become fractions of their largest value."""
    array: NDArray[Any] = np.asarray(values)
    if array.ndim == 2:
        array = array[:, :, np.newaxis]
    if array.ndim != 3:
        raise InputError(f"{what}: a picture of shape (height, width) or (height, width, channels) is needed, not {array.shape}")
    if array.dtype.kind not in "biuf":
        raise InputError(f"{what}: a picture of numbers is needed, not of {array.dtype}")
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


def short(value: Any) -> str:
    """A value as a repr of a few words: shape and type of an array."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{list(value.shape)}"
    text = repr(value)
    return text if len(text) < 60 else text[:57] + "..."
