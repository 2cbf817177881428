"""assets/vignette.png and assets/acircles.png.

    python make_maps.py
"""

import numpy as np
from PIL import Image

from ground import ASSETS

# Vignette: light falls to about 0.6 in the corners, around a centre that is a little off, as in real lenses.
WIDTH, HEIGHT = 160, 120
x, y = np.meshgrid((np.arange(WIDTH) + 0.5) / WIDTH * 4.0 - 2.06, (np.arange(HEIGHT) + 0.5) / HEIGHT * 3.0 - 1.47)
fall = 1.0 - 0.40 * (np.hypot(x, y) / 2.5) ** 2.4
Image.fromarray(np.round(255.0 * np.clip(fall, 0.0, 1.0)).astype(np.uint8)).save(ASSETS / "vignette.png", optimize=True)

# A staggered grid of black discs on white. Every fifth disc of every fourth row is a ring, and the disc at the centre has a
# large collar: landmarks for whoever has to say which disc is which.
SIZE, SCALE, PITCH = 1536, 4, 64
canvas = np.full((SIZE * SCALE, SIZE * SCALE), 255, np.uint8)


def disc(cx, cy, radius, value):
    """Fills a disc; coordinates and radius in pixels of the final picture, (0, 0) its top-left corner."""
    low_x, high_x = int((cx - radius - 1) * SCALE), int((cx + radius + 1) * SCALE)
    low_y, high_y = int((cy - radius - 1) * SCALE), int((cy + radius + 1) * SCALE)
    v, u = np.mgrid[low_y:high_y, low_x:high_x] + 0.5
    canvas[low_y:high_y, low_x:high_x][(u / SCALE - cx) ** 2 + (v / SCALE - cy) ** 2 <= radius**2] = value


centre = SIZE / PITCH / 2
for row in range(1, SIZE // PITCH * 2):
    for column in range(1, SIZE // PITCH):
        across = column + (0.5 if row % 2 else 0.0)
        if across * PITCH > SIZE - 40:
            continue
        cx, cy = across * PITCH, row * PITCH / 2
        if across == centre and row == 2 * centre:
            disc(cx, cy, 27.0, 0)
            disc(cx, cy, 20.0, 255)
        disc(cx, cy, 13.0, 0)
        if row % 4 == 1 and column % 5 == 2:
            disc(cx, cy, 6.5, 255)
small = canvas.reshape(SIZE, SCALE, SIZE, SCALE).mean(axis=(1, 3))
Image.fromarray(np.round(small).astype(np.uint8)).save(ASSETS / "acircles.png", optimize=True)

for name in ("vignette.png", "acircles.png"):
    print(ASSETS / name, (ASSETS / name).stat().st_size)
