"""Fibre files as tasks need them: read once in a process, and again when one has changed."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterable
from pathlib import Path

from xb_muscle_ros.models.fibre_file import Fibre, base_set, fibre_folders, load_fibre
from xb_muscle_ros.models.muscle import Muscle


@functools.lru_cache(maxsize=64)
def muscle_of(path: str, model: str, method: str | None, digest: str) -> Muscle | None:
    """The fibre ready to step; None where its file has no set for the model."""
    if not {model, base_set(model)} & set(available_sets(path, digest)):
        return None
    return Muscle(load_fibre(path, model, method))


def available_sets(path: str, digest: str) -> tuple[str, ...]:
    """Sets of a fibre file; kept for as long as no fibre file changes."""
    return fibre_of_file(path, digest).available_models


@functools.lru_cache(maxsize=64)
def fibre_of_file(path: str, digest: str) -> Fibre:
    """A fibre file with its own choice of model; kept for as long as no fibre file changes."""
    return load_fibre(path)


def all_fibre_files() -> list[Path]:
    """The package's fibre files, and the user's beside them."""
    return sorted(file for folder in fibre_folders() for file in folder.glob("*.yaml"))


def digest_of(files: Iterable[str | Path]) -> str:
    """Changes when the content of a file does."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(Path(file).read_bytes())
    return digest.hexdigest()[:16]
