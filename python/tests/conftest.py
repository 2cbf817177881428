"""What the tests share: the program, and scenarios that need no data beside the repository."""

from __future__ import annotations

import os
import pathlib
import subprocess
from typing import Any

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("CAMSIM_PROGRAM", "camsim")
LONG = bool(os.environ.get("CAMSIM_LONG"))

SMALL: dict[str, Any] = {
    "camera.size_px": [160, 120],
    "camera.focal_px": [105.0, 105.25],
    "camera.principal_point_px": [79.3, 60.2],
}
"""A sixteenth of the pixels of the built-in cameras, of the same field of view."""


def run_program(*words: str | os.PathLike[str]) -> str:
    """Standard output of the command line's own program."""
    done = subprocess.run([PROGRAM, *words], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout


def set_words(sets: dict[str, Any]) -> list[str]:
    """Changes of a scenario as words of the command line."""
    text = {key: str(value).lower() if isinstance(value, bool) else str(value) for key, value in sets.items()}
    return [word for key, value in text.items() for word in ("--set", f"{key}={value}")]


@pytest.fixture
def pattern() -> pathlib.Path:
    """The built-in flight over a plane."""
    return ROOT / "assets" / "pattern.toml"


@pytest.fixture
def demo() -> pathlib.Path:
    """The built-in flight over its valley."""
    return ROOT / "assets" / "demo.toml"
