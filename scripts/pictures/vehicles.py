"""Writes the models of scripts/pictures/village.toml, made of boxes: vehicles.py FOLDER."""

import base64
import json
import pathlib
import sys

import numpy as np

FOLDER = pathlib.Path(sys.argv[1])
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
COLOURS = {"glass": (0.02, 0.03, 0.05), "rubber": (0.01, 0.01, 0.01)}


def box(low, high):
    """Triangles of a box, each side with corners of its own: flat shading."""
    corners = np.array([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)], np.float32)
    return corners[[side[k] for side in SIDES for k in (0, 1, 2, 0, 2, 3)]]


def write(name, paint, parts):
    """A model of parts: material, low corner, high corner; x left, y up, z forward."""
    data, views, accessors, meshes = b"", [], [], []
    colours = {"paint": paint, **COLOURS}
    for material, *ends in parts:
        points = box(*ends)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": points.nbytes})
        accessors.append(
            {
                "bufferView": len(accessors),
                "componentType": 5126,
                "count": len(points),
                "type": "VEC3",
                "min": points.min(0).tolist(),
                "max": points.max(0).tolist(),
            }
        )
        primitive = {"attributes": {"POSITION": len(meshes)}, "material": list(colours).index(material)}
        meshes.append({"primitives": [primitive]})
        data += points.tobytes()
    model = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(meshes)))}],
        "nodes": [{"mesh": k} for k in range(len(meshes))],
        "meshes": meshes,
        "materials": [
            {"name": key, "pbrMetallicRoughness": {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0}}
            for key, colour in colours.items()
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}
        ],
    }
    (FOLDER / f"{name}.gltf").write_text(json.dumps(model))


def wheels(half_width, *along):
    return [
        ("rubber", (x - 0.15, 0.0, z - 0.4), (x + 0.15, 0.8, z + 0.4)) for x in (-half_width, half_width) for z in along
    ]


write(
    "car",
    (0.75, 0.03, 0.02),
    [
        ("paint", (-0.95, 0.35, -2.2), (0.95, 1.0, 2.2)),
        ("glass", (-0.8, 1.0, -1.8), (0.8, 1.45, 0.8)),
        ("paint", (-0.8, 1.45, -1.7), (0.8, 1.55, 0.6)),
        *wheels(0.85, -1.4, 1.4),
    ],
)
write(
    "lorry",
    (0.9, 0.55, 0.03),
    [
        ("paint", (-1.25, 0.8, -4.5), (1.25, 3.6, 2.2)),
        ("paint", (-1.2, 0.6, 2.5), (1.2, 1.7, 4.5)),
        ("glass", (-1.15, 1.7, 2.6), (1.15, 2.6, 4.3)),
        ("paint", (-1.2, 2.6, 2.5), (1.2, 2.8, 4.2)),
        *wheels(1.1, -3.2, -1.8, 3.4),
    ],
)
