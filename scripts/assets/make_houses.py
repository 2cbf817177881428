"""The town of `benches/houses.toml`: a house (house.glb) and 5000 positions for it (places.csv). Python's own library is enough.

A house is 12 m long and 9 m wide, with a gable roof that hangs over, a chimney, a door and 14 windows: 246 triangles in the colours of their
corners. The town lies where the flight of the demo passes at 26 s: rows of houses 40 m apart, none quite straight.
"""

import csv
import json
import math
import struct
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "benches" / "houses"

# Albedo, linear.
WALL, PLINTH, ROOF, EAVES = (0.42, 0.38, 0.31), (0.17, 0.16, 0.15), (0.23, 0.08, 0.05), (0.09, 0.05, 0.03)
PANE, DOOR, BRICK = (0.03, 0.04, 0.05), (0.08, 0.04, 0.02), (0.20, 0.07, 0.05)

HOUSES = 5000
SIDE = 71
STEP_M = 40.0
AHEAD_M = 400.0
PASSES_S = 26.0


class Shape:
    """Triangles with a colour each corner; y is up, +z the front, as in glTF."""

    def __init__(self):
        self.corners, self.triangles = [], []

    def face(self, points, color):
        """A convex polygon, anticlockwise as seen from where it is seen."""
        first = len(self.corners)
        self.corners += [(point, color) for point in points]
        self.triangles += [(first, first + k, first + k + 1) for k in range(1, len(points) - 1)]

    def box(self, low, high, color):
        (x0, y0, z0), (x1, y1, z1) = low, high
        self.face([(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)], color)
        self.face([(x1, y0, z0), (x0, y0, z0), (x0, y1, z0), (x1, y1, z0)], color)
        self.face([(x1, y0, z1), (x1, y0, z0), (x1, y1, z0), (x1, y1, z1)], color)
        self.face([(x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)], color)
        self.face([(x0, y1, z1), (x1, y1, z1), (x1, y1, z0), (x0, y1, z0)], color)
        self.face([(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)], color)

    def window(self, axis, wall, outwards, along, bottom, size):
        """A pane a hand before its wall: `axis` 0 or 2 is the wall's normal, `wall` its position on it."""
        (left, right), top = (along - 0.5 * size[0], along + 0.5 * size[0]), bottom + size[1]
        near, far = sorted((wall, wall + outwards * 0.06))
        low, high = ((near, bottom, left), (far, top, right)) if axis == 0 else ((left, bottom, near), (right, top, far))
        self.box(low, high, PANE)


def house():
    shape = Shape()
    x, z, eaves, ridge = 6.0, 4.5, 5.2, 8.6
    shape.box((-x - 0.1, -1.5, -z - 0.1), (x + 0.1, 0.4, z + 0.1), PLINTH)
    for side in (1.0, -1.0):
        shape.face([(-side * x, 0.4, side * z), (side * x, 0.4, side * z), (side * x, eaves, side * z), (-side * x, eaves, side * z)], WALL)
        gable = [(side * x, 0.4, side * z), (side * x, 0.4, -side * z), (side * x, eaves, -side * z), (side * x, ridge, 0.0), (side * x, eaves, side * z)]
        shape.face(gable, WALL)
    roof(shape, x + 0.6, z, eaves, ridge)
    shape.box((2.2, 6.5, -1.6), (3.1, 9.4, -0.7), BRICK)
    shape.box((2.1, 9.4, -1.7), (3.2, 9.6, -0.6), EAVES)
    for along in (-4.0, -1.4, 1.4, 4.0):
        for side in (1.0, -1.0):
            if along == 1.4 and side > 0.0:
                shape.box((0.9, 0.4, z), (1.9, 2.5, z + 0.12), DOOR)
            else:
                shape.window(2, side * z, side, along, 1.2, (1.1, 1.3))
    for side in (1.0, -1.0):
        for along in (-2.2, 2.2):
            shape.window(0, side * x, side, along, 1.2, (1.0, 1.3))
        shape.window(0, side * x, side, 0.0, 4.4, (1.2, 1.3))
    shape.window(2, z, 1.0, -2.7, 3.4, (0.9, 1.1))
    return shape


