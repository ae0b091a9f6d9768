"""A key that is sealed: its hash is public from the beginning, so that nobody can change it afterwards."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from xb_muscle_ros.diagnose.report.codec import renamed
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching

BENCHMARK = "benchmark.json"
VERSION = 3
"""Of keys and public descriptions; former keys are read."""
# Keys of the versions before 3.
_RENAMED = {
    "faults": "artefact_sizes", "ordinary": "ordinary_artefact_sizes", "artefacts_left_f0": "artefact_residual_f0",
    "artefacts_left_sd": "artefact_prior_residual_sd", "beside_rest_f0": "unique_contribution_f0",
}  # fmt: skip
SINGLES, COMPOSITES = KINDS = ("singles", "composites")
"""Kinds of benchmark: at most one thing or a pair is concealed; or several, on top of ordinary artefacts."""


def older_cases(folder: Path) -> list[Path]:
    """What an older benchmark left in a folder: the cases that it tells of, and itself last."""
    try:
        names = [str(name) for name in load_benchmark(folder)["cases"]]
    except UserError:
        names = []
    found: list[Path] = []
    for name in names:
        case = folder / "cases" / name
        if (case / "bags").is_dir():
            found += [bag for bag in sorted((case / "bags").iterdir()) if bag.is_dir()]
        found += matching(case, r"fibre\.yaml")
    return [*found, *matching(folder, re.escape(BENCHMARK))]


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


def kind_of(tree: Mapping[str, Any]) -> str:
    """Kind of a benchmark by its public description or key; older ones do not say it."""
    return str(tree.get("kind", SINGLES))


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
    if content["version"] < VERSION:
        content = renamed(content, _RENAMED)
        for case in content["cases"]:
            case["kind"] = "artefact" if case["kind"] == "fault" else case["kind"]
    return content
