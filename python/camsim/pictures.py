"""The camera on pictures from elsewhere, comparison of pictures, and calibration boards."""

from __future__ import annotations

import json
import math
import os
import pathlib
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _camsim, _toml
from ._arrays import linear_of, numbers_of, pair_of, picture_of, rows_of
from ._errors import InputError, forget_paths, name_path
from .scenario import Scenario

Path = str | os.PathLike[str]


@dataclass(frozen=True, eq=False)
class Twist:
    """Constant velocity and angular rate in the camera's own axes (right, down, forwards)."""

    velocity_m_s: Sequence[float] = (0.0, 0.0, 0.0)
    """Right, down, forwards, m/s; three numbers."""
    angular_rate_rad_s: Sequence[float] = (0.0, 0.0, 0.0)
    """About the axes right, down and forwards, by the right hand, rad/s; three numbers."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of the camera about the stamp; between rows it moves straight and turns at a constant rate."""

    t_s: ArrayLike
    """Times, seconds; shape (N,)."""
    position_m: ArrayLike
    """Optical centres in the world; shape (N, 3)."""
    world_from_camera_wxyz: ArrayLike
    """Attitudes of the optical frame, scalar first; shape (N, 4)."""
    stamp_s: float = 0.0
    """The frame's stamp, on the clock of `t_s`."""

    @property
    def table(self) -> NDArray[np.float64]:
        """All of it, a row for each pose."""
        t_s = np.asarray(self.t_s, dtype=np.float64).reshape(-1, 1)
        parts = (t_s, rows_of(self.position_m, 3, "position_m"), rows_of(self.world_from_camera_wxyz, 4, "world_from_camera_wxyz"))
        return np.ascontiguousarray(np.hstack(parts))


@dataclass(frozen=True, eq=False)
class Flow:
    """Optical flow of the ideal picture: motion of camera and objects together."""

    px: ArrayLike
    """Where the content of each pixel is after the interval, less where it is: pixels, positive to the right and down;
    shape (height, width, 2)."""
    interval_ms: float
    """Length of the interval, which begins at the picture's instant; negative for a flow to the picture before."""


@dataclass(frozen=True, eq=False)
class _FlowArgument:
    px: NDArray[np.float32]
    interval_ms: float


@dataclass(frozen=True)
class _FrameArgument:
    focal_px: list[float]
    principal_point_px: list[float] | None
    instant_ms: float
    mark_holes: bool


@dataclass(frozen=True)
class _SettingsArgument:
    paper: bool
    blur_samples: int | None
    seed: int
    frame: int


@dataclass(frozen=True, eq=False, repr=False)
class Applied:
    """A picture of the imperfect camera."""

    color: NDArray[np.float32]
    """Linear R, G, B, A; A is 0 where there is no source. Height x width x 4."""
    depth: NDArray[np.float32]
    """Planar depth in the camera of each row, metres; 0 where nothing is. Height x width."""
    without_source: dict[str, int]
    """Numbers of pixels without a source: `no_ray`, `outside`, `holes`, `unknown_flow`, `torn_flow`."""

    def __repr__(self) -> str:
        height, width = self.depth.shape
        return f"<camsim.Applied: {width}x{height}, {sum(self.without_source.values())} pixels without a source>"


