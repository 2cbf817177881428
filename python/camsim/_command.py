"""The command line from within Python."""

from __future__ import annotations

import os
from collections.abc import Sequence

from . import _camsim
from ._errors import AdapterError, InputError, RunError


def output(words: Sequence[str | os.PathLike[str]], *, fails_with_output: bool = False) -> str:
    """What a command prints to standard output.

    :param fails_with_output: Exit code 1 is a verdict, if anything is printed.
    :raises camsim.Error: What it prints to standard error, if it fails.
    """
    code, stdout, stderr = _camsim.run(["--quiet", *words])
    if code and not (fails_with_output and code == 1 and stdout):
        message = stderr.decode(errors="replace").strip().removeprefix("error: ")
        raise {2: InputError, 3: AdapterError}.get(code, RunError)(message)
    return stdout.decode()
