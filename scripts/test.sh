#!/bin/sh
# Installs what is missing, then checks formatting and lints and runs every test; needs only a clone of the repository and Rust.
#   --quick            formatting, and the tests that need no graphics adapter: planner, cpu renderer, files, command line
#   CAMSIM_DATA=DIR    also runs the tests on real flights, terrains and calibrations, which are not in the repository
#   CAMSIM_SKIP_JUDGES=1  leaves out scripts/judges.sh, which downloads Python packages
#   CAMSIM_SKIP_GPU=1  ignores the tests that need a graphics adapter; without it they fail on a machine that has none
set -eu
cd "$(dirname "$0")/.."
. scripts/setup.sh

case ${1:-} in
--quick)
    setup_cargo
    say "formatting"
    cargo fmt --all --check
    say "tests without a graphics adapter"
    cargo test --no-default-features --lib --bins --tests \
        -p camsim-scenario -p camsim-core -p camsim-plan -p camsim-cpu -p camsim-io -p camsim-cli
    say "passed; not run: lints, examples, tests of engine, gpu, viewer, experiments and Python, readers of other programs"
    exit
    ;;
"") ;;
*)
    say "unknown option $1: sh scripts/test.sh [--quick]"
    exit 2
    ;;
esac

setup
# Without a desktop session Mesa prints an error for every adapter opened; camsim itself does without that layer.
[ -n "${XDG_RUNTIME_DIR:-}" ] || export NODEVICE_SELECT=1
say "test data: ${CAMSIM_DATA:-none (CAMSIM_DATA is unset; tests that need it return early)}"

if cargo fmt --version >/dev/null 2>&1; then
    say "formatting"
    cargo fmt --all --check
else
    say "formatting not checked: rustup component add rustfmt"
fi

if [ "${CAMSIM_SKIP_GPU:-}" = 1 ]; then
    say "CAMSIM_SKIP_GPU=1: tests that need an adapter are ignored"
else
    say "adapter"
    cargo run -- info
fi

if cargo clippy --version >/dev/null 2>&1; then
    say "lints"
    cargo clippy --workspace --all-targets -- -D warnings
    cargo clippy --no-default-features -- -D warnings
else
    say "lints not checked: rustup component add clippy"
fi

say "tests"
# Examples in the documentation and readers of other programs first, so that the run closes on the suite itself.
cargo test --workspace --doc
say "exports, judged by readers of other programs"
if [ "${CAMSIM_SKIP_JUDGES:-}" = 1 ]; then
    say "CAMSIM_SKIP_JUDGES=1: JUDGES SKIPPED, no other program has read the exports"
else
    sh scripts/judges.sh
fi
sh scripts/python-test.sh
cargo test --workspace --lib --bins --tests
say "all passed"
