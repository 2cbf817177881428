#!/bin/sh
# What somebody new does with a wheel: an empty environment, one pip install, the first frame as a PNG. Prints how long it took.
#   sh scripts/wheel-test.sh dist/camsim-*.whl
set -eu
wheel=$1
repository=$(cd "$(dirname "$0")/.." && pwd)
case $wheel in /*) ;; *) wheel=$PWD/$wheel ;; esac
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
begin=$(date +%s)
"${PYTHON:-python3}" -m venv fresh
fresh/bin/pip install -q "$wheel"
# Away from the repository, so that nothing but the wheel can be imported; the demo's scenario is in the program itself.
fresh/bin/camsim demo -o demo --frames 0..1 --quiet
fresh/bin/python - <<'PYTHON'
import camsim

scenario = camsim.Scenario.load("demo/scene/demo.toml")
frame = scenario[7]
frame.save("first.png")
print(scenario, frame, f"mean {frame.color[..., :3].mean():.4f}", sep="\n")
assert 0.05 < frame.color[..., :3].mean() < 0.95 and (frame.color[..., 3] == 1).all()
PYTHON
fresh/bin/python -m camsim explain demo/scene/demo.toml --frame 7 --quiet | tail -n 3
fresh/bin/python -m camsim info
cp first.png "$repository/${CAMSIM_FIRST_FRAME:-first-frame.png}"
echo "wheel: first frame after $(($(date +%s) - begin)) s"
