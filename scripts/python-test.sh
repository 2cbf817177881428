#!/bin/sh
# Builds the Python package as `cargo test` builds everything else, and runs its tests and type checks in an environment of its own
# under target/. Says so where there is no Python.
#   PYTHON=python3.12   another interpreter
#   CAMSIM_LONG=1       longer series
set -eu
cd "$(dirname "$0")/.."
. scripts/setup.sh

setup_cargo
python=${PYTHON:-python3}
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
    say "PYTHON NOT TESTED: no $python of version 3.10 or newer"
    exit 0
fi
target=${CARGO_TARGET_DIR:-$PWD/target}
venv=$target/python-venv
if ! [ -x "$venv/bin/pytest" ] && ! { "$python" -m venv "$venv" && "$venv/bin/pip" install -q numpy pytest mypy; }; then
    say "PYTHON NOT TESTED: cannot install numpy, pytest and mypy into $venv"
    exit 0
fi

# Together with the program, so that both are built with the same features: nothing is compiled twice.
say "Python package: build"
cargo build -p camsim -p camsim-python
case $(uname -s) in
Darwin) library=lib_camsim.dylib ;;
*) library=lib_camsim.so ;;
esac
cp -f "$target/debug/$library" python/camsim/_camsim.abi3.so

say "Python package: types"
"$venv/bin/mypy" --strict python/camsim examples/python/*.py examples/tutorial/*.py
say "Python package: tests"
PYTHONPATH=$PWD/python CAMSIM_PROGRAM=$target/debug/camsim "$venv/bin/pytest" -q python/tests
