"""Motion of platform and camera, and samples of the sensors beside it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _camsim
from ._arrays import numbers_of
from ._errors import InputError


@dataclass(frozen=True, eq=False)
class BodyStates:
    """Motion of the platform: shape (3,) or (4,) for one instant, (N, 3) or (N, 4) for N."""

    position_ned_m: NDArray[np.float64]
    """North, east, down, metres."""
    velocity_ned_m_s: NDArray[np.float64]
    """m/s."""
    acceleration_ned_m_s2: NDArray[np.float64]
    """m/s^2."""
    ned_from_body_wxyz: NDArray[np.float64]
    """Unit quaternion, scalar first, that takes body axes (forward, right, down) to NED."""
    rate_body_rad_s: NDArray[np.float64]
    """Angular rate in body axes, rad/s."""
    angular_acceleration_body_rad_s2: NDArray[np.float64]
    """Its derivative, rad/s^2."""


@dataclass(frozen=True, eq=False)
class CameraStates:
    """Motion of the camera, with lever arm, mount and vibration; shapes as of `BodyStates`."""

    position_ned_m: NDArray[np.float64]
    """Optical centre: north, east, down, metres."""
    velocity_ned_m_s: NDArray[np.float64]
    """m/s."""
    ned_from_camera_wxyz: NDArray[np.float64]
    """Unit quaternion, scalar first, that takes optical camera axes (right, down, forwards) to NED."""
    rate_camera_rad_s: NDArray[np.float64]
    """Angular rate in camera axes, rad/s."""


class Trajectory:
    """The flown motion at any instant, exactly: the log after cleaning, speed factor and tracker.

    Beyond the log (`span_s`) the platform flies on at its last velocity and rate, however far: compare times with
    `span_s` if that is not wanted. An instant that is NaN or infinite gives NaN in every field.

    >>> trajectory = scenario.trajectory
    >>> trajectory.at(12.5).velocity_ned_m_s
    >>> trajectory.camera_at_ns(frame.rows.t_mid_ns).position_ned_m      # equal to frame.rows.position_ned_m
    """

    def __init__(self, native: _camsim.Trajectory) -> None:
        self._native = native

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last instant of the log, seconds on the clock of stamps."""
        first_s, last_s = self._native.span_s
        return first_s + self._native.epoch_ns * 1e-9, last_s + self._native.epoch_ns * 1e-9

    def at(self, t_s: ArrayLike) -> BodyStates:
        """The platform at instants, seconds on the clock of stamps, as `t_s` of `trajectory.csv`.

        Clocks that count from 1970 have microseconds in doubles: `at_ns` is exact.
        """
        return _states(BodyStates, self._native.body_at, self._path_s(t_s), np.ndim(t_s))

    def at_ns(self, t_ns: ArrayLike) -> BodyStates:
        """The platform at instants, whole nanoseconds, as `Frame.stamp_ns` and `Rows.t_mid_ns`."""
        return _states(BodyStates, self._native.body_at, self._path_s_of_ns(t_ns), np.ndim(t_ns))

    def camera_at(self, t_s: ArrayLike) -> CameraStates:
        """The camera at instants, seconds on the clock of stamps."""
        return _states(CameraStates, self._native.camera_at, self._path_s(t_s), np.ndim(t_s))

    def camera_at_ns(self, t_ns: ArrayLike) -> CameraStates:
        """The camera at instants, whole nanoseconds."""
        return _states(CameraStates, self._native.camera_at, self._path_s_of_ns(t_ns), np.ndim(t_ns))

    def _path_s(self, t_s: ArrayLike) -> NDArray[np.float64]:
        return _row(numbers_of(t_s, "t_s"), "t_s") - self._native.epoch_ns * 1e-9

    def _path_s_of_ns(self, t_ns: ArrayLike) -> NDArray[np.float64]:
        stamps: NDArray[Any] = np.asarray(t_ns)
        # Python's own numbers beyond 64 bits are objects.
        whole = numbers_of(t_ns, "t_ns") if stamps.dtype.kind in "buf" else stamps
        is_whole = whole.dtype.kind == "i" or whole.dtype.kind == "f" and bool(np.all(np.floor(whole) == whole))
        if not is_whole or (np.abs(whole.astype(np.float64)) >= 2.0**63).any():
            raise InputError("t_ns: whole nanoseconds of 64 bits are needed; at and camera_at take seconds")
        since_ns: NDArray[np.int64] = _row(whole, "t_ns").astype(np.int64) - self._native.epoch_ns
        return since_ns.astype(np.float64) * 1e-9

    def __reduce__(self) -> tuple[Any, ...]:
        raise TypeError("a trajectory cannot be pickled: pickle its scenario, and ask that for .trajectory")

    def __repr__(self) -> str:
        first_s, last_s = self.span_s
        return f"<camsim.Trajectory: {first_s:.3f} s to {last_s:.3f} s>"


