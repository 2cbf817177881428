"""What camsim raises. The messages are those of the command line: what, where, and what to do."""

from __future__ import annotations

_WORDS: dict[str, str] = {}
"""Words for files that camsim has made of what the user gave, by their paths below the system's temporary folder."""


def name_path(path: str, words: str) -> None:
    """From now on messages have these words instead of a path."""
    _WORDS[path] = words


def forget_paths(folder: str) -> None:
    """Forgets the words for a folder and all that is in it."""
    for path in [path for path in list(_WORDS) if path.startswith(folder)]:
        _WORDS.pop(path, None)


def in_users_words(message: str) -> str:
    """A message that names what the user gave instead of files that the user has never seen."""
    for path in sorted(_WORDS, key=len, reverse=True):
        message = message.replace(path, _WORDS.get(path, path))
    return message


class Error(Exception):
    """Any failure of camsim."""

    def __init__(self, *args: object) -> None:
        super().__init__(*(in_users_words(arg) if isinstance(arg, str) else arg for arg in args))


class InputError(Error, ValueError):
    """Wrong usage, or input that cannot be used: a file, a key, a number out of range."""


class AdapterError(Error, RuntimeError):
    """No usable graphics adapter where ``backend="gpu"`` demands one."""


class RunError(Error, RuntimeError):
    """A failure during the work: the disk, the graphics adapter, a check that did not pass."""


class ScenarioWarning(UserWarning):
    """What a scenario states and camsim reads otherwise, or what looks like a mistake in it."""
