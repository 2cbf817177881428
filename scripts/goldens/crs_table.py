"""Coordinate systems that terrain files may state, and control points for them, by pyproj (PROJ and its copy of the EPSG registry).

Writes crates/camsim-io/src/raster/crs/systems.csv (what camsim knows) and tests/data/crs_points.csv (what it is tested against).

    pip install pyproj && python scripts/goldens/crs_table.py
"""
import itertools
import pathlib
import warnings

import pyproj
from pyproj import CRS, Transformer
from pyproj.database import query_crs_info
from pyproj.enums import PJType

warnings.filterwarnings("ignore")
ROOT = pathlib.Path(__file__).parents[2]

# Datums that agree with WGS-84 to a metre or two: no shift is applied. Their geographic systems, 2D and 3D.
LIKE_WGS84 = {
    4326: "WGS 84", 4979: "WGS 84", 4258: "ETRS89", 4937: "ETRS89", 4269: "NAD83", 6318: "NAD83(2011)", 6319: "NAD83(2011)",
    4617: "NAD83(CSRS)", 4955: "NAD83(CSRS)", 4152: "NAD83(HARN)", 4759: "NAD83(NSRS2007)", 4283: "GDA94", 7844: "GDA2020",
    4167: "NZGD2000", 4171: "RGF93 v1", 4674: "SIRGAS 2000", 4612: "JGD2000", 6668: "JGD2011", 4619: "SWEREF99",
}
METHODS = {"utm", "tmerc", "lcc", "merc", "laea", "aea", "somerc", "stere", "sterea"}
# Families whose members are rules in the code: UTM on WGS-84.
RULES = set(range(32601, 32661)) | set(range(32701, 32761)) | {3857}
# Systems of older datums: the shift that is applied, and metres by which it may be off (the accuracy that EPSG states for it).
SHIFTED = {
    21781: ("674.374,15.056,405.346", 1.5), 2056: ("674.374,15.056,405.346", 1.5),
    27700: ("446.448,-125.157,542.06,0.15,0.247,0.842,-20.489", 5),
    28992: ("565.4171,50.3319,465.5524,-0.398957388243134,0.343987817378283,-1.87740163998045,4.0725", 1),
    31466: ("598.1,73.7,418.2,0.202,0.045,-2.455,6.7", 5), 31467: ("598.1,73.7,418.2,0.202,0.045,-2.455,6.7", 5),
    31468: ("598.1,73.7,418.2,0.202,0.045,-2.455,6.7", 5), 31469: ("598.1,73.7,418.2,0.202,0.045,-2.455,6.7", 5),
    31254: ("577.326,90.129,463.919,5.137,1.474,5.297,2.4232", 2), 31255: ("577.326,90.129,463.919,5.137,1.474,5.297,2.4232", 2),
    31256: ("577.326,90.129,463.919,5.137,1.474,5.297,2.4232", 2), 31287: ("577.326,90.129,463.919,5.137,1.474,5.297,2.4232", 2),
    31370: ("-106.8686,52.2978,-103.7239,0.3366,-0.457,1.8422,-1.2747", 1),
}
CHECKED = []


def text_of(crs):
    text = crs.to_proj4()
    words = [w for w in text.split() if w not in ("+no_defs", "+type=crs") and not w.startswith("+towgs84") and not w.startswith("+nadgrids")]
    return " ".join(words)


