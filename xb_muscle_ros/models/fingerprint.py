"""What a model's generated code depends on, as a hash: its own blocks alone, so that a new one leaves others' code."""

from __future__ import annotations

import ast
import functools
import hashlib
import sys
import sysconfig
from importlib.metadata import version
from importlib.util import resolve_name
from pathlib import Path

import numba

from xb_muscle_ros.mechanisms import Mechanism
from xb_muscle_ros.models.composition import Model

_PACKAGE = Path(__file__).resolve().parents[1]
_SOURCES = ("symbolic/*.py", "mechanisms/*.py", "distribution/*.py", "models/*.py", "stepping/*.py")
_LIBRARIES = tuple(Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib", "purelib", "platlib"))


def fingerprint(model: Model) -> str:
    """Hash of the source of a model's blocks, of all source that every model uses, and of what compiles it."""
    digest = hashlib.sha256(_of_every_model().encode())
    # Blocks share rows: names and bounds that are written in another block's file.
    digest.update(repr(([row.name for row in model.parameters], model.states)).encode())
    modules: dict[str, None] = {}
    for block in model.blocks:
        for kind in type(block).__mro__:
            if issubclass(kind, Mechanism):
                _collect(kind.__module__, modules)
    for name in modules:
        digest.update(f"\0{name}\0{_code(name)}".encode())
    return digest.hexdigest()[:16]


@functools.cache
def _of_every_model() -> str:
    digest = hashlib.sha256(f"{sys.version} numba {numba.__version__} sympy {version('sympy')}".encode())
    for file in sorted(path for pattern in _SOURCES for path in _PACKAGE.glob(pattern)):
        digest.update(str(file.relative_to(_PACKAGE)).encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _collect(name: str, found: dict[str, None]) -> None:
    """A module and those that it imports, but for what every model uses and for libraries."""
    file = _file(name)
    if name in found or file is None or (file.is_relative_to(_PACKAGE) and file.parents[1].name != "mechanisms"):
        return
    found[name] = None
    for node in ast.walk(_tree(file)):
        if isinstance(node, ast.Import):
            imported = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            package = str(sys.modules[name].__package__ or "")
            whole = resolve_name("." * node.level + (node.module or ""), package)
            imported = [whole, *(f"{whole}.{alias.name}" for alias in node.names)]
        else:
            continue
        for other in imported:
            if other.partition(".")[0] == name.partition(".")[0] or not _is_library(other):
                _collect(other, found)


def _file(name: str) -> Path | None:
    file = getattr(sys.modules.get(name), "__file__", None)
    return Path(file).resolve() if file and file.endswith(".py") else None


def _is_library(name: str) -> bool:
    file = _file(name)
    return file is None or any(file.is_relative_to(folder) for folder in _LIBRARIES)


@functools.cache
def _tree(file: Path) -> ast.Module:
    """What a module computes: without comments, without its texts, and without what a catalogue says of its blocks."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            node.body = [line for line in node.body if not _only_says(line)]
    return tree


@functools.cache
def _code(name: str) -> str:
    file = _file(name)
    assert file is not None
    return ast.dump(_tree(file))


def _only_says(line: ast.stmt) -> bool:
    match line:
        case ast.Expr(value=ast.Constant(value=str())) | ast.Assign(targets=[ast.Name(id="entry")], value=ast.Call()):
            return True
    return False
