#!/bin/sh
# Runs docs/python/tour.ipynb and stores it with what it shows: the page of the documentation. Needs the package (CAMSIM_WHEEL=WHEEL, or
# a build by scripts/python-test.sh in python/), and installs jupyter and matplotlib into an environment under target/.
set -eu
cd "$(dirname "$0")/.."
venv=${CARGO_TARGET_DIR:-$PWD/target}/notebook-venv
[ -x "$venv/bin/jupyter-nbconvert" ] || {
    "${PYTHON:-python3}" -m venv "$venv"
    "$venv/bin/pip" install -q numpy matplotlib nbconvert ipykernel
}
[ -z "${CAMSIM_WHEEL:-}" ] || "$venv/bin/pip" install -q --force-reinstall --no-deps "$CAMSIM_WHEEL"
[ -n "${CAMSIM_WHEEL:-}" ] || export PYTHONPATH="$PWD/python"
# Times and versions of this machine are removed, so that a run changes what it shows alone.
"$venv/bin/jupyter-nbconvert" --to notebook --execute --inplace --ExecutePreprocessor.record_timing=False docs/python/tour.ipynb
size=$(wc -c < docs/python/tour.ipynb)
[ "$size" -le 500000 ] || {
    echo "docs/python/tour.ipynb has $size bytes; make its pictures smaller: 500000 at most" >&2
    exit 1
}
echo "docs/python/tour.ipynb: $size bytes"
