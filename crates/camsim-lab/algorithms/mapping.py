"""COLMAP (pycolmap) maps the pictures with the true calibration held fixed: camera centres against the true ones, after the
best similarity."""

import pathlib
import tempfile

import numpy as np
import pycolmap
from common import DATA, write


def centres(model):
    return {image.name: image.cam_from_world().inverse().translation for image in model.images.values()}


true_model = pycolmap.Reconstruction(DATA / "sparse" / "0")
camera = next(iter(true_model.cameras.values()))
pycolmap.set_random_seed(0)
with tempfile.TemporaryDirectory() as work:
    work = pathlib.Path(work)
    database, images = work / "database.db", DATA / "images"
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = camera.model.name
    reader.camera_params = ",".join(repr(float(value)) for value in camera.params)
    single, cpu = pycolmap.CameraMode.SINGLE, pycolmap.Device.cpu
    pycolmap.extract_features(database, images, camera_mode=single, reader_options=reader, device=cpu)
    pycolmap.match_sequential(database, device=cpu)
    options = pycolmap.IncrementalPipelineOptions()
    options.ba_refine_focal_length = options.ba_refine_principal_point = options.ba_refine_extra_params = False
    models = pycolmap.incremental_mapping(database, images, work / "models", options)
    best = max(models.values(), key=lambda model: model.num_reg_images()) if models else None

true = centres(true_model)
found = centres(best) if best else {}
names = sorted(set(true) & set(found))
rms = percent = reprojection = np.nan
if len(names) >= 3:
    a, b = (np.array([part[name] for name in names]) for part in (found, true))
    middle = b.mean(axis=0)
    a, b = a - a.mean(axis=0), b - middle
    u, s, vt = np.linalg.svd(b.T @ a / len(a))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    scale = np.trace(np.diag(s) @ flip) / (a**2).sum(1).mean()
    rms = np.sqrt(((b - scale * a @ (u @ flip @ vt).T) ** 2).sum(1).mean())
    path = np.array([true[name] for name in sorted(true)])
    percent = 100 * rms / np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    reprojection = best.compute_mean_reprojection_error()
write(centre_rms_m=rms, centre_percent=percent, found=len(names) / len(true), reprojection_px=reprojection)
