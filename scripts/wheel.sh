#!/bin/sh
# Builds the Python wheel of this machine into dist/: one for every Python from 3.10 on. It needs numpy, and the C library of the platform
# that its name says; libvulkan is not in it, but loaded where it is found. `sh scripts/dist.sh wheel-x86_64` makes that of a release, for glibc 2.28.
#   PYTHON=python3.12   another interpreter
set -eu
cd "$(dirname "$0")/.."
. scripts/setup.sh

setup_cargo
python=${PYTHON:-python3}
venv=${CARGO_TARGET_DIR:-$PWD/target}/wheel-venv
[ -x "$venv/bin/maturin" ] || {
    "$python" -m venv "$venv"
    "$venv/bin/pip" install -q "maturin>=1.16,<2"
}
"$venv/bin/maturin" build --release --out dist
ls -l dist