def main():
    rows, points = [], []
    for code, name in LIKE_WGS84.items():
        rows.append(("geographic", code, CRS.from_epsg(code).name, "", ""))
    # Zones at the rim of ETRS89 are deprecated, and there are files of them.
    codes = {int(info.code) for info in query_crs_info("EPSG", PJType.PROJECTED_CRS)} | set(range(25828, 25839))
    for code in sorted(codes):
        if code in RULES or code > 32767:
            continue
        crs = CRS.from_epsg(code)
        shift, accuracy = SHIFTED.get(code, ("", ""))
        if code not in SHIFTED and (crs.geodetic_crs.to_epsg() not in LIKE_WGS84 or "NAD83(CSRS)" in crs.name or "HARN" in crs.name or "NSRS2007" in crs.name):
            continue
        try:
            text = text_of(crs)
        except pyproj.exceptions.CRSError:
            continue
        words = dict(w.lstrip("+").split("=") for w in text.split() if "=" in w)
        if words.get("proj") not in METHODS or "axis" in words or "datum" in words and words["datum"] not in ("WGS84", "NAD83", "OSGB36", "hermannskogel", "potsdam"):
            continue
        text = text.replace("+datum=WGS84", "+ellps=WGS84").replace("+datum=NAD83", "+ellps=GRS80").replace("+datum=OSGB36", "+ellps=airy")
        text = text.replace("+datum=hermannskogel", "+ellps=bessel").replace("+datum=potsdam", "+ellps=bessel")
        area = crs.area_of_use
        west, south, east, north = area.west, area.south, area.east, area.north
        if east < west:
            east += 360
        of_datum = crs.geodetic_crs
        to_model = Transformer.from_crs(of_datum, crs, always_xy=True)
        # Of the older datums, by the same shift in PROJ, and by the best that PROJ has without grids.
        if code in SHIFTED:
            own = CRS.from_proj4(text + f" +towgs84={shift} +no_defs")
            to_model = Transformer.from_crs(4326, own, always_xy=True)
            CHECKED.append((code, accuracy, crs, own, (west, south, east, north)))
        found = 0
        for s, t in ((0.3, 0.4), (0.7, 0.6)):
            lon, lat = west + s * (east - west), south + t * (north - south)
            x, y = to_model.transform(lon, lat)
            if not (abs(x) < 1e9 and abs(y) < 1e9):
                break
            lon = (lon + 180) % 360 - 180
            points.append((code, f"{x:.4f}", f"{y:.4f}", f"{lat:.10f}", f"{lon:.10f}"))
            found += 1
        if found < 2:
            del points[len(points) - found:]
            print("skipped", code, crs.name)
            continue
        rows.append(("projected", code, crs.name, f"{text} +towgs84={shift}" if shift else text, accuracy))
    projected = {r[1] for r in rows} | RULES
    for info in query_crs_info("EPSG", PJType.VERTICAL_CRS):
        crs = CRS.from_epsg(int(info.code))
        axis = crs.axis_info[0]
        factor = axis.unit_conversion_factor * (-1 if axis.direction == "down" else 1)
        rows.append(("vertical", int(info.code), crs.name, repr(factor), ""))
    for info in query_crs_info("EPSG", PJType.COMPOUND_CRS):
        crs = CRS.from_epsg(int(info.code))
        parts = [part.to_epsg() for part in crs.sub_crs_list]
        if len(parts) == 2 and parts[0] in projected and int(info.code) < 65536:
            rows.append(("compound", int(info.code), crs.name, f"{parts[0]} {parts[1]}", ""))
    head = "# Facts of the EPSG registry (IOGP, https://epsg.org), by scripts/goldens/crs_table.py: kind;code;name;definition;metres by which the datum's shift may be off\n"
    with open(ROOT / "crates/camsim-io/src/raster/crs/systems.csv", "w") as out:
        out.write(head + "".join(";".join(map(str, row)) + "\n" for row in rows))
    with open(ROOT / "tests/data/crs_points.csv", "w") as out:
        out.write(f"# scripts/goldens/crs_table.py, pyproj {pyproj.__version__}, PROJ {pyproj.proj_version_str}\nepsg,x,y,lat_deg,lon_deg\n")
        out.write("".join(",".join(map(str, p)) + "\n" for p in points))
    for code, accuracy, crs, own, (w, s, e, n) in CHECKED:
        best = Transformer.from_crs(4326, crs, always_xy=True)
        mine = Transformer.from_crs(4326, own, always_xy=True)
        worst = 0
        for a, b in itertools.product((0.2, 0.5, 0.8), repeat=2):
            p, q = best.transform(w + a * (e - w), s + b * (n - s)), mine.transform(w + a * (e - w), s + b * (n - s))
            worst = max(worst, ((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2) ** 0.5)
        print(code, crs.name, "differs from PROJ's best by", round(worst, 3), "m; stated", accuracy)
    kinds = [r[0] for r in rows]
    print({k: kinds.count(k) for k in set(kinds)}, len(points))


if __name__ == "__main__":
    main()
