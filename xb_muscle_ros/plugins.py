"""Mechanisms from outside the package: which files and installed packages have some, and what they are made of."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from xb_muscle_ros.errors import UserError

VARIABLE = "XB_MUSCLE_MECHANISMS"
"""Environment variable: Python files, or folders of such, with mechanisms; separated by colons."""
GROUP = "xb_muscle_ros.mechanisms"
"""Entry-point group: modules of installed packages with mechanisms."""
NONE = "none"


def files() -> tuple[Path, ...]:
    """Files that `VARIABLE` names, absolute: folder by folder, in one in order of name.

    Of a folder those whose name begins with a letter; others are helpers that these may import.

    Raises:
        UserError: there is no such file, or none in a folder.
    """
    found: dict[Path, set[Path]] = {}
    for text in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
        path = Path(text).expanduser().absolute()
        inside = {p for p in (path.glob("*.py") if path.is_dir() else [path]) if p.name[0].isalpha()}
        if not inside or not all(p.is_file() and p.suffix == ".py" for p in inside):
            raise UserError(
                f"{VARIABLE} names {text}, which is no Python file and no folder with some (their names begin with a "
                "letter); correct or unset it"
            )
        for file in inside:
            found.setdefault(file.parent, set()).add(file)
    return tuple(file for inside in found.values() for file in sorted(inside))


def entry_points() -> tuple[importlib.metadata.EntryPoint, ...]:
    """Entry points of `GROUP`, in order of name."""
    # Every installed package's names cost 10 to 30 ms at each start, and nearly always there are none of the group.
    if not any(_declares(file) for folder in sys.path for file in Path(folder).glob("*-info/entry_points.txt")):
        return ()
    return tuple(sorted(importlib.metadata.entry_points(group=GROUP), key=lambda point: (point.name, point.value)))


def _declares(file: Path) -> bool:
    try:
        return GROUP in file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False


def texts() -> dict[str, str]:
    """Texts of `files` and of the other Python files beside them, by place and name, for another machine.

    Raises:
        UserError: see `files`.
    """
    named, found = files(), {}
    for number, folder in enumerate(dict.fromkeys(path.parent for path in named)):
        # A name that begins with a letter is that of a file with mechanisms: what else lies there is a helper.
        for path in sorted(p for p in folder.glob("*.py") if p in named or not p.name[0].isalpha()):
            found[f"{number}/{path.name}"] = path.read_text(encoding="utf-8")
    return found


def use(given: Mapping[str, str]) -> None:
    """Have this process take the mechanisms of `texts` from another one; before it imports a model."""
    folder = Path(tempfile.mkdtemp(prefix="xb_muscle_mechanisms_"))
    for name, text in given.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    os.environ[VARIABLE] = os.pathsep.join(str(path) for path in sorted(folder.iterdir()))


def identity() -> str:
    """A text that changes with every mechanism from outside; `NONE` without any.

    Raises:
        UserError: see `files`.
    """
    parts = [f"{name}\0{text}" for name, text in texts().items()]
    parts += [f"{p.name} {p.value} {p.dist.version if p.dist else ''}" for p in entry_points()]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16] if parts else NONE