def _row(instants: NDArray[Any], what: str) -> NDArray[Any]:
    if instants.ndim > 1:
        raise InputError(f"{what}: a number or an array of shape (N,) is needed, not {instants.shape}")
    return np.atleast_1d(instants)


_States = TypeVar("_States", BodyStates, CameraStates)


def _states(kind: type[_States], native: Any, path_s: NDArray[np.float64], dimensions: int) -> _States:
    is_told = np.isfinite(path_s)
    columns: dict[str, Any] = native(np.ascontiguousarray(np.where(is_told, path_s, 0.0)))
    for values in columns.values():
        values[~is_told] = np.nan
    if dimensions == 0:
        columns = {name: values[0] for name, values in columns.items()}
    return kind(**columns)


class _Samples:
    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))  # type: ignore[arg-type]

    def __repr__(self) -> str:
        names = ", ".join(field.name for field in fields(self))  # type: ignore[arg-type]
        return f"<camsim.{type(self).__name__}: {len(self)} samples of {names}>"


@dataclass(frozen=True, eq=False, repr=False)
class ImuSamples(_Samples):
    """Samples of an inertial unit in its own axes, as its table `sensors/NAME.csv`; N of each."""

    t_ns: NDArray[np.int64]
    """Stamps by its clock, nanoseconds; shape (N,), as all without another one."""
    t_true_ns: NDArray[np.int64]
    """Instants on the clock of frames."""
    gyro_rad_s: NDArray[np.float64]
    """Measured angular rate; shape (N, 3)."""
    accel_m_s2: NDArray[np.float64]
    """Measured specific force; shape (N, 3)."""
    true_gyro_rad_s: NDArray[np.float64]
    """True angular rate; shape (N, 3)."""
    true_accel_m_s2: NDArray[np.float64]
    """True specific force; shape (N, 3)."""
    gyro_bias_rad_s: NDArray[np.float64]
    """Bias; shape (N, 3)."""
    accel_bias_m_s2: NDArray[np.float64]
    """Bias; shape (N, 3)."""
    position_ned_m: NDArray[np.float64]
    """True position of the unit; shape (N, 3)."""
    velocity_ned_m_s: NDArray[np.float64]
    """True velocity of the unit; shape (N, 3)."""
    ned_from_sensor_wxyz: NDArray[np.float64]
    """True attitude, scalar first; shape (N, 4)."""
    is_saturated: NDArray[np.bool_]
    """Whether an axis is at the end of its range."""


@dataclass(frozen=True, eq=False, repr=False)
class GnssSamples(_Samples):
    """Samples of a satellite receiver; NaN is measured where there is no fix."""

    t_ns: NDArray[np.int64]
    """Stamps by its clock, nanoseconds; shape (N,), as all without another one."""
    t_true_ns: NDArray[np.int64]
    """Instants on the clock of frames."""
    t_available_ns: NDArray[np.int64]
    """When the sample arrives."""
    has_fix: NDArray[np.bool_]
    """False within a dropout."""
    lat_deg: NDArray[np.float64]
    lon_deg: NDArray[np.float64]
    height_m: NDArray[np.float64]
    """Above the ellipsoid."""
    msl_m: NDArray[np.float64]
    """Above mean sea level."""
    position_ned_m: NDArray[np.float64]
    """Shape (N, 3)."""
    velocity_ned_m_s: NDArray[np.float64]
    """Shape (N, 3)."""
    true_lat_deg: NDArray[np.float64]
    true_lon_deg: NDArray[np.float64]
    true_height_m: NDArray[np.float64]
    true_msl_m: NDArray[np.float64]
    true_position_ned_m: NDArray[np.float64]
    """Shape (N, 3)."""
    true_velocity_ned_m_s: NDArray[np.float64]
    """Shape (N, 3)."""


@dataclass(frozen=True, eq=False, repr=False)
class BarometerSamples(_Samples):
    """Samples of a barometer; shape (N,) each."""

    t_ns: NDArray[np.int64]
    """Stamps by its clock, nanoseconds."""
    t_true_ns: NDArray[np.int64]
    """Instants on the clock of frames."""
    pressure_pa: NDArray[np.float64]
    altitude_m: NDArray[np.float64]
    """Height at which the standard atmosphere has this pressure."""
    true_pressure_pa: NDArray[np.float64]
    true_msl_m: NDArray[np.float64]
    """True height above mean sea level."""
    bias_pa: NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class MagnetometerSamples(_Samples):
    """Samples of a magnetometer in its own axes, microtesla."""

    t_ns: NDArray[np.int64]
    """Stamps by its clock, nanoseconds; shape (N,)."""
    t_true_ns: NDArray[np.int64]
    """Instants on the clock of frames."""
    mag_ut: NDArray[np.float64]
    """Measured field; shape (N, 3)."""
    true_mag_ut: NDArray[np.float64]
    """True field in sensor axes; shape (N, 3)."""
    field_ned_ut: NDArray[np.float64]
    """True field: north, east, down; shape (N, 3)."""
