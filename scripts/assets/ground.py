"""The demo's DEM as arrays on a metric grid: shared by the generators of the ortho-image and of the flight."""

from pathlib import Path

import numpy as np
import tifffile

ASSETS = Path(__file__).resolve().parents[2] / "assets"
DEM = ASSETS / "demo_dem.tif"

# WGS-84.
A_M = 6378137.0
E2 = 6.69437999014e-3


class Ground:
    """Heights (row 0 in the north), pixel size in degrees and metres, and the north-west corner of the area."""

    def __init__(self, path=DEM):
        with tifffile.TiffFile(path) as tif:
            page = tif.pages[0]
            self.height_m = page.asarray().astype(np.float64)
            self.step_deg = float(page.tags["ModelPixelScaleTag"].value[0])
            tie = page.tags["ModelTiepointTag"].value
        self.west_deg, self.north_deg = float(tie[3]), float(tie[4])
        self.rows, self.cols = self.height_m.shape
        mid = np.radians(self.north_deg - 0.5 * self.rows * self.step_deg)
        w = 1.0 - E2 * np.sin(mid) ** 2
        self.metres_per_deg_north = np.radians(1.0) * A_M * (1.0 - E2) / w**1.5
        self.metres_per_deg_east = np.radians(1.0) * A_M / np.sqrt(w) * np.cos(mid)
        self.cell_north_m = self.step_deg * self.metres_per_deg_north
        self.cell_east_m = self.step_deg * self.metres_per_deg_east

    def geodetic_deg(self, row, col):
        """Latitude and longitude of fractional pixel coordinates (pixel centres are whole numbers)."""
        return self.north_deg - (row + 0.5) * self.step_deg, self.west_deg + (col + 0.5) * self.step_deg

    def pixel(self, lat_deg, lon_deg):
        """Fractional pixel coordinates (row, col) of a position."""
        return (self.north_deg - lat_deg) / self.step_deg - 0.5, (lon_deg - self.west_deg) / self.step_deg - 0.5

    def at(self, row, col):
        """Height at fractional pixel coordinates, bilinear, held outside."""
        row = np.clip(np.asarray(row, float), 0, self.rows - 1.001)
        col = np.clip(np.asarray(col, float), 0, self.cols - 1.001)
        i, j = row.astype(int), col.astype(int)
        a, b, h = row - i, col - j, self.height_m
        return (1 - a) * ((1 - b) * h[i, j] + b * h[i, j + 1]) + a * ((1 - b) * h[i + 1, j] + b * h[i + 1, j + 1])
