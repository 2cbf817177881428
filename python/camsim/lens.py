"""Lenses over arrays of points."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _camsim
from ._arrays import numbers_of, pair_of, points_of
from ._errors import InputError


class Lens:
    """A camera's lens: points to pixels and back, on all processors, in double precision.

    Points are in camera axes (right, down, forwards), in any unit of length; pixel (0, 0) is the centre of the
    top-left pixel. Models and coefficients are those of `[camera.lens]`, as OpenCV writes them. Lenses of the same
    numbers are equal.

    Points may be given in OpenCV's shapes too, (N, 1, 3) and (N, 1, 2); results then have the same leading shape.

    >>> lens = camsim.Lens((640, 480), (420, 421), model="brown-conrady", coefficients=[-0.22, 0.06])
    >>> pixels = lens.project([[0.1, 0.0, 1.0], [0.0, 0.2, 1.0]])
    >>> lens.unproject(pixels)                     # unit rays
    >>> lens.undistort(pixels)                     # x/z and y/z
    """

    def __init__(
        self,
        size_px: Sequence[int],
        focal_px: Sequence[float],
        principal_point_px: Sequence[float] | None = None,
        *,
        model: str = "pinhole",
        coefficients: ArrayLike = (),
    ) -> None:
        """
        :param size_px: Width, height.
        :param focal_px: fx, fy.
        :param principal_point_px: cx, cy; the centre of the picture if omitted.
        :param model: As `camera.lens.model`: ``"pinhole"``, ``"brown-conrady"``, ``"kannala-brandt"`` ...
        :param coefficients: In the model's order; trailing zeros may be omitted. OpenCV's shape (1, N) will do.
        """
        size = pair_of(size_px, "size_px", "width, height")
        if any(side <= 0 or side != int(side) or side >= 2**32 for side in size):
            raise InputError(f"size_px: two whole numbers above 0 are needed, (width, height), not {size_px!r}")
        centre = None if principal_point_px is None else pair_of(principal_point_px, "principal_point_px", "cx, cy")
        numbers: list[float] = numbers_of(coefficients, "coefficients").ravel().tolist()
        self._native = _camsim.Lens(list(map(int, size)), pair_of(focal_px, "focal_px", "fx, fy"), centre, model, numbers)

    @classmethod
    def load(cls, path: str | os.PathLike[str], camera: str | None = None) -> Lens:
        """The lens of a CAMERA.toml, or of a calibration by another program (`camsim camera import` lists them).

        :param camera: Name of the camera in a calibration of several.
        """
        return cls._of(_camsim.Camera.load(path, camera).lens())

    @classmethod
    def _of(cls, native: _camsim.Lens) -> Lens:
        lens = cls.__new__(cls)
        lens._native = native
        return lens

    @property
    def size_px(self) -> tuple[int, int]:
        """Width, height."""
        return self._native.size_px

    @property
    def focal_px(self) -> tuple[float, float]:
        """fx, fy."""
        return self._native.focal_px

    @property
    def principal_point_px(self) -> tuple[float, float]:
        """cx, cy."""
        return self._native.principal_point_px

    @property
    def model(self) -> str:
        """Name of the model."""
        return self._native.model

    @property
    def coefficients(self) -> list[float]:
        """All coefficients in the model's order."""
        return self._native.coefficients

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The 3 x 3 matrix K that OpenCV takes."""
        (fx, fy), (cx, cy) = self.focal_px, self.principal_point_px
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Pixels (N, 2) of points (N, 3) in camera axes. Points beside or behind the camera give NaN, unless the lens
        is wide enough to see them.

        Beyond the fold of the lens the formula is evaluated too: `valid` says which points the lens images.
        """
        return self._mapped(self._native.project, points, 3, "points", (2,))

    def distort(self, ideal: ArrayLike) -> NDArray[np.float64]:
        """Pixels (N, 2) of ideal points (N, 2): x/z and y/z."""
        return self._mapped(self._native.distort, ideal, 2, "ideal", (2,))

    def unproject(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Unit rays (N, 3) in camera axes of pixels (N, 2), at any angle off axis; NaN where the lens has no ray."""
        return self._mapped(self._native.unproject, pixels, 2, "pixels", (3,))

    def undistort(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Ideal points (N, 2), x/z and y/z, of pixels (N, 2); NaN where the lens has no ray before the camera.

        What `cv2.undistortPoints` and `cv2.fisheye.undistortPoints` approximate, to the last bits.
        """
        return self._mapped(self._native.undistort, pixels, 2, "pixels", (2,))

    def jacobian(self, points: ArrayLike) -> NDArray[np.float64]:
        """Derivatives (N, 2, 3) of the pixels of points (N, 3) by these points, analytic; NaN where `project` is."""
        return self._mapped(self._native.jacobian, points, 3, "points", (2, 3))

    def valid(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether the lens images points (N, 3), inside of the picture or not: within its fold, beyond which the
        formula gives mirror images that no real lens shows, and for most models before the camera. Shape (N,)."""
        seen: NDArray[np.bool_] = self._mapped(self._native.valid, points, 3, "points", ())
        return seen

    @staticmethod
    def _mapped(native: Any, points: ArrayLike, width: int, what: str, item: tuple[int, ...]) -> NDArray[Any]:
        rows, shape = points_of(points, width, what)
        mapped: NDArray[Any] = native(rows)
        return mapped.reshape(*shape, *item)

    def _numbers(self) -> tuple[Any, ...]:
        return self.size_px, self.focal_px, self.principal_point_px, self.model, tuple(self.coefficients)

    def __eq__(self, other: object) -> bool:
        return self._native.equals(other._native) if isinstance(other, Lens) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._numbers())

    def __reduce__(self) -> tuple[Any, ...]:
        """Lenses travel by their numbers."""
        if not self._native.is_plain:
            raise TypeError("this lens has more than model and coefficients (a table, an image circle, ...): pickle its scenario instead")
        return _lens_of, self._numbers()

    def __repr__(self) -> str:
        width, height = self.size_px
        return f"<camsim.Lens {self.model} {self.coefficients}: {width}x{height}, f = {self.focal_px} px>"


def _lens_of(size_px: Any, focal_px: Any, principal_point_px: Any, model: str, coefficients: Any) -> Lens:
    return Lens(size_px, focal_px, principal_point_px, model=model, coefficients=coefficients)
