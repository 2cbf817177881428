"""Logs, terrains and pictures from arrays, instead of files."""

from __future__ import annotations

import io
import math
import os
import pathlib
import shutil
import struct
import tempfile
import weakref
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _toml
from ._arrays import numbers_of, rows_of
from ._errors import InputError, forget_paths, name_path


_MOST_NUMBERS = 20_000
"""Numbers that a list of a scenario may have."""
_PICTURES = frozenset({"image", "ortho", "vignette"})
"""Keys of pictures."""


@dataclass(frozen=True, eq=False, repr=False)
class PoseTable:
    """A flight from arrays, instead of the file of `flight.log`.

    >>> t_s = np.linspace(0, 10, 101)
    >>> log = camsim.PoseTable(t_s, position_ned_m=np.c_[20 * t_s, 0 * t_s, 0 * t_s - 100])
    >>> ground = {"pattern": {"image": np.full((8, 8, 3), 128, dtype=np.uint8), "width_m": 100}}
    >>> scenario = camsim.Scenario.from_dict({"flight": {"log": log, "attitude": "track"}, "scene": ground})
    """

    t_s: ArrayLike
    """Times, ascending, seconds; shape (N,)."""
    position_ned_m: ArrayLike | None = None
    """Positions of the platform: north, east, down, metres; shape (N, 3)."""
    geodetic: ArrayLike | None = None
    """Instead of them: latitude, longitude, degrees, and height, m (as `flight.height` says), in this order; shape (N, 3)."""
    ned_from_body_wxyz: ArrayLike | None = None
    """Attitudes, scalar first, from body axes (forward, right, down); shape (N, 4)."""
    angles_deg: ArrayLike | None = None
    """Instead of them: roll, pitch, yaw, degrees; shape (N, 3). Without attitudes set
    `flight.attitude = "track"`: the nose looks along the path."""

    def __post_init__(self) -> None:
        if self.position_ned_m is None and self.geodetic is None:
            raise InputError("PoseTable: positions are missing: give position_ned_m or geodetic")
        if self.position_ned_m is not None and self.geodetic is not None:
            raise InputError("PoseTable: give position_ned_m or geodetic, not both")
        if self.ned_from_body_wxyz is not None and self.angles_deg is not None:
            raise InputError("PoseTable: give ned_from_body_wxyz or angles_deg, not both")
        self._parts()

    def _parts(self) -> list[tuple[str, NDArray[np.float64]]]:
        """Names of columns, as those of a log file, with their values."""
        t_s = numbers_of(self.t_s, "PoseTable: t_s")
        if t_s.size != max(t_s.shape, default=0) or t_s.size == 0:
            raise InputError(f"PoseTable: t_s: an array of shape (N,) is needed, not {t_s.shape}")
        parts = [("t_s", t_s.reshape(-1, 1))]
        for what, names, values in (
            ("position_ned_m", "n_m,e_m,d_m", self.position_ned_m),
            ("geodetic", "lat_deg,lon_deg,height_m", self.geodetic),
            ("ned_from_body_wxyz", "qw,qx,qy,qz", self.ned_from_body_wxyz),
            ("angles_deg", "roll_deg,pitch_deg,yaw_deg", self.angles_deg),
        ):
            if values is None:
                continue
            rows = rows_of(values, names.count(",") + 1, f"PoseTable: {what}")
            if len(rows) != t_s.size:
                raise InputError(f"PoseTable: t_s has {t_s.size} times, and {what} has {len(rows)} rows: give one for each time")
            if what == "ned_from_body_wxyz" and (np.linalg.norm(rows, axis=1) < 1e-6).any():
                raise InputError("PoseTable: ned_from_body_wxyz has quaternions of zeros: give unit ones, scalar first")
            parts.append((names, rows))
        return parts

    def __repr__(self) -> str:
        given = [field.name for field in fields(self)[1:] if getattr(self, field.name) is not None]
        return f"<camsim.PoseTable: {np.size(self.t_s)} times with {', '.join(given)}>"

    def csv(self) -> str:
        """The table as text of a log file, with all digits."""
        parts = self._parts()
        lines = [",".join(names for names, _ in parts)]
        lines += [",".join(map(repr, row)) for row in np.hstack([rows for _, rows in parts]).tolist()]
        return "\n".join(lines) + "\n"


