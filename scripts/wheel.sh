#!/bin/sh
# Builds the Python wheel into dist/: one for every Python from 3.10 on. It needs numpy, and the C library of the platform that its name
# says (manylinux_2_28: glibc 2.28 or newer); libvulkan is not in it, but loaded where it is found.
#   PYTHON=python3.12   another interpreter
#   sh scripts/wheel.sh --zig    links against glibc 2.28 by zig, whatever this system has; else the wheel's name says what it needs
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
case ${1:-} in
--zig)
    "$venv/bin/pip" install -q ziglang
    PATH=$venv/bin:$PATH "$venv/bin/maturin" build --release --out dist --zig --compatibility manylinux_2_28
    ;;
"") "$venv/bin/maturin" build --release --out dist ;;
*)
    say "unknown argument $1"
    exit 2
    ;;
esac
ls -l dist
