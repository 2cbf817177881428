"""Small rasters in every way that GDAL writes them: tests/data/terrain. In all, the true height at the centre of pixel (column, row) is
400 + 0.7 column + 0.3 row metres, and the true colour (40 + 4 column, 30 + 4 row, 100); 40 x 30 pixels of 10 m in UTM zone 32N.

    pip install rasterio && python scripts/goldens/terrain_rasters.py
"""
import os
import pathlib
import warnings

import numpy as np
import rasterio
from rasterio.enums import ColorInterp, Resampling
from rasterio.transform import from_origin

warnings.filterwarnings("ignore")
OUT = pathlib.Path(__file__).parents[2] / "tests/data/terrain"
W, H = 40, 30
COLUMN, ROW = np.meshgrid(np.arange(W), np.arange(H))
HEIGHT = 400 + 0.7 * COLUMN + 0.3 * ROW
COLOR = np.stack([40 + 4 * COLUMN, 30 + 4 * ROW, 0 * ROW + 100]).astype("uint8")


def write(name, data, mask=None, after=None, epsg=32632, **options):
    data = np.asarray(data)
    data = data[None] if data.ndim == 2 else data
    options = {"driver": "GTiff", "width": W, "height": H, "count": len(data), "dtype": data.dtype, "transform": from_origin(500000, 5200000, 10, 10), **options}
    if epsg:
        options["crs"] = f"EPSG:{epsg}"
    with rasterio.open(OUT / name, "w", **options) as file:
        file.write(data)
        if mask is not None:
            file.write_mask(mask)
        if after:
            after(file)


def scaled(file):
    file.scales, file.offsets = (0.1,), (100,)


def main():
    OUT.mkdir(exist_ok=True)
    for old in OUT.glob("*"):
        old.unlink()
    tiles = {"tiled": True, "blockxsize": 16, "blockysize": 16}
    f32, counts = HEIGHT.astype("float32"), np.rint((HEIGHT - 100) * 10)
    write("zstd_predictor3.tif", f32, compress="zstd", predictor=3, **tiles)
    write("deflate_predictor3_f64.tif", HEIGHT, compress="deflate", predictor=3)
    write("lzw_predictor2_i16.tif", counts.astype("int16"), compress="lzw", predictor=2, after=scaled, **tiles)
    write("deflate_predictor2_u32_big.tif", counts.astype("uint32"), compress="deflate", predictor=2, ENDIANNESS="BIG", after=scaled)
    write("packbits_big.tif", f32, compress="packbits", ENDIANNESS="BIG")
    write("bigtiff.tif", f32, BIGTIFF="YES", compress="lzw")
    write("white_is_zero.tif", counts.astype("uint16"), PHOTOMETRIC="MINISWHITE", after=scaled)
    write("u12.tif", counts.astype("uint16") % 4096, NBITS=12, after=scaled)
    write("overviews.tif", f32, compress="deflate", after=lambda file: file.build_overviews([2, 4], Resampling.average), **tiles)
    write("lerc.tif", f32, compress="lerc")
    write("lzma.tif", f32, compress="lzma")
    os.environ["GDAL_TIFF_INTERNAL_MASK"] = "NO"
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=False):
        write("beside_mask.tif", f32, mask=np.where((COLUMN < 7) & (ROW < 5), 0, 255).astype("uint8"))
    write("beside_aux.tif", counts.astype("int16"), PROFILE="BASELINE", nodata=3000, after=scaled)
    write("point.tif", f32, after=lambda file: file.update_tags(AREA_OR_POINT="Point"))

    write("planar_tiles.tif", COLOR, interleave="band", photometric="RGB", compress="deflate", predictor=2, **tiles)
    write("planar_strips.tif", COLOR, interleave="band", photometric="RGB", blockysize=7)
    write("color_u12.tif", COLOR.astype("uint16") * 16, NBITS=12, photometric="RGB")
    write("color_u16.tif", COLOR.astype("uint16") * 257, photometric="RGB", compress="lzw", predictor=2, ENDIANNESS="BIG")
    write("jpeg_rgb.tif", COLOR, photometric="RGB", compress="jpeg", JPEG_QUALITY=100)
    alpha = np.where(COLUMN < 10, 0, 255).astype("uint8")[None]
    write("webp_lossless_alpha.tif", np.concatenate([COLOR, alpha]), photometric="RGB", ALPHA="YES", compress="webp", WEBP_LOSSLESS="YES")
    half = np.full((1, H, W), 128, "uint8")
    write("premultiplied.tif", np.concatenate([np.rint(COLOR * (128 / 255)).astype("uint8"), half]), photometric="RGB", ALPHA="PREMULTIPLIED")
    infrared = np.full((1, H, W), 200, "uint8")
    write("infrared.tif", np.concatenate([COLOR, infrared]), photometric="RGB", ALPHA="NO")
    bgr = (ColorInterp.blue, ColorInterp.green, ColorInterp.red)
    write("blue_first.tif", COLOR[::-1], photometric="MINISBLACK", after=lambda file: setattr(file, "colorinterp", bgr))
    write("unnamed_bands.tif", COLOR, photometric="MINISBLACK")
    write("cmyk.tif", np.concatenate([COLOR, infrared]), photometric="CMYK")
    index = (COLUMN // 10).astype("uint8")
    table = {0: (0, 0, 0, 255), 1: (200, 10, 20, 255), 2: (30, 210, 40, 255), 3: (50, 60, 220, 255)}
    write("palette.tif", index, photometric="PALETTE", nodata=0, after=lambda file: file.write_colormap(1, table))
    write("marked.tif", np.where(COLUMN < 10, 7, COLOR).astype("uint8"), photometric="RGB", nodata=7)
    for path in sorted(OUT.glob("*")):
        print(path.name, path.stat().st_size)


if __name__ == "__main__":
    main()
