"""Readers of camsim's files that share nothing with it."""

from __future__ import annotations

import csv
import pathlib
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray


def read_exr(path: pathlib.Path) -> dict[str, NDArray[np.float32]]:
    """The planes of an EXR of 32-bit floats, uncompressed or by ZIP."""
    data = path.read_bytes()
    assert struct.unpack_from("<I", data)[0] == 20000630
    at, attributes = 8, {}
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        (size,) = struct.unpack_from("<I", data, at)
        attributes[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    lines = {b"\0": 1, b"\3": 16}[attributes["compression"]]
    names, channels, where = [], attributes["channels"], 0
    while channels[where]:
        name, where = _text(channels, where)
        assert struct.unpack_from("<I", channels, where)[0] == 2, "written with output.exr_pixel = float"
        names.append(name)
        where += 16
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    offsets = struct.unpack_from(f"<{-(-height // lines)}Q", data, at + 1)
    planes = np.empty((len(names), height, width), dtype=np.float32)
    for offset in offsets:
        y, size = struct.unpack_from("<iI", data, offset)
        block = data[offset + 8 : offset + 8 + size]
        rows = min(lines, bottom + 1 - y)
        if len(block) < 4 * rows * len(names) * width:
            block = _unzipped(block)
        numbers = np.frombuffer(block, "<f4").reshape(rows, len(names), width)
        planes[:, y - top : y - top + rows] = numbers.transpose(1, 0, 2)
    return dict(zip(names, planes, strict=True))


def _unzipped(block: bytes) -> bytes:
    """Undoes zlib, differences of neighbours, and the parting of even and odd bytes."""
    packed = np.frombuffer(zlib.decompress(block), np.uint8).astype(np.int64)
    packed[1:] -= 128
    plain = np.cumsum(packed).astype(np.uint8)
    half = -(-len(plain) // 2)
    whole = np.empty_like(plain)
    whole[0::2], whole[1::2] = plain[:half], plain[half:]
    return whole.tobytes()


def _text(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def read_png(path: pathlib.Path) -> NDArray[Any]:
    """A PNG of 8 or 16 bits, without palette or interlacing."""
    data, at, packed, header = path.read_bytes(), 8, b"", b""
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        content = data[at + 8 : at + 8 + size]
        header = content if kind == b"IHDR" else header
        packed += content if kind == b"IDAT" else b""
        at += 12 + size
    width, height, bits, colour = struct.unpack_from(">IIBB", header)
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    step = channels * bits // 8
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * step)
    plain = np.zeros((height + 1, width * step), dtype=np.uint8)
    for y, line in enumerate(lines):
        plain[y + 1] = _unfiltered(int(line[0]), line[1:], plain[y], step)
    image = plain[1:].reshape(height, -1).copy().view(">u2" if bits == 16 else np.uint8)
    image = image.astype(np.uint16 if bits == 16 else np.uint8)
    return image.reshape(height, width) if channels == 1 else image.reshape(height, width, channels)


def _unfiltered(kind: int, line: NDArray[np.uint8], above: NDArray[np.uint8], step: int) -> NDArray[np.uint8]:
    if kind == 0:
        return line
    if kind == 2:
        return line + above
    out = [0] * len(line)
    for i, value in enumerate(line.tolist()):
        left = out[i - step] if i >= step else 0
        up, corner = int(above[i]), int(above[i - step]) if i >= step else 0
        guess = [0, left, up, (left + up) // 2, _paeth(left, up, corner)][kind]
        out[i] = (value + guess) & 255
    return np.array(out, dtype=np.uint8)


def _paeth(left: int, up: int, corner: int) -> int:
    estimate = left + up - corner
    return min((left, up, corner), key=lambda value: abs(estimate - value))


def read_table(path: pathlib.Path) -> dict[str, list[str]]:
    """The columns of a CSV file."""
    with open(path, newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, map(list, zip(*rows)), strict=True))


def numbers(table: dict[str, list[str]], *names: str) -> NDArray[np.float64]:
    """Columns side by side."""
    return np.array([[float(cell) for cell in table[name]] for name in names]).T
