"""The channels of a frame as attributes.

Made from the table of channels by `CAMSIM_BLESS=1 cargo test -p camsim-io --lib channels`.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Channels:
    """An array for each channel; that of one that was not asked for is an `AttributeError`."""

    __slots__ = ()

    def _attribute(self, channel: str) -> NDArray[Any]:
        raise NotImplementedError

    @property
    def color(self) -> NDArray[np.float32]:
        """The picture: linear R, G, B and A; A is 1 where a ray exists, else 0. An array of float32, height x width x 4."""
        return self._attribute("color")

    @property
    def depth(self) -> NDArray[np.float32]:
        """Planar depth along the optical axis, metres; 0 = sky, negative beyond 90 degrees off axis. Never interpolated across an edge. An array of float32, height x width."""
        return self._attribute("depth")

    @property
    def valid(self) -> NDArray[np.uint8]:
        """255 where a ray exists, else 0. An array of uint8, height x width."""
        return self._attribute("valid")

    @property
    def raw(self) -> NDArray[np.uint16]:
        """Digital numbers of the image sensor (`[camera.sensor]`): the mosaic, or three of a sensor without one. An array of uint16, height x width (x 3 without a mosaic)."""
        return self._attribute("raw")

    @property
    def coords(self) -> NDArray[np.float32]:
        """Ideal ray u, v; source x, y in the ideal frame, pixels; time after the stamp, s; point or, for the sky, direction: north, east, down. An array of float32, height x width x 8."""
        return self._attribute("coords")

    @property
    def range(self) -> NDArray[np.float32]:
        """Distance from the optical centre along the ray, metres; 0 = sky. An array of float32, height x width."""
        return self._attribute("range")

    @property
    def normal(self) -> NDArray[np.float32]:
        """Unit normal of the surface towards the camera, in optical camera axes of the row (x right, y down, z forwards); 0 = nothing. An array of float32, height x width x 3."""
        return self._attribute("normal")

    @property
    def normal_world(self) -> NDArray[np.float32]:
        """Unit normal of the surface towards the camera, north, east, down; 0 = nothing. An array of float32, height x width x 3."""
        return self._attribute("normal_world")

    @property
    def object(self) -> NDArray[np.uint16]:
        """Number of the object, from `objects.csv`; 0 = sky. An array of uint16, height x width."""
        return self._attribute("object")

    @property
    def class_(self) -> NDArray[np.uint16]:
        """Class of the object, as the scenario gives it; 0 = none. An array of uint16, height x width."""
        return self._attribute("class")

    @property
    def coverage(self) -> NDArray[np.float32]:
        """Fraction of the pixel's area and exposure that its `object` has, 0 to 1; 0 without a ray. An array of float32, height x width."""
        return self._attribute("coverage")

    @property
    def flow(self) -> NDArray[np.float32]:
        """Optical flow to frame i + `output.flow_step`, pixels: where that frame, at the time of its own rows, shows the point that the pixel sees. With a state: 1 seen, 2 hidden, 3 outside, 4 several times, 0 none. An array of float32, height x width x 3."""
        return self._attribute("flow")

    @property
    def flow_back(self) -> NDArray[np.float32]:
        """Optical flow to frame i - `output.flow_step`, pixels, with a state. An array of float32, height x width x 3."""
        return self._attribute("flow_back")

    @property
    def flow_global(self) -> NDArray[np.float32]:
        """Displacement to the picture that a global shutter takes of the same point at `output.flow_instant`, pixels, with a state. An array of float32, height x width x 3."""
        return self._attribute("flow_global")

    @property
    def motion(self) -> NDArray[np.float32]:
        """Velocity of the point's image at the pixel's own instant, pixels a second. An array of float32, height x width x 2."""
        return self._attribute("motion")

    @property
    def blur_path(self) -> NDArray[np.float32]:
        """Displacement of the point's image at the begin and at the end of the exposure, pixels. An array of float32, height x width x 4."""
        return self._attribute("blur_path")
