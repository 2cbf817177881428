#!/bin/sh
# What somebody new does with a wheel: an empty environment, one pip install, the first frame as a PNG. Prints how long it took.
#   sh scripts/wheel-test.sh dist/camsim-*.whl
#   PYTHON=python3.12            another interpreter
#   CAMSIM_FIRST_FRAME=FILE.png  where the frame is put [default: first-frame.png in the working folder]
set -eu
[ $# -eq 1 ] || {
    echo "usage: sh scripts/wheel-test.sh WHEEL" >&2
    exit 2
}
here=$PWD
whole() { case $1 in /*) echo "$1" ;; *) echo "$here/$1" ;; esac; }
wheel=$(whole "$1")
kept=$(whole "${CAMSIM_FIRST_FRAME:-first-frame.png}")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
begin=$(date +%s)
"${PYTHON:-python3}" -m venv fresh
fresh/bin/pip install -q "$wheel"
# Away from the repository, so that nothing but the wheel can be imported: the built-in flight is in it.
fresh/bin/python - <<'PYTHON'
import camsim

scenario = camsim.Scenario.demo()
frame = scenario[7]
frame.save("first.png")
print(scenario, frame, f"mean {frame.color[..., :3].mean():.4f}", sep="\n")
assert 0.05 < frame.color[..., :3].mean() < 0.95 and (frame.color[..., 3] == 1).all()
PYTHON
cp first.png "$kept"
echo "wheel: first frame in $kept after $(($(date +%s) - begin)) s"
# The command line is in it too, with the same picture.
fresh/bin/camsim info
fresh/bin/camsim demo -o demo --quiet
fresh/bin/python -m camsim render demo/scene/demo.toml -o frames --frames 7 --format png --quiet
cmp first.png frames/color/frame_000007.png
echo "wheel: the command line renders the same picture"
# It has no window, and says so.
if fresh/bin/camsim viewer 2>viewer.txt || ! grep -q "leaves that command out" viewer.txt; then
    cat viewer.txt >&2
    exit 1
fi
