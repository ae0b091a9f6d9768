"""A key that is sealed: its hash is public from the beginning, so that nobody can change it afterwards."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError

BENCHMARK = "benchmark.json"


def digest(key: Path) -> str:
    """SHA-256 of a key file.

    Raises:
        UserError: it cannot be read.
    """
    try:
        return hashlib.sha256(key.read_bytes()).hexdigest()
    except OSError as error:
        raise UserError(f"key {key} cannot be read: {error.strerror}; give the file that 'prove make' wrote") from error


def load_benchmark(folder: Path) -> dict[str, Any]:
    """What is public of a benchmark.

    Raises:
        UserError: the folder holds none.
    """
    path = folder / BENCHMARK
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(tree, dict) and isinstance(tree["cases"], list) and isinstance(tree["key_sha256"], str):
            return tree
    except (OSError, ValueError, KeyError):
        pass
    raise UserError(f"{path} is no benchmark; give the folder that 'prove make' or 'prove run' wrote")


def open_key(key: Path, benchmark: dict[str, Any]) -> dict[str, Any]:
    """The key's content, if it is the one whose hash was published.

    Raises:
        UserError: it cannot be read, or is not that key.
    """
    found = digest(key)
    if found != benchmark["key_sha256"]:
        raise UserError(
            f"key {key} has SHA-256 {found[:12]}…, but the benchmark was sealed with {benchmark['key_sha256'][:12]}…; "
            "give the key that was made with it"
        )
    content: dict[str, Any] = json.loads(key.read_text(encoding="utf-8"))
    return content
