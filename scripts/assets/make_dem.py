"""assets/demo_dem.tif: the 1/3 arc-second DEM that the PyPI package localtileserver ships as sample data.

    pip download --no-deps localtileserver==1.0.0
    python make_dem.py localtileserver-1.0.0-py3-none-any.whl

Heights are rounded to 1/4 m (a tenth of the data's own vertical error) so that the file compresses to half a megabyte.
The grid is not resampled. Its NAD83 degrees are declared as WGS-84: the two differ by 1-2 m there, far below a camera
demo's concern, and the file then needs no datum shift to be read.
"""

import hashlib
import io
import sys
import zipfile

import numpy as np
import tifffile

from ground import DEM

MEMBER = "localtileserver/tiler/data/co_elevation_roi.tif"
SHA256 = "351697f701ff7bb62c294bbf1240d2236116c51405df12f1d1814aab96a06404"
STEP_M = 0.25

with zipfile.ZipFile(sys.argv[1]) as wheel:
    source = wheel.read(MEMBER)
if hashlib.sha256(source).hexdigest() != SHA256:
    sys.exit(f"{MEMBER} is not the file this script was written for: look at it, then change SHA256")
with tifffile.TiffFile(io.BytesIO(source)) as tif:
    page = tif.pages[0]
    height_m = page.asarray()
    step_deg = page.tags["ModelPixelScaleTag"].value[0]
    tie = page.tags["ModelTiepointTag"].value
assert height_m.min() > 2000.0, "no voids expected"

# GeoTIFF keys: geographic model, pixel is area, EPSG:4326.
geokeys = (1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326)
tifffile.imwrite(
    DEM,
    (np.round(height_m / STEP_M) * STEP_M).astype(np.float32),
    compression="deflate",
    compressionargs={"level": 9},
    predictor=3,
    rowsperstrip=64,
    metadata=None,
    description="Elk Mountains, Colorado. Height in metres above NAVD88, 1/3 arc-second, from the U.S. Geological Survey",
    software="camsim scripts/assets/make_dem.py",
    extratags=[
        (33550, "d", 3, (step_deg, step_deg, 0.0), True),
        (33922, "d", 6, tuple(tie), True),
        (34735, "H", len(geokeys), geokeys, True),
    ],
)
print(DEM, DEM.stat().st_size)
