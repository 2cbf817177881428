"""What camsim raises. The messages are those of the command line: what, where, and what to do."""

from __future__ import annotations


class Error(Exception):
    """Any failure of camsim."""


class InputError(Error, ValueError):
    """Wrong usage, or input that cannot be used: a file, a key, a number out of range."""


class AdapterError(Error, RuntimeError):
    """No usable graphics adapter where ``backend="gpu"`` demands one."""


class RunError(Error, RuntimeError):
    """A failure during the work: the disk, the graphics adapter, a check that did not pass."""


class ScenarioWarning(UserWarning):
    """What a scenario states and camsim reads otherwise, or what looks like a mistake in it."""
