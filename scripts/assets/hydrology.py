"""Water on a DEM: depression filling, drainage area, and smooth stream lines. Plain D8, written for clarity."""

import heapq

import numpy as np
from scipy.ndimage import gaussian_filter1d

NEIGHBOURS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]


def drainage(height_m):
    """Priority flood from the border: (filled heights, receiver of each cell, cells drained through each cell).

    The receiver of a cell is the one from which the flood reached it, so every cell drains to the border; -1 there.
    """
    rows, cols = height_m.shape
    filled = height_m.copy()
    receiver = np.full((rows, cols), -1, np.int64)
    seen = np.zeros((rows, cols), bool)
    heap, order = [], []
    for i in range(rows):
        for j in range(cols) if i in (0, rows - 1) else (0, cols - 1):
            heapq.heappush(heap, (filled[i, j], i, j))
            seen[i, j] = True
    while heap:
        h, i, j = heapq.heappop(heap)
        order.append(i * cols + j)
        for di, dj in NEIGHBOURS:
            a, b = i + di, j + dj
            if 0 <= a < rows and 0 <= b < cols and not seen[a, b]:
                seen[a, b] = True
                filled[a, b] = max(filled[a, b], h)
                receiver[a, b] = i * cols + j
                heapq.heappush(heap, (filled[a, b], a, b))
    area = np.ones(rows * cols)
    flat = receiver.ravel()
    for cell in reversed(order):
        if flat[cell] >= 0:
            area[flat[cell]] += area[cell]
    return filled, receiver, area.reshape(rows, cols)


def streams(receiver, area, least_cells, smooth=3.0):
    """Polylines [(row, col, area)] from each source of at least `least_cells` down to where it joins a longer stream."""
    rows, cols = area.shape
    flat, size = receiver.ravel(), area.ravel()
    channel = size >= least_cells
    fed = np.zeros(rows * cols, bool)
    inside = np.flatnonzero(channel & (flat >= 0))
    fed[flat[inside]] = True
    lines, taken = [], np.zeros(rows * cols, bool)
    heads = [c for c in inside if not fed[c]]
    remaining = {}
    for head in heads:
        n, cell = 0, head
        while cell >= 0:
            n, cell = n + 1, flat[cell]
        remaining[head] = n
    for head in sorted(heads, key=lambda c: (-remaining[c], c)):
        path, cell = [], head
        while cell >= 0:
            path.append(cell)
            if taken[cell]:
                break
            taken[cell] = True
            cell = flat[cell]
        if len(path) < 8:
            continue
        path = np.array(path)
        line = np.stack([path // cols, path % cols, size[path]], axis=1).astype(float)
        ends = line[[0, -1], :2].copy()
        line[:, :2] = gaussian_filter1d(line[:, :2], smooth, axis=0, mode="nearest")
        line[[0, -1], :2] = ends
        lines.append(line)
    return lines
