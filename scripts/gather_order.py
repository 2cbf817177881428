"""Best order of the cells of a sampling grid over the exposure (crates/camsim-core/src/temporal/footprint.rs).

Each sample of an exposure reads one cell of its pixel's grid at one instant. What that leaves of a border is a sum over waves f of the ideal frame, as in
crates/camsim-plan/src/picture_error/aliasing.rs: the bilinear read's part of f and of those that the frame's pixels make look like it, times the mean of exp(2 pi i f . (cell + path)) over the
reads, less the exact mean over the pixel's area and the path.

    python3 gather_order.py                what the orders in use leave, against pairs from the outside to the inside
    python3 gather_order.py 4 3 60         looks for a better one of 4 columns and 3 rows for 60 s: by chance, and never quite the same

Needs numpy.
"""

import sys
import time

import numpy as np

IN_USE = {
    (4, 1): 0x1302,
    (3, 2): 0x420531,
    (4, 2): 0x24716035,
    (3, 3): 0x715604823,
    (4, 3): 0x79025B831A46,
    (4, 4): 0x64DF2790C5BE318A,
}
# Pixels of these widths, ideal pixels, have so many reads on their longer side.
WIDTHS = {2: (1.85, 2.08), 3: (2.2, 2.6, 3.05), 4: (3.2, 3.6, 4.0)}
# A side with one read.
NARROW = 1.2
# Paths over the exposure, ideal pixels, and rounds of all cells; the last one is cut short.
PATHS = ((0.8, 1.0), (2.0, 1.0), (4.0, 1.0), (8.0, 1.5))
DIRECTIONS = 6
WAVES = 300
ALIASES = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)]
# What a cell's side counts for that the reads are off the centre wherever they stop.
OFF_CENTRE = 0.04


def waves():
    i = np.arange(WAVES) + 0.5
    length = 0.02 * np.exp2(7.0 * i / WAVES)
    turn = np.pi * (i * 0.618033988749895 % 1.0)
    return length[:, None] * np.stack([np.cos(turn), np.sin(turn)], 1), 1.0 / length


F, WEIGHT = waves()


def spread(width, count):
    return 0.0 if count == 1 else np.sqrt(max(width**2 - 3.0, 0.0) / (1.0 - 1.0 / count**2))


def cells(order, columns, rows):
    order = np.array(order)
    return np.stack([order % columns - 0.5 * (columns - 1), order // columns - 0.5 * (rows - 1)], 1)


def left(order, columns, rows, widths, path_px, rounds):
    count = len(order)
    samples = int(np.ceil(rounds * count))
    scale = np.array([spread(widths[0], columns) / columns, spread(widths[1], rows) / rows])
    cell_px = (cells(order, columns, rows) * scale)[np.arange(samples) % count]
    share = (np.arange(samples) + 0.5) / samples - 0.5
    total = 0.0
    for direction in range(DIRECTIONS):
        turn = 2.0 * np.pi * (direction + 0.5) / DIRECTIONS + 0.1
        path = path_px * np.array([np.cos(turn), np.sin(turn)])
        positions = cell_px + share[:, None] * path
        exact = np.sinc(widths[0] * F[:, 0]) * np.sinc(widths[1] * F[:, 1]) * np.sinc(F @ path)
        for alias in ALIASES:
            f = F + np.array(alias)
            read = (np.sinc(f[:, 0]) * np.sinc(f[:, 1])) ** 2 * np.exp(2j * np.pi * (f @ positions.T)).mean(1)
            total += np.sum(WEIGHT * np.abs(read - (exact if alias == (0, 0) else 0.0)) ** 2)
    return total / DIRECTIONS


def score(order, columns, rows):
    """Mean logarithm of the RMS error."""
    longer = max(columns, rows)
    found = []
    for width in WIDTHS[longer]:
        widths = [NARROW if n == 1 else width * n / longer for n in (columns, rows)]
        found += [0.5 * np.log(left(order, columns, rows, widths, *path)) for path in PATHS]
    return np.mean(found)


def off_centre(order, columns, rows):
    return np.linalg.norm(np.cumsum(cells(order, columns, rows), 0), axis=1).max()


def in_pairs(count):
    return [count - 1 - turn // 2 if turn % 2 else turn // 2 for turn in range(count)]


def report(order, columns, rows):
    times = np.exp(score(order, columns, rows) - score(in_pairs(len(order)), columns, rows))
    packed = sum(cell << 4 * turn for turn, cell in enumerate(order))
    print(f"{columns} x {rows}: {times:.3f} of pairs, off the centre by {off_centre(order, columns, rows):.2f} cells at most, 0x{packed:x}")


def search(columns, rows, seconds):
    random, begin, count = np.random.default_rng(), time.time(), columns * rows
    cost = lambda order: score(order, columns, rows) + OFF_CENTRE * off_centre(order, columns, rows)
    best = (cost(in_pairs(count)), in_pairs(count))
    while time.time() - begin < seconds:
        order = [int(cell) for cell in random.permutation(count)]
        now, moved = cost(order), True
        while moved and time.time() - begin < seconds:
            moved = False
            for i, j in random.permutation([(i, j) for i in range(count) for j in range(i)]):
                other = list(order)
                other[i], other[j] = other[j], other[i]
                if (its := cost(other)) < now - 1e-9:
                    order, now, moved = other, its, True
                    break
        best = min(best, (now, order))
    return best[1]


if __name__ == "__main__":
    if len(sys.argv) == 4:
        grid = int(sys.argv[1]), int(sys.argv[2])
        report(search(*grid, float(sys.argv[3])), *grid)
    else:
        for (columns, rows), packed in IN_USE.items():
            report([packed >> 4 * turn & 15 for turn in range(columns * rows)], columns, rows)