def roof(shape, x, z, eaves, ridge):
    """Two slabs 0.25 m thick that hang over the walls."""
    slope = (ridge - eaves) / z
    low_z = z + 0.7
    low_y = eaves - slope * 0.7
    for side in (1.0, -1.0):
        top = [(-side * x, low_y + 0.25, side * low_z), (side * x, low_y + 0.25, side * low_z), (side * x, ridge + 0.25, 0.0), (-side * x, ridge + 0.25, 0.0)]
        below = [(a, b - 0.25, c) for a, b, c in top]
        shape.face(top, ROOF)
        shape.face(below[::-1], EAVES)
        for k in range(4):
            if k != 2:
                n = (k + 1) % 4
                shape.face([below[k], below[n], top[n], top[k]], EAVES)


def write_glb(shape, path, generator="make_houses.py"):
    positions = b"".join(struct.pack("<3f", *point) for point, _ in shape.corners)
    # COLOR_0 is linear light.
    colors = b"".join(struct.pack("<4B", *(round(255 * c) for c in color), 255) for _, color in shape.corners)
    indices = b"".join(struct.pack("<3H", *triangle) for triangle in shape.triangles)
    count = len(shape.corners)
    binary = positions + colors + indices
    binary += b"\0" * (-len(binary) % 4)
    low, high = ([f([point[k] for point, _ in shape.corners]) for k in range(3)] for f in (min, max))
    parts = [(0, len(positions)), (len(positions), len(colors)), (len(positions) + len(colors), len(indices))]
    document = {
        "asset": {"version": "2.0", "generator": f"camsim scripts/assets/{generator}"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": path.stem}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"name": "painted", "pbrMetallicRoughness": {"metallicFactor": 0.0}}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": length} for start, length in parts],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3", "min": low, "max": high},
            {"bufferView": 1, "componentType": 5121, "normalized": True, "count": count, "type": "VEC4"},
            {"bufferView": 2, "componentType": 5123, "count": 3 * len(shape.triangles), "type": "SCALAR"},
        ],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text + struct.pack("<2I", len(binary), 0x004E4942) + binary
    path.write_bytes(struct.pack("<4s2I", b"glTF", 2, 12 + len(chunks)) + chunks)


def part(i, k):
    """Number k of position i, 0 to 1: the same on every machine."""
    x = (i * 3 + k + 1) * 0x9E3779B97F4A7C15 & (1 << 64) - 1
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9 & (1 << 64) - 1
    x = (x ^ x >> 27) * 0x94D049BB133111EB & (1 << 64) - 1
    return (x ^ x >> 31) / 2**64


def centre():
    """Latitude, longitude ahead of the flight at `PASSES_S`, and degrees a metre."""
    with (ROOT / "assets" / "demo_flight.csv").open() as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    row = min(rows, key=lambda row: abs(row["t_s"] - PASSES_S))
    # A sphere does for a town.
    north = 180.0 / (math.pi * 6371000.0)
    east = north / math.cos(math.radians(row["lat_deg"]))
    yaw = math.radians(row["yaw_deg"])
    return row["lat_deg"] + AHEAD_M * math.cos(yaw) * north, row["lon_deg"] + AHEAD_M * math.sin(yaw) * east, north, east


def write_positions(path):
    lat_deg, lon_deg, north, east = centre()
    with path.open("w", newline="\n") as file:
        file.write("lat_deg,lon_deg,heading_deg,scale\n")
        for i in range(HOUSES):
            along = [STEP_M * (n - 0.5 * (SIDE - 1)) + 8.0 * (part(i, k) - 0.5) for k, n in enumerate((i // SIDE, i % SIDE))]
            heading = 90 * (i % 4) + 30.0 * part(i, 2) - 15.0
            file.write(f"{lat_deg + along[0] * north:.7f},{lon_deg + along[1] * east:.7f},{heading % 360.0:.1f},{0.85 + 0.3 * part(i, 2):.2f}\n")


if __name__ == "__main__":
    OUT.mkdir(exist_ok=True)
    made = house()
    print(f"{len(made.triangles)} triangles")
    write_glb(made, OUT / "house.glb")
    write_positions(OUT / "places.csv")
