"""What the tests share: the program, and scenarios that need no data beside the repository."""

from __future__ import annotations

import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("CAMSIM_PROGRAM", "camsim")


def run_program(*words: str | os.PathLike[str]) -> str:
    """Standard output of the command line's own program."""
    done = subprocess.run([PROGRAM, *words], check=True, capture_output=True, text=True)
    return done.stdout


@pytest.fixture
def pattern() -> pathlib.Path:
    """The built-in flight over a chequered plane."""
    return ROOT / "assets" / "pattern.toml"
