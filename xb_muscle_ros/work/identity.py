"""What a result depends on: the function, its code and what runs it, and the task."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import inspect
import json
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

from xb_muscle_ros import __version__, plugins

_PACKAGE = Path(__file__).resolve().parents[1]
# sympy generates the code of a model, so that another version may order its sums otherwise.
_LIBRARIES = ("numpy", "scipy", "numba", "sympy")


@functools.cache
def environment() -> dict[str, str]:
    """The versions that results depend on, by name of what has them."""
    versions = {name: importlib.metadata.version(name) for name in _LIBRARIES}
    python = ".".join(platform.python_version_tuple()[:2])
    own = {"mechanisms from outside": plugins.identity()} if plugins.identity() != plugins.NONE else {}
    return {"xb_muscle_ros": f"{__version__} (source {_source_hash()})", "Python": python, **versions, **own}


def differences(theirs: dict[str, str]) -> str:
    """Where another process's environment is not this one's, in words; empty if nowhere."""
    ours = environment()
    return ", ".join(
        f"{name} {ours.get(name, 'none')} instead of {theirs.get(name, 'none')}"
        for name in sorted({*ours, *theirs})
        if ours.get(name) != theirs.get(name)
    )


def name_of(function: Callable[..., Any]) -> str:
    """A function's name as other processes find it.

    Raises:
        TypeError: it is not a function of a module.
    """
    name = getattr(function, "__qualname__", None)
    if not inspect.isfunction(function) or name is None or "<" in name:
        raise TypeError(f"{function!r} is not a function of a module; other processes cannot import it")
    return f"{function.__module__}:{name}"


def describe(function: Callable[..., Any], task: object) -> str:
    """A task in few words."""
    text = repr(task)
    return f"task {name_of(function)} of {text if len(text) <= 120 else text[:117] + '...'}"


class Keys:
    """Keys of the results of one function.

    A key changes with anything a result may depend on: the function's name and code, the versions of `environment`,
    and the task, compared as JSON. It does not see what a file holds that a task only names.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        """Take the function's identity.

        Raises:
            TypeError: it is not a function of a module.
        """
        parts = [name_of(function), *(f"{name} {version}" for name, version in environment().items())]
        source = inspect.getsourcefile(function)
        if source is not None and _PACKAGE not in Path(source).resolve().parents:
            parts.append(Path(source).read_text(encoding="utf-8"))
        self._begun = hashlib.sha256("\n".join(parts).encode())

    def of(self, task: object) -> str:
        """The key of a task's result, 32 hexadecimal digits.

        Raises:
            TypeError, ValueError: the task is not plain data.
        """
        digest = self._begun.copy()
        digest.update(b"\0" + json.dumps(task, sort_keys=True, separators=(",", ":")).encode())
        return digest.hexdigest()[:32]


def _source_hash() -> str:
    """Hash of all source of the package."""
    digest = hashlib.sha256()
    for file in sorted(_PACKAGE.rglob("*.py")):
        digest.update(f"{file.relative_to(_PACKAGE).as_posix()}\0".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