@dataclass(frozen=True, eq=False, repr=False)
class HeightMap:
    """Heights from an array, instead of the file of `scene.terrain.dem`.

    Its rows lead from north to south, its columns from west to east.

    >>> heights_m = 5 * np.random.default_rng(1).standard_normal((64, 64))
    >>> dem = camsim.HeightMap.around(heights_m, lat_deg=46.5, lon_deg=8.2, step_m=10)
    >>> {"scene": {"terrain": {"dem": dem, "ortho": picture}}}      # picture: bytes, height x width x 3, sRGB
    """

    heights_m: ArrayLike
    """Shape (rows, columns); NaN where there is no ground."""
    north_west: tuple[float, float]
    """x, then y of the first height in the coordinate system: easting, northing, or longitude, latitude, degrees."""
    step: tuple[float, float]
    """Distance of columns (x), then of rows (y), in the same unit, both above 0."""
    epsg: int = 4326
    """The coordinate system: 4326 is longitude and latitude; else one of `docs/reference/inputs/TERRAIN.md`."""

    def __post_init__(self) -> None:
        heights = numbers_of(self.heights_m, "HeightMap: heights_m")
        if heights.ndim != 2 or min(heights.shape) < 2:
            raise InputError(f"HeightMap: heights of shape (rows, columns), two of each at least, not {heights.shape}")
        if not np.isfinite(heights).any():
            raise InputError("HeightMap: heights_m has no finite height: NaN is for positions without ground")
        for what, pair in (("north_west", self.north_west), ("step", self.step)):
            if np.shape(pair) != (2,) or not np.isfinite(pair).all():
                raise InputError(f"HeightMap: {what}: two finite numbers are needed, not {pair!r}")
        if min(self.step) <= 0:
            raise InputError(f"HeightMap: step: must be above 0, not {self.step!r}; rows lead south and columns east")

    def __repr__(self) -> str:
        rows, columns = np.shape(self.heights_m)
        return f"<camsim.HeightMap: {rows} x {columns}, north-west {self.north_west}, step {self.step}, EPSG:{self.epsg}>"

    @classmethod
    def around(cls, heights_m: ArrayLike, *, lat_deg: float, lon_deg: float, step_m: float) -> HeightMap:
        """Heights with their middle at a position. Steps in degrees are constant, so that the length of those to the
        east changes with latitude, as it does on the Earth."""
        if np.ndim(heights_m) != 2:
            raise InputError(f"HeightMap: heights of shape (rows, columns) are needed, not {np.shape(heights_m)}")
        if not step_m > 0:
            raise InputError(f"HeightMap: step_m: must be above 0, not {step_m!r}")
        if not (abs(lat_deg) < 90 and abs(lon_deg) <= 360):
            raise InputError(f"HeightMap: no such position: lat_deg = {lat_deg!r}, lon_deg = {lon_deg!r}")
        rows, columns = np.shape(heights_m)
        sin = math.sin(math.radians(lat_deg))
        semi_axis_m, eccentricity2 = 6_378_137.0, 6.694_379_990_141_317e-3
        to_normal = 1.0 - eccentricity2 * sin * sin
        north_m = semi_axis_m * (1.0 - eccentricity2) / to_normal**1.5
        east_m = semi_axis_m / math.sqrt(to_normal) * math.cos(math.radians(lat_deg))
        step = (math.degrees(step_m / east_m), math.degrees(step_m / north_m))
        corner = (lon_deg - step[0] * (columns - 1) / 2, lat_deg + step[1] * (rows - 1) / 2)
        return cls(heights_m, corner, step)

    def tiff(self) -> bytes:
        """The heights as a GeoTIFF of the same numbers."""
        heights = np.asarray(self.heights_m)
        kind = np.float32 if heights.dtype == np.float32 else np.float64
        heights = np.ascontiguousarray(heights, dtype=np.dtype(kind).newbyteorder("<"))
        rows, columns = heights.shape
        is_geographic = 4000 <= self.epsg < 5000
        # 1024: projected or geographic; 1025: pixels are points; 2048 or 3072: the coordinate system.
        keys = [1, 1, 0, 3, 1024, 0, 1, 2 if is_geographic else 1, 1025, 0, 1, 2]
        keys += [2048 if is_geographic else 3072, 0, 1, self.epsg]
        tie = [0.0, 0.0, 0.0, *map(float, self.north_west), 0.0]
        tags: list[tuple[int, str, list[Any]]] = [
            (256, "I", [columns]),
            (257, "I", [rows]),
            (258, "H", [8 * heights.itemsize]),
            (259, "H", [1]),
            (262, "H", [1]),
            (273, "I", [8]),
            (277, "H", [1]),
            (278, "I", [rows]),
            (279, "I", [heights.nbytes]),
            (339, "H", [3]),
            (33550, "d", [*map(float, self.step), 0.0]),
            (33922, "d", tie),
            (34735, "H", keys),
        ]
        return _tiff(heights.tobytes(), tags)


def _tiff(pixels: bytes, tags: list[tuple[int, str, list[Any]]]) -> bytes:
    """A little-endian TIFF: header, pixels, directory, values that do not fit into it."""
    codes = {"H": 3, "I": 4, "d": 12}
    pixels += b"\0" * (-len(pixels) % 8)
    directory = 8 + len(pixels)
    offset = directory + 2 + 12 * len(tags) + 4
    entries, values = b"", b""
    for tag, code, numbers in tags:
        packed = struct.pack(f"<{len(numbers)}{code}", *numbers)
        if len(packed) > 4:
            field = struct.pack("<I", offset + len(values))
            values += packed + b"\0" * (-len(packed) % 8)
        else:
            field = packed.ljust(4, b"\0")
        entries += struct.pack("<HHI", tag, codes[code], len(numbers)) + field
    head = struct.pack("<2sHI", b"II", 42, directory)
    return head + pixels + struct.pack("<H", len(tags)) + entries + b"\0\0\0\0" + values


