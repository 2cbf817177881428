#!/usr/bin/env python3
"""Writes examples/propeller/propeller.glb: a propeller of three blades (node `rotor`, in the plane of x and y, about z)
before a cowl (node `cowl`). Metres; x left, y up, z forward.

    python3 scripts/assets/make_propeller.py
"""

import json
import math
import pathlib
import struct

import numpy as np

BLADES = 3
LENGTH_M = 0.9
STATIONS = 12
TIP_FROM = 0.86


def blade(angle, first, last):
    """Triangles of a blade between two parts of its length, 0 to 1, along +y turned by `angle`."""
    strip = []
    for i in range(STATIONS + 1):
        part = first + (last - first) * i / STATIONS
        # Widest at 0.4 of its length, round at the tip.
        width = 0.075 * (0.55 + 0.9 * math.sin(math.pi * min(part, 1.0) ** 0.8)) * math.sqrt(max(0.0, 1.0 - part**8))
        pitch = math.radians(50.0 - 32.0 * part)
        for side in (-1.0, 1.0):
            x, z = side * width * math.cos(pitch), side * width * math.sin(pitch)
            y = 0.08 + (LENGTH_M - 0.08) * part
            c, s = math.cos(angle), math.sin(angle)
            strip.append((c * x - s * y, s * x + c * y, z))
    triangles = []
    for i in range(STATIONS):
        a, b, c, d = strip[2 * i : 2 * i + 4]
        triangles += [a, b, c, b, d, c]
    return triangles


def disc(radius, z, depth, count=48):
    """A cone of triangles whose tip is `depth` before z."""
    rim = [(radius * math.cos(t), radius * math.sin(t), z) for t in (2 * math.pi * k / count for k in range(count + 1))]
    return [point for a, b in zip(rim, rim[1:]) for point in (a, b, (0.0, 0.0, z + depth))]


def main():
    angles = [2 * math.pi * k / BLADES for k in range(BLADES)]
    parts = [
        ("blades", [p for a in angles for p in blade(a, 0.0, TIP_FROM)], [0.02, 0.02, 0.025, 1.0]),
        ("tips", [p for a in angles for p in blade(a, TIP_FROM, 1.0)], [0.85, 0.55, 0.02, 1.0]),
        ("spinner", disc(0.13, 0.05, 0.18), [0.5, 0.05, 0.04, 1.0]),
        ("cowl", disc(0.42, -0.30, 0.02), [0.30, 0.32, 0.34, 1.0]),
    ]
    data = b""
    document = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], "materials": [], "meshes": [], "scene": 0}
    primitives = []
    for number, (name, positions, colour) in enumerate(parts):
        positions = np.array(positions, dtype="<f4")
        bytes_ = positions.tobytes()
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(data), "byteLength": len(bytes_)})
        lowest, highest = positions.min(0).tolist(), positions.max(0).tolist()
        document["accessors"].append(
            {"bufferView": number, "componentType": 5126, "count": len(positions), "type": "VEC3", "min": lowest, "max": highest}
        )
        factor = {"baseColorFactor": colour, "metallicFactor": 0.0}
        document["materials"].append({"name": name, "doubleSided": True, "pbrMetallicRoughness": factor})
        primitives.append({"attributes": {"POSITION": number}, "material": number})
        data += bytes_
    document["meshes"] = [{"primitives": primitives[:3]}, {"primitives": primitives[3:]}]
    document["nodes"] = [{"name": "rotor", "mesh": 0}, {"name": "cowl", "mesh": 1}]
    document["scenes"] = [{"nodes": [0, 1]}]
    document["buffers"] = [{"byteLength": len(data)}]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    glb = struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(data))
    glb += struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    folder = pathlib.Path(__file__).parents[2] / "examples" / "propeller"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "propeller.glb").write_bytes(glb)


if __name__ == "__main__":
    main()
