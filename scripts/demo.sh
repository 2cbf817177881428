#!/bin/sh
# From a fresh clone to pictures: installs what is missing, builds, renders the built-in flight.
# Arguments go to `camsim demo`, e.g. sh scripts/demo.sh -o /tmp/frames
set -eu
cd "$(dirname "$0")/.."
. scripts/setup.sh

setup
say "building and running (the first build takes some minutes)"
exec cargo run --release -- demo "$@"