def _png(picture: NDArray[np.uint8]) -> bytes:
    """Bytes of a grey or RGB picture as PNG."""
    height, width = picture.shape[:2]
    channels = picture.shape[2] if picture.ndim == 3 else 1
    if picture.ndim > 3 or channels not in (1, 3):
        raise InputError(f"a picture of shape (height, width) or (height, width, 3) is needed, not {picture.shape}; leave alpha out")
    lines = np.zeros((height, 1 + width * channels), dtype=np.uint8)
    lines[:, 1:] = picture.reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 0, 0, 0, 0)
    out = io.BytesIO(b"\x89PNG\r\n\x1a\n")
    out.seek(0, io.SEEK_END)
    for name, data in ((b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes(), 1)), (b"IEND", b"")):
        out.write(struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)))
    return out.getvalue()


def _removed(folder: str, owner: int) -> None:
    """Removes a folder, but not in a fork of the process that has made it."""
    forget_paths(folder)
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


def _is_nested(value: Sequence[Any]) -> bool:
    return not all(isinstance(item, (int, float, str)) for item in value)


def _check_length(value: Sequence[Any], key: str) -> None:
    """Refuses pictures and tables as lists of numbers, which would take minutes to read."""
    count, rest = 0, list(value)
    while rest and count <= _MOST_NUMBERS:
        item = rest.pop()
        if isinstance(item, (list, tuple)):
            rest += item
        else:
            count += isinstance(item, (int, float))
    if count > _MOST_NUMBERS:
        raise InputError(
            f"{key}: a list of more than {_MOST_NUMBERS} numbers is no value of a scenario: give a picture as an array of uint8, "
            "a log as camsim.PoseTable, heights as camsim.HeightMap"
        )


class InputFiles:
    """Files that stand for arrays of a scenario, in a folder of their own that lives as long as it is used."""

    def __init__(self, files: Mapping[str, bytes] | None = None) -> None:
        self._held: str | None = None
        self._cleanup: weakref.finalize[[str, int], Any] | None = None
        self._count = 0
        for name, content in (files or {}).items():
            self._write(name, content)

    @property
    def folder(self) -> pathlib.Path:
        """The folder, as the system knows it."""
        if self._held is None:
            self._held = os.path.realpath(tempfile.mkdtemp(prefix="camsim-inputs-"))
            name_path(self._held + os.sep, "")
            self._cleanup = weakref.finalize(self, _removed, self._held, os.getpid())
        return pathlib.Path(self._held)

    def _write(self, name: str, content: bytes, words: str | None = None) -> str:
        """Writes a file. `words` is what messages call it."""
        path = self.folder / name
        path.write_bytes(content)
        self._count += 1
        if words is not None:
            name_path(str(path), words)
        return str(path)

    def contents(self) -> dict[str, bytes]:
        """All files by name."""
        return {} if self._held is None else {path.name: path.read_bytes() for path in sorted(self.folder.iterdir())}

    def placed(self, value: Any, key: str = "") -> Any:
        """A tree with paths of files instead of arrays. `key` is for messages."""
        if isinstance(value, Mapping):
            return {name: self.placed(item, f"{key}.{name}" if key else str(name)) for name, item in value.items()}
        if isinstance(value, (list, tuple)):
            _check_length(value, key)
            return [self.placed(item, f"{key}.{k}") for k, item in enumerate(value)] if _is_nested(value) else list(value)
        if isinstance(value, PoseTable):
            return self._write(f"log-{self._count}.csv", value.csv().encode(), f"{key} (the camsim.PoseTable)")
        if isinstance(value, HeightMap):
            return self._write(f"dem-{self._count}.tif", value.tiff(), f"{key} (the camsim.HeightMap)")
        if hasattr(value, "__array__") and not isinstance(value, np.generic):
            return self._placed_array(np.asarray(value), key)
        return value

    def _placed_array(self, array: NDArray[Any], key: str) -> Any:
        leaf = key.rpartition(".")[2]
        if leaf == "log":
            raise InputError(f"{key}: an array is not a log: give camsim.PoseTable(t_s, ...)")
        if leaf == "dem":
            raise InputError(f"{key}: an array has no position on the Earth: give camsim.HeightMap(...) or camsim.HeightMap.around(...)")
        if array.ndim >= 2 and array.dtype == np.uint8:
            try:
                return self._write(f"picture-{self._count}.png", _png(array), f"{key} (the array)")
            except InputError as error:
                raise InputError(f"{key}: {error}") from None
        if array.ndim > 2 or array.size > _MOST_NUMBERS or (array.ndim == 2 and leaf in _PICTURES):
            raise InputError(
                f"{key}: {array.dtype} of shape {array.shape} is no picture that camsim takes: "
                "give uint8 sRGB of shape (height, width) or (height, width, 3)"
            )
        return array.tolist()

    def text(self, value: Any, key: str) -> str:
        """A value as text of TOML, with paths of files instead of arrays."""
        return _toml.value_text(self.placed(value, key), key)
