#!/usr/bin/env python3
"""pycolmap reads the models, binary and text; exact tracks reproject with an RMS below 0.01 px.

    colmap.py RUN...     output folders with datasets/colmap
"""

import pathlib
import sys

import numpy as np
import pycolmap
from common import check, finish, versions


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


def main(folders):
    versions("pycolmap", "numpy")
    for folder in folders:
        name = folder.parent.name
        folder = folder / "datasets" / "colmap"
        judge(f"{name} binary", pycolmap.Reconstruction(folder / "sparse" / "0"))
        judge(f"{name} text", pycolmap.Reconstruction(folder / "sparse_text" / "0"))
    finish()


if __name__ == "__main__":
    main([pathlib.Path(path) for path in sys.argv[1:]])
