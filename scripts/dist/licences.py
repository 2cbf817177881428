"""Writes the licences of everything that is linked into a program for one target into one file:
python3 scripts/dist/licences.py TARGET PACKAGE FILE [FEATURE...]

Takes the crates from `cargo metadata` and the texts from their sources; a text that several crates share is written once. Without
features the package's defaults count."""

import json
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

TEXT = re.compile(r"^(un)?licen[cs]e|^copying|^copyright|^notice|^[ou]fl\.txt$", re.IGNORECASE)
# What no crate's folder has: linked in by the compiler and by the linker.
ALSO = """Rust's standard library: MIT OR Apache-2.0. Copyright (c) The Rust Project Contributors.
compiler-rt and libunwind, with programs linked by zig: Apache-2.0 WITH LLVM-exception. Copyright (c) the LLVM Project's contributors.
"""


def linked(target: str, package: str, features: list[str]) -> list[dict]:
    """The crates that the program is made of, without itself and those of its workspace."""
    words = ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", target]
    if features:
        words += ["--no-default-features", "--features", ",".join(f"{package}/{feature}" for feature in features)]
    metadata = json.loads(subprocess.run(words, check=True, stdout=subprocess.PIPE).stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    waiting = [id for id, found in packages.items() if found["name"] == package]
    seen = set(waiting)
    while waiting:
        for dependency in nodes[waiting.pop()]["deps"]:
            is_linked = any(kind["kind"] is None for kind in dependency["dep_kinds"])
            if is_linked and dependency["pkg"] not in seen:
                seen.add(dependency["pkg"])
                waiting.append(dependency["pkg"])
    own = set(metadata["workspace_members"])
    return sorted((packages[id] for id in seen - own), key=lambda found: (found["name"], found["version"]))


def texts(package: dict) -> list[str]:
    """The licence files of a crate, at its root and one folder below (fonts have theirs beside them)."""
    root = Path(package["manifest_path"]).parent
    files = {path for pattern in ("*", "*/*") for path in root.glob(pattern) if path.is_file() and TEXT.match(path.name)}
    if package["license_file"]:
        files.add(root / package["license_file"])
    files = {path for path in files if path.suffix.lower() not in {".rs", ".png", ".html", ".json", ".toml", ".yml"}}
    return [path.read_text(encoding="utf-8", errors="replace").strip() for path in sorted(files)]


def main() -> None:
    target, package, out, *features = sys.argv[1:]
    crates = linked(target, package, features)
    users = defaultdict(list)
    lines = [f"camsim contains these {len(crates)} crates. Licences that have a text in the crate follow below.\n"]
    for crate in crates:
        name = f"{crate['name']} {crate['version']}"
        found = texts(crate)
        for text in found:
            users[text].append(name)
        note = "" if found else f" (no text in the crate; by {', '.join(crate['authors']) or 'its contributors'})"
        lines.append(f"{name}: {crate['license'] or 'see its text'}{note}")
    lines.append("\n" + ALSO)
    for text, names in sorted(users.items(), key=lambda entry: entry[1][0]):
        lines += ["-" * 80, "Of " + ", ".join(names), "-" * 80, "", text, ""]
    Path(out).write_text("\n".join(lines), encoding="utf-8")
    print(f"{out}: {len(crates)} crates, {len(users)} texts")


main()
