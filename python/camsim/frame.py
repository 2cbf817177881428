"""A finished frame."""

from __future__ import annotations

import importlib
import os
import tempfile
import webbrowser
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _camsim
from ._channels import Channels
from ._errors import InputError


@dataclass(frozen=True, eq=False)
class Rows:
    """Time, pose and velocity of each row of the readout, as arrays of one length.

    There is a record for each sensor row, or for each column if the sensor is read sideways.

    >>> rows = frame.rows
    >>> readout_ms = (rows.t_mid_ns[-1] - rows.t_mid_ns[0]) * 1e-6
    """

    row: NDArray[np.uint32]
    """Number of the row, from 0; shape (N,)."""
    t_mid_ns: NDArray[np.int64]
    """Mid-exposure, nanoseconds on the clock of stamps; shape (N,)."""
    position_ned_m: NDArray[np.float64]
    """Optical centre: north, east, down, metres; shape (N, 3)."""
    ned_from_camera_wxyz: NDArray[np.float64]
    """Unit quaternion that takes optical camera axes to NED, scalar first; shape (N, 4)."""
    velocity_ned_m_s: NDArray[np.float64]
    """Velocity of the optical centre: north, east, down, m/s; shape (N, 3)."""
    exposure_ns: NDArray[np.int64]
    """Exposure time, nanoseconds; shape (N,)."""

    def __len__(self) -> int:
        return len(self.row)


@dataclass(frozen=True, eq=False)
class Pose:
    """Pose of a camera.

    >>> ned_from_camera = frame.pose.matrix
    """

    position_ned_m: NDArray[np.float64]
    """Optical centre: north, east, down, metres; shape (3,)."""
    ned_from_camera_wxyz: NDArray[np.float64]
    """Unit quaternion that takes optical camera axes to NED, scalar first; shape (4,)."""

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The same as a matrix that takes points from the camera's axes to NED, metres; shape (4, 4)."""
        w, x, y, z = self.ned_from_camera_wxyz
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:3, 3] = self.position_ned_m
        return matrix


@dataclass(frozen=True, eq=False)
class Source:
    """The pinhole camera whose pixels `x` and `y` of `coords` are (`ideal_*` in `frames.csv`)."""

    size_px: tuple[int, int]
    """Width, height."""
    focal_px: tuple[float, float]
    """fx, fy."""
    principal_px: tuple[float, float]
    """cx, cy."""
    t_ns: int
    """Instant, nanoseconds on the clock of stamps."""
    position_ned_m: NDArray[np.float64]
    """Optical centre at that instant: north, east, down, metres; shape (3,)."""
    ned_from_camera_wxyz: NDArray[np.float64]
    """Its attitude, scalar first; shape (4,)."""


