"""The command line: ``python -m camsim``, and the program ``camsim`` of the wheel."""

from __future__ import annotations

import sys

from . import _camsim


def main() -> int:
    """Runs the command of `sys.argv`; gives its exit code."""
    return _camsim.run_main(["camsim", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
