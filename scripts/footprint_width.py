"""Best side of the square that stands for a pixel footprint (crates/camsim-core/src/temporal/footprint.rs, docs/theory/DECISIONS.md).

Straight borders are drawn at random into ideal frames whose pixels have one sample or four, and a pixel `w` ideal pixels wide is read by grids of bilinear reads and by means over squares
with the sides sqrt(w^2 - c). Printed is the RMS of what they are off the part of the pixel that the border truly covers, for as many pixel sides of border as pixels.

    python3 footprint_width.py           4000 borders a row, some minutes

Needs numpy.
"""

import sys

import numpy as np

FOUR = [(-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375)]
ONE = [(0.0, 0.0)]
WIDTHS = [1.41, 1.62, 1.8, 2.0, 2.25, 2.5, 2.85]
LESS = [0.0, 0.5, 1.0, 1.5, 2.0]
STRIPS = 64


def covered(at, normal, border, width):
    """Part of a square beyond a border, strip by strip."""
    y = at[1] + ((np.arange(STRIPS) + 0.5) / STRIPS - 0.5) * width
    if abs(normal[0]) < 1e-9:
        return (normal[1] * y > border).mean()
    x = (border - normal[1] * y) / normal[0]
    beyond = (at[0] + width / 2 - x) if normal[0] > 0 else (x - at[0] + width / 2)
    return np.clip(beyond / width, 0, 1).mean()


def by_grid(at, width, most, count):
    """Weights of pixels along an axis for up to so many bilinear reads with the pixel's variance."""
    taps = 1 if width <= 3**0.5 else min(int(np.ceil(width - 0.1)), most)
    side = 0 if taps == 1 else np.sqrt((width**2 - 3) / (1 - 1 / taps**2))
    weights = np.zeros(count)
    for tap in range(taps):
        position = at + ((tap + 0.5) / taps - 0.5) * side
        first = int(np.floor(position))
        weights[first] += (1 - position + first) / taps
        weights[first + 1] += (position - first) / taps
    return weights


def by_area(at, side, count):
    return np.clip((side + 1) / 2 - np.abs(np.arange(count) - at), 0, min(1, side)) / side


def row(width, samples, borders, rng):
    methods = {f"{n} reads": lambda at, count, n=n: by_grid(at, width, n, count) for n in (2, 3)}
    for less in LESS:
        side = np.sqrt(max(width**2 - less, 1))
        methods[f"c = {less:g}"] = lambda at, count, side=side: by_area(at, side, count)
    reach = 2 * (0.75 * width + 1)
    squares = dict.fromkeys(methods, 0.0)
    count = int(np.ceil(width + 5))
    for _ in range(borders):
        angle = rng.random() * 2 * np.pi
        normal = np.array([np.cos(angle), np.sin(angle)])
        on_border = 20 + rng.random(2)
        at = on_border + (rng.random() - 0.5) * reach * normal + rng.random() * np.array([-normal[1], normal[0]])
        border = normal @ on_border
        first = np.floor(at - width / 2 - 2)
        x, y = first[0] + np.arange(count), first[1] + np.arange(count)
        shown = sum((normal[0] * (x[None] + dx) + normal[1] * (y[:, None] + dy) > border).astype(float) for dx, dy in samples) / len(samples)
        exact = covered(at, normal, border, width)
        for name, weights in methods.items():
            found = weights(at[1] - first[1], count) @ shown @ weights(at[0] - first[0], count)
            squares[name] += (found - exact) ** 2 * reach / width
    return {name: np.sqrt(square / borders) for name, square in squares.items()}


def main():
    borders = int(sys.argv[1]) if len(sys.argv) > 1 else 4000
    rng = np.random.default_rng(2)
    for name, samples in (("four samples", FOUR), ("one sample", ONE)):
        print(name)
        for width in WIDTHS:
            print(f"  w = {width}: " + ", ".join(f"{method} {rms:.4f}" for method, rms in row(width, samples, borders, rng).items()), flush=True)


main()
