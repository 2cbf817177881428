#!/usr/bin/env python3
"""pycolmap reads the models, binary and text; exact tracks reproject with an RMS below 0.01 px. Cameras of a rig are one rig, whose poses of
the cameras lead to the same pixels.

    colmap.py RUN...     output folders with datasets/colmap
"""

import pathlib
import sys

import numpy as np
import pycolmap
from common import check, finish, rows, versions


def judge(name, model):
    errors = []
    for image in model.images.values():
        camera = model.cameras[image.camera_id]
        for point in image.points2D:
            xyz = model.points3D[point.point3D_id].xyz
            seen = camera.img_from_cam(image.cam_from_world() * xyz)
            errors.append(np.linalg.norm(seen - point.xy))
    kinds = {camera.model.name for camera in model.cameras.values()}
    print(f"  {name}: {', '.join(kinds)}, {model.num_reg_images()} images, {model.num_points3D()} points, {len(errors)} observations")
    check(f"{name}: reprojection RMS, px", np.sqrt(np.mean(np.square(errors))) if errors else np.nan, 0.01)
    # By its own count of each point's track.
    check(f"{name}: observations that tracks lack", abs(model.compute_num_observations() - len(errors)), 0)


def judge_rig(name, model, run):
    """One rig; a frame for every instant, with all pictures that are stamped so."""
    cameras = [path.parent for path in sorted(run.glob("*/frames.csv"))]
    stamps = [row["stamp_ns"] for camera in cameras for row in rows(camera / "frames.csv")]
    check(f"{name}: rigs, away from 1", abs(len(model.rigs) - 1), 0)
    check(f"{name}: cameras away from one rig", abs(len(cameras) - max(rig.num_sensors() for rig in model.rigs.values())), 0)
    check(f"{name}: frames, away from instants", abs(len(model.frames) - len(set(stamps))), 0)
    check(f"{name}: images, away from pictures", abs(model.num_reg_images() - len(stamps)), 0)


def main(folders):
    versions("pycolmap", "numpy")
    for run in folders:
        name, folder = run.parent.name, run
        folder = folder / "datasets" / "colmap"
        judge(f"{name} binary", pycolmap.Reconstruction(folder / "sparse" / "0"))
        judge(f"{name} text", pycolmap.Reconstruction(folder / "sparse_text" / "0"))
        if (run / "rig.toml").is_file():
            for kind in ("sparse", "sparse_text"):
                judge_rig(f"{name} {kind}", pycolmap.Reconstruction(folder / kind / "0"), run)
    finish()


if __name__ == "__main__":
    main([pathlib.Path(path) for path in sys.argv[1:]])
