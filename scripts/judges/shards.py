#!/usr/bin/env python3
"""DuckDB reads the Parquet index of WebDataset's shards: its rows are those of samples.csv, and its poses those in the shards.

    shards.py RUN...     output folders with datasets/webdataset
"""

import json
import pathlib
import sys
import tarfile

import duckdb
import numpy as np
from common import check, finish, rows, versions

POSE = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"]


def judge(run):
    name, folder = run.parent.name, run / "datasets" / "webdataset"
    table = duckdb.sql(f"select * from read_parquet('{folder / 'samples.parquet'}')")
    kinds = dict(zip(table.columns, map(str, table.types)))
    found = [dict(zip(table.columns, row)) for row in table.fetchall()]
    lines = rows(folder / "samples.csv")
    different = sum(
        {key: str(row[key]) for key in line} != line for row, line in zip(found, lines, strict=True)
    )
    print(f"  {name}: {len(found)} samples; {', '.join(f'{key} {kind}' for key, kind in kinds.items())}")
    check(f"{name}: rows that differ from samples.csv", different, 0)
    poses, count = {row["key"]: [row[key] for key in POSE] for row in found}, 0
    worst = 0.0
    for shard in sorted({row["shard"] for row in found}):
        with tarfile.open(folder / shard) as archive:
            for member in archive:
                if member.name.endswith(".json"):
                    sample = json.load(archive.extractfile(member))
                    pose = sample["position_enu_m"] + sample["enu_from_camera_wxyz"]
                    worst = max(worst, np.abs(np.array(pose) - poses[member.name.removesuffix(".json")]).max())
                    count += 1
    check(f"{name}: samples of the index that shards lack", abs(count - len(found)), 0)
    check(f"{name}: poses, away from those in the shards", worst, 0)


def main(folders):
    versions("duckdb", "numpy")
    for folder in folders:
        judge(folder)
    finish()


if __name__ == "__main__":
    main([pathlib.Path(path) for path in sys.argv[1:]])