def apply(
    camera: Scenario | Mapping[str, Any] | Path,
    color: ArrayLike,
    depth: ArrayLike | None = None,
    motion: Twist | Poses | Flow = Twist(),
    *,
    focal_px: Sequence[float],
    principal_point_px: Sequence[float] | None = None,
    instant_ms: float = 0.0,
    holes: str = "far",
    preset: str = "default",
    blur_samples: int | None = None,
    seed: int = 0,
    frame: int = 0,
) -> Applied:
    """What a camera would have taken instead of a perfect one: `camsim apply` on arrays.

    The ideal picture should show 10 to 20 % more than the camera does: lens and motion look beyond its border.

    :param camera: A scenario, the keys of `[camera]`, or a CAMERA.toml (or calibration of another program).
    :param color: The ideal picture, height x width x 3 or 4: bytes are sRGB, floats are linear.
    :param depth: Planar depth, metres, height x width; 0, NaN and 1e9 or more are none. Needed where the camera moves.
    :param motion: How the camera moves about the stamp.
    :param focal_px: fx, fy of the ideal picture.
    :param principal_point_px: cx, cy of it; its centre if omitted.
    :param instant_ms: Its instant, after the stamp.
    :param holes: Where there is no depth: ``"far"`` (infinitely far) or ``"mark"`` (no source).
    :param preset: ``"default"`` or ``"paper"``.
    :param blur_samples: Number of exposure samples; by the length of the path if omitted.
    :param seed, frame: Of the noise.

    >>> camera = {"size_px": [640, 480], "focal_px": [420, 420], "fps": 30, "shutter": {"readout_ms": 30}}
    >>> turned = camsim.apply(camera, color, motion=camsim.Twist(angular_rate_rad_s=[0, 0.5, 0]), focal_px=[400, 400])
    """
    if holes not in ("far", "mark"):
        raise InputError(f'holes {holes!r}: there are "far" and "mark"')
    if preset not in ("default", "paper"):
        raise InputError(f'preset {preset!r}: there are "default" and "paper"')
    if isinstance(motion, Flow):
        px = np.ascontiguousarray(motion.px, dtype=np.float32)
        if px.ndim != 3 or px.shape[2] != 2:
            raise InputError(f"motion.px: a flow of shape (height, width, 2) is needed, not {px.shape}")
        native_motion: Any = _FlowArgument(px, float(motion.interval_ms))
    elif isinstance(motion, (Twist, Poses)):
        native_motion = motion
    else:
        raise TypeError(f"motion: a camsim.Twist, camsim.Poses or camsim.Flow is needed, not {type(motion).__name__}")
    if depth is not None:
        depth = numbers_of(depth, "depth")
        if depth.ndim != 2:
            raise InputError(f"depth: an array of shape (height, width) is needed, not {depth.shape}")
    about = _FrameArgument(
        pair_of(focal_px, "focal_px", "fx, fy"),
        None if principal_point_px is None else pair_of(principal_point_px, "principal_point_px", "cx, cy"),
        float(instant_ms),
        holes == "mark",
    )
    made = _camsim.apply(
        _camera(camera),
        linear_of(color, "color"),
        None if depth is None else np.ascontiguousarray(depth, dtype=np.float32),
        native_motion,
        about,
        _SettingsArgument(preset == "paper", blur_samples, seed, frame),
    )
    return Applied(made.pop("color"), made.pop("depth"), made)


def _camera(camera: Scenario | Mapping[str, Any] | Path) -> _camsim.Camera:
    if isinstance(camera, Scenario):
        return camera._native.camera_keys()
    if not isinstance(camera, Mapping):
        return _camsim.Camera.load(camera, None)
    with tempfile.TemporaryDirectory(prefix="camsim-") as folder:
        path = pathlib.Path(folder) / "camera.toml"
        path.write_text(_toml.document_text(camera), encoding="utf-8")
        name_path(str(path), "camera")
        try:
            return _camsim.Camera.load(path, None)
        finally:
            forget_paths(folder)


@dataclass(frozen=True)
class Comparison:
    """Differences between two pictures or two folders of them, over all values but alpha, in the units of the pictures.

    If a NaN or an infinity of one picture faces another value, `rmse`, `max`, `psnr_db` and `ssim` are NaN.
    """

    rmse: float
    """Root mean square difference."""
    max: float
    """Largest absolute difference."""
    psnr_db: float
    """Peak signal-to-noise ratio for a peak of 1; infinite for equal pictures."""
    ssim: float | None
    """Structural similarity of luminance, 1 for equal pictures; None below 11 pixels of width or height."""
    differing: float
    """Share of pixels that differ at all, in alpha too; 0 to 1."""
    non_finite: int
    """Number of pixels with a NaN or an infinity in either picture; where both are alike, the figures leave them out."""
    formats: tuple[dict[str, Any], ...] = ()
    """The same of all files of each `format` of two folders: EXR has linear values and PNG encoded ones."""
    files: tuple[dict[str, Any], ...] = ()
    """The same of each file of two folders, with its `file`."""
    only_in_a: tuple[str, ...] = ()
    """Pictures that only the first folder has."""
    only_in_b: tuple[str, ...] = ()


