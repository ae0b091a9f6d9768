"""All blocks: those of this package, found by walking its folders, then those from outside."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import inspect
import pkgutil
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from xb_muscle_ros import mechanisms, plugins
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.mechanisms import Family, Mechanism

Block = type[Mechanism]


def found() -> tuple[Block, ...]:
    """Every block, family by family; within one in order of its module's name, those from outside last.

    Raises:
        UserError: a file from outside cannot be imported, or has no mechanism.
    """
    blocks = [block for module in _package() for block in _blocks(module)]
    for file in plugins.files():
        blocks += _some(_blocks(_imported(file)), f"mechanism file {file}")
    for point in plugins.entry_points():
        where = f"entry point '{point.name}' of {plugins.GROUP}"
        with _refusing(where, None):
            module = importlib.import_module(point.module)
        blocks += _some(_blocks(module), where)
    families = list(Family)
    return tuple(
        sorted(dict.fromkeys(blocks), key=lambda block: families.index(getattr(block, "family", Family.EXTRA)))
    )


def is_outside(block: Block) -> bool:
    """Whether a block is not this package's own."""
    return not block.__module__.startswith(f"{mechanisms.__name__}.")


def place(block: Block) -> str:
    """A block as a message names it: with its file."""
    return f"mechanism '{vars(block).get('name', block.__name__)}' ({inspect.getfile(block)})"


def _package() -> Iterator[ModuleType]:
    for package in pkgutil.iter_modules(mechanisms.__path__):
        if package.ispkg:
            folder = importlib.import_module(f"{mechanisms.__name__}.{package.name}")
            for module in pkgutil.iter_modules(folder.__path__):
                yield importlib.import_module(f"{folder.__name__}.{module.name}")


def _blocks(module: ModuleType) -> list[Block]:
    """Blocks that a module defines; names that begin with an underscore are helpers."""
    classes = (c for c in vars(module).values() if inspect.isclass(c) and issubclass(c, Mechanism))
    return [c for c in classes if c.__module__ == module.__name__ and not c.__name__.startswith("_")]


def _some(blocks: list[Block], where: str) -> list[Block]:
    if not blocks:
        raise UserError(f"{where} has no mechanism: no class derived from Extra or a family; see docs/mechanisms.md")
    return blocks


def _imported(file: Path) -> ModuleType:
    """A file as a module; what lies beside it can be imported by it."""
    name = f"xb_muscle_mechanisms_{file.stem}"
    if (known := sys.modules.get(name)) is not None:
        if known.__file__ == str(file):
            return known
        raise UserError(f"{plugins.VARIABLE} names two files {file.name}; give one of them another name")
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    before = set(sys.modules)
    sys.path.append(str(file.parent))
    try:
        with _refusing(f"mechanism file {file}", file):
            spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    finally:
        sys.path.remove(str(file.parent))
    for other in set(sys.modules) - before:
        helper = Path(getattr(sys.modules[other], "__file__", None) or "/")
        if helper.parent == file.parent and helper.name[0].isalpha():
            # What is no mechanism and no helper would not go along to workers, and results kept would not know of it.
            raise UserError(f"mechanism file {file} imports {helper.name} beside it; call that _{helper.name}")
    return module


@contextlib.contextmanager
def _refusing(where: str, file: Path | None) -> Iterator[None]:
    """Say in one line what keeps a module from being imported."""
    try:
        yield
    except UserError:
        raise
    except Exception as error:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
        line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
        raise UserError(
            f"{where}{f', line {line}' if line else ''}: {type(error).__name__}: {error}; mend it, or leave it out"
        ) from error
