"""Values of Python as text of TOML."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from typing import Any

from ._errors import InputError

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def value_text(value: Any, key: str = "") -> str:
    """A value as it stands in a TOML file, on one line. `key` is for messages."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, (str, os.PathLike)):
        # JSON escapes what TOML does, but DEL.
        return json.dumps(os.fspath(value), ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Mapping):
        entries = [f"{key_text(name)} = {value_text(item, f'{key}.{name}')}" for name, item in value.items() if item is not None]
        return "{ " + ", ".join(entries) + " }" if entries else "{}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(value_text(item, f"{key}.{k}") for k, item in enumerate(value)) + "]"
    raise InputError(f"{key}: a scenario holds numbers, text, lists and tables, not {type(value).__name__}")


def key_text(key: Any) -> str:
    """A key, with quotes where it needs them."""
    if not isinstance(key, str):
        raise InputError(f"keys of a scenario are text, not {type(key).__name__}: {key!r}")
    return key if _BARE_KEY.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def document_text(tree: Mapping[str, Any]) -> str:
    """A tree as a TOML document, with a line for each of its keys."""
    return "".join(f"{key_text(key)} = {value_text(item, str(key))}\n" for key, item in tree.items() if item is not None)
