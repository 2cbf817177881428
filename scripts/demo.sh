#!/bin/sh
# Installs what is missing, builds camsim and renders the built-in flight; needs only a clone of the repository and Rust.
# Arguments go to `camsim demo`, e.g. sh scripts/demo.sh -o /tmp/frames
set -eu
cd "$(dirname "$0")/.."
. scripts/setup.sh

setup
say "building and running (the first build takes some minutes; without the window and the experiments: cargo build --release adds them)"
exec cargo run --release --no-default-features --features gpu -- demo "$@"