class Frame(Channels, Mapping[str, NDArray[Any]]):
    """A finished frame: numpy arrays of its channels, by name and as attributes.

    Each array is the memory that the renderer has filled, without a copy, and keeps it as long as the array is used:
    numpy calls that a view of its `base` (`flags.owndata` is False). ``__dlpack__`` hands it on to other libraries. Images are height x width (x components), row by row from
    the top-left pixel; `docs/reference/CHANNELS.md` says what each channel holds.

    >>> frame = scenario[7]
    >>> frame.depth.shape, frame.depth.dtype
    ((480, 640), dtype('float32'))
    >>> sorted(frame)
    ['color', 'depth']
    """

    __slots__ = ("_arrays", "_encoding", "camera", "index", "pose", "rows", "size_px", "source", "stamp_ns", "twins")

    index: int
    """Number of the frame, from 0."""
    camera: str
    """Name of the camera; empty where it has none."""
    stamp_ns: int
    """Stamp, nanoseconds on the clock of `output.stamps`."""
    size_px: tuple[int, int]
    """Width, height."""
    pose: Pose
    """Pose of the camera when the frame was taken, as in `frames.csv`: of a rolling shutter at the middle row."""
    rows: Rows
    """Time, pose and velocity of each row."""
    source: Source
    """The pinhole camera that `coords` refers to."""
    twins: dict[str, list[Frame]]
    """Pictures of each twin by its name, if `Scenario.frames` was asked for them: one, or all of a burst."""

    def __init__(self, parts: Mapping[str, Any], camera: str, encoding: str) -> None:
        self.index = parts["index"]
        self.camera = camera
        self.stamp_ns = parts["stamp_ns"]
        self.size_px = parts["size_px"]
        self.pose = Pose(**parts["pose"])
        self.rows = Rows(**parts["rows"])
        self.source = Source(**parts["source"])
        self._arrays: dict[str, NDArray[Any]] = parts["channels"]
        self._encoding = encoding
        self.twins = {}

    def twin(self, name: str, instant: int = 0) -> Frame:
        """The same frame by a better camera: a picture of `[[output.twin]]`, number `instant` of a burst.

        >>> for frame in scenario.frames(twins=True):
        ...     train(frame.color, frame.twin("sharp").color)
        """
        if name not in self.twins:
            held = ", ".join(self.twins) or "none"
            raise KeyError(f"the frame has no twin {name!r}: ask for it by frames(twins=True); it has {held}")
        return self.twins[name][instant]

    def __getitem__(self, channel: str) -> NDArray[Any]:
        try:
            return self._arrays[channel]
        except KeyError:
            held = ", ".join(self._arrays) or "none"
            message = f"the frame has no channel {channel!r}: ask for it by channels=[...]; it has {held}"
            raise KeyError(message) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        width, height = self.size_px
        camera = f" of {self.camera}" if self.camera else ""
        return f"<camsim.Frame {self.index}{camera}: {width}x{height}, {', '.join(self._arrays)}>"

    # A frame is equal to itself alone: comparing pictures is `camsim.compare`.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def _attribute(self, channel: str) -> NDArray[Any]:
        if channel in self._arrays:
            return self._arrays[channel]
        held = ", ".join(self._arrays) or "none"
        raise AttributeError(f"the frame has no channel {channel!r}: ask for it by channels=[...]; it has {held}")

    def to_srgb8(self) -> NDArray[np.uint8]:
        """The picture in 8 bits of sRGB, as photographs and networks have it: uint8, height x width x 3.

        >>> frame.to_srgb8().shape
        (480, 640, 3)
        """
        return _camsim.srgb8(self.color)

    def show(self) -> None:
        """Shows the picture: in a notebook below the cell, else by the program that the system has for PNG files."""
        notebook = _notebook()
        if notebook is not None:
            notebook.display.display(self)
            return
        path = Path(tempfile.mkdtemp(prefix="camsim-")) / f"frame-{self.index}.png"
        self.save(path, "srgb8")
        webbrowser.open(path.as_uri())

    def _repr_png_(self) -> bytes | None:
        """The picture, for notebooks."""
        if "color" not in self._arrays:
            return None
        with tempfile.TemporaryDirectory(prefix="camsim-") as folder:
            path = Path(folder) / "frame.png"
            self.save(path, "srgb8")
            return path.read_bytes()

    def save(self, path: str | os.PathLike[str], encoding: str | None = None) -> None:
        """Writes the picture: `.png` in an encoding of `camera.photometric.output` (the scenario's by default),
        `.exr` with linear 32-bit floats. Folders of the path that do not exist are made.

        >>> scenario[0].save("first.png")
        """
        if "color" not in self._arrays:
            raise InputError('the frame has no picture to write: ask for it by channels=["color", ...]')
        if not os.fspath(path).lower().endswith((".png", ".exr")):
            raise InputError(f"cannot write {os.fspath(path)}: pictures are .png or .exr")
        _camsim.write_picture(path, self.color, encoding or self._encoding)


def _notebook() -> Any:
    """IPython, where it runs this code."""
    try:
        ipython = importlib.import_module("IPython")
    except ImportError:
        return None
    return ipython if ipython.get_ipython() is not None else None
