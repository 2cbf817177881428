#!/usr/bin/env python3
"""Golden of the bilinear interpolation: OpenCV's demosaicing of a mosaic of 8x6 numbers, as a Rust table.

    pip install opencv-python-headless numpy
    python3 scripts/goldens/demosaic.py > crates/camsim-core/src/imaging/demosaic/golden.rs
"""

import cv2
import numpy as np

W, H = 8, 6
y, x = np.mgrid[0:H, 0:W]
# Multiples of 4, so that means of two and four are whole.
mosaic = (4 * ((x * 37 + y * 101 + x * y * 13) % 251)).astype(np.uint16)
print(f"//! Made by `scripts/goldens/demosaic.py` with OpenCV {cv2.__version__}. Do not edit.\n")
print("use crate::scenario::Mosaic;\n")
print("/// Mosaic of 8x6 numbers.")
print(f"pub const MOSAIC: [u16; {W * H}] = [{', '.join(map(str, mosaic.ravel()))}];\n")
print("/// Red, green and blue of the inner 6x4 pixels of each pattern.")
print(f"pub const COLORS: [(Mosaic, [u16; {(W - 2) * (H - 2) * 3}]); 4] = [")
# OpenCV names a pattern by the second row's second and third pixel.
for name, code in [("Rggb", "BG"), ("Bggr", "RG"), ("Grbg", "GB"), ("Gbrg", "GR")]:
    rgb = cv2.demosaicing(mosaic, getattr(cv2, f"COLOR_Bayer{code}2RGB"))[1:-1, 1:-1]
    print(f"    (Mosaic::{name}, [{', '.join(map(str, rgb.ravel()))}]),")
print("];")