def compare(a: ArrayLike | Path, b: ArrayLike | Path) -> Comparison:
    """Compares two pictures, as arrays or files, or all pictures of the same name in two folders.

    Arrays have shape (height, width) or (height, width, channels); a fourth channel is alpha. Integers are compared
    as fractions of their largest value, as those of PNG files are.

    >>> camsim.compare(rolling.color, sharp.color).psnr_db
    >>> camsim.compare("run-1/color", "run-2/color").rmse
    """
    if isinstance(a, (str, os.PathLike)) and isinstance(b, (str, os.PathLike)):
        report: dict[str, Any] = json.loads(_camsim.compare_files(a, b))
        report.update({name: tuple(map(_told, report[name])) for name in ("formats", "files")})
        report.update({name: tuple(report[name]) for name in ("only_in_a", "only_in_b")})
        return Comparison(**_told(report))
    if isinstance(a, (str, os.PathLike)) or isinstance(b, (str, os.PathLike)):
        raise InputError("compare two files or folders, or two arrays")
    return Comparison(**_told(json.loads(_camsim.compare(picture_of(a, "a"), picture_of(b, "b")))))


def _told(figures: dict[str, Any]) -> dict[str, Any]:
    """Figures with NaN and infinity where JSON, which has neither, has null."""
    if figures["rmse"] is None:
        figures.update(rmse=math.nan, max=math.nan, psnr_db=math.nan, ssim=math.nan)
    elif figures["psnr_db"] is None:
        figures.update(psnr_db=math.inf)
    return figures


@dataclass(frozen=True, eq=False)
class Board:
    """A calibration board: its picture, and the points that calibration programs detect."""

    picture: NDArray[np.uint8]
    """Linear light, 0 black to 255 white; height x width."""
    ids: NDArray[np.uint32]
    """Numbers of the points, as OpenCV and Kalibr count them; shape (N,)."""
    points_m: NDArray[np.float64]
    """Positions from the board's centre, right and down, metres; shape (N, 2)."""
    points_ned_m: NDArray[np.float64] | None
    """Positions in the world, metres; shape (N, 3). None for a board without a scenario."""


def board(source: Scenario | Mapping[str, Any] | Path) -> Board:
    """The board of a scenario, of the keys of `[scene.board]`, or of Kalibr's target YAML.

    >>> board = camsim.board({"kind": "chessboard", "columns": 9, "rows": 6, "size_m": 0.03})
    >>> board.points_m.shape
    (54, 2)
    """
    if isinstance(source, Scenario):
        parts = source._native.board()
        if parts is None:
            raise InputError("the scenario has no [scene.board]")
    elif isinstance(source, Mapping):
        parts = _camsim.board_of_keys(json.dumps(_plain(source)))
    elif str(os.fspath(source)).lower().endswith((".yaml", ".yml")):
        parts = _camsim.board_of_file(source)
    else:
        return board(Scenario.load(source))
    return Board(**parts)


def _plain(tree: Any) -> Any:
    if isinstance(tree, Mapping):
        return {key: _plain(item) for key, item in tree.items()}
    if isinstance(tree, os.PathLike):
        return os.fspath(tree)
    return tree.tolist() if hasattr(tree, "tolist") else tree


def verify(scenario: Scenario, frames: int | Sequence[int] | None = None, *, pictures: bool = False) -> dict[str, Any]:
    """Measures errors against the reference renderer, which traces exact rays: slow. See `camsim verify --json`.

    :param frames: A number, or several; five, evenly spread, if omitted.
    :param pictures: Measure the error of the pictures, too.
    :returns: `kept` says whether all tolerances are; `frames` has the figures of each.

    >>> camsim.verify(scenario, [7])["kept"]
    True
    """
    numbers = None
    if frames is not None:
        wanted = frames if isinstance(frames, Iterable) and not isinstance(frames, str) else [frames]
        numbers = sorted({scenario._number(frame) for frame in wanted})
        if not numbers:
            raise InputError("verify: frames is empty: give numbers of frames, or leave it out")
    report: dict[str, Any] = json.loads(scenario._native.verify(numbers, pictures))
    return report
