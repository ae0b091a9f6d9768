"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError


@contextlib.contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` that takes its place when the block ends well, and goes away when it does not.

    Raises:
        UserError: the folder cannot be made or written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
        os.close(handle)
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}; choose another output folder") from error
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes files private; what users share should follow their umask.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """Write a text file by way of `replaced`."""
    with replaced(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, tree: Any) -> None:
    """Write plain data as JSON, and dataclasses as objects: what their ``as_row`` says, else their fields.

    Raises:
        ValueError: a number is not finite.
    """
    write_text(path, json.dumps(tree, indent=1, ensure_ascii=False, allow_nan=False, default=_fields) + "\n")


def plain_tree(tree: Any) -> Any:
    """What `write_json` writes, as mappings, lists, texts and numbers."""
    return json.loads(json.dumps(tree, allow_nan=False, default=_fields))


def _fields(value: Any) -> Any:
    if hasattr(value, "as_row"):
        return value.as_row()
    if not dataclasses.is_dataclass(value) or isinstance(value, type):
        raise TypeError(f"{type(value).__name__} has no form in JSON")
    return {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}


def installed_folders(*parts: str) -> Iterator[Path]:
    """Where a folder of the package's data may lie: in the source tree, then in the installed share folders."""
    here = Path(__file__).resolve()
    yield here.parents[1].joinpath(*parts)
    # With colcon and with pip alike, share/ lies beside the lib/ that holds this package.
    beside = [parent.parent for parent in here.parents if parent.name in ("lib", "local")]
    for place in (*beside, Path(sys.prefix)):
        yield place.joinpath("share", "xb_muscle_ros", *parts)


def matching(folder: Path, *patterns: str) -> list[Path]:
    """Files of a folder whose whole name matches one of some regular expressions, sorted; none without the folder."""
    if not folder.is_dir():
        return []
    named = re.compile("|".join(f"(?:{pattern})" for pattern in patterns))
    return sorted(path for path in folder.iterdir() if named.fullmatch(path.name) and path.is_file())


def refuse_older(found: Sequence[Path], overwrite: bool) -> None:
    """Refuse to go on where results of an older run are there and may not be replaced.

    Raises:
        UserError: they are, and `overwrite` is not asked for.
    """
    if found and not overwrite:
        more = f" and {len(found) - 1} more" if len(found) > 1 else ""
        raise UserError(f"{found[0]}{more} exists; use --overwrite to replace it or choose another name for --out")
