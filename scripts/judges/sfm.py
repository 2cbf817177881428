#!/usr/bin/env python3
"""COLMAP finds the cameras again from the pictures alone: SIFT, matching of neighbours, incremental mapping with the
exported calibration held fixed. Prints the RMS distance from the true positions after a similarity, in per cent of the
length of the flight.

    sfm.py RUN...     output folders with datasets/colmap
"""

import pathlib
import sys
import tempfile

import numpy as np
import pycolmap
from common import check, finish, versions

# Drift of a reconstruction of some dozens of noisy, blurred pictures without a loop.
MOST_PERCENT = 5.0


def centre(image):
    return image.cam_from_world().inverse().translation


def reconstruct(folder, truth):
    """The largest model of the pictures in an export."""
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        database = work / "database.db"
        camera = next(iter(truth.cameras.values()))
        reader = pycolmap.ImageReaderOptions()
        reader.camera_model = camera.model.name
        reader.camera_params = ",".join(repr(float(value)) for value in camera.params)
        pycolmap.extract_features(
            database, folder / "images", camera_mode=pycolmap.CameraMode.SINGLE, reader_options=reader,
            device=pycolmap.Device.cpu,
        )
        pycolmap.match_sequential(database, device=pycolmap.Device.cpu)
        options = pycolmap.IncrementalPipelineOptions()
        options.ba_refine_focal_length = False
        options.ba_refine_principal_point = False
        options.ba_refine_extra_params = False
        models = pycolmap.incremental_mapping(database, folder / "images", work / "models", options)
        return max(models.values(), key=lambda model: model.num_reg_images()) if models else None


def aligned_rms(found, true):
    """RMS distance after the best similarity (Umeyama 1991)."""
    found, true = np.array(found), np.array(true)
    a, b = found - found.mean(0), true - true.mean(0)
    u, s, vt = np.linalg.svd(b.T @ a / len(a))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    scale = np.trace(np.diag(s) @ flip) / (a**2).sum(1).mean()
    return np.sqrt(((b - scale * a @ (u @ flip @ vt).T) ** 2).sum(1).mean())


def judge(folder):
    name = folder.parent.name
    folder = folder / "datasets" / "colmap"
    truth = pycolmap.Reconstruction(folder / "sparse" / "0")
    true = {image.name: centre(image) for image in truth.images.values()}
    model = reconstruct(folder, truth)
    images = {image.name: centre(image) for image in model.images.values()} if model else {}
    names = sorted(set(images) & set(true))
    if len(names) < 3:
        check(f"{name}: pictures without a pose", len(true) - len(names), 0)
        return
    path = np.array([true[name] for name in sorted(true)])
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    rms = aligned_rms([images[name] for name in names], [true[name] for name in names])
    print(f"  {name}: {len(names)} of {len(true)} pictures, {model.num_points3D()} points, mean reprojection "
          f"{model.compute_mean_reprojection_error():.3f} px, flight of {length:.1f} m, RMS {rms:.4f} m")
    check(f"{name}: RMS of positions, per cent of the flight", 100 * rms / length, MOST_PERCENT)


def main(folders):
    versions("pycolmap", "numpy")
    for folder in folders:
        judge(folder)
    finish()


if __name__ == "__main__":
    main([pathlib.Path(path) for path in sys.argv[1:]])
