"""Compiled models on disk: generated once, compiled once, loaded in milliseconds afterwards.

The folder is `XB_MUSCLE_CACHE`, else `xb_muscle_ros` in the user's cache folder, else one in the temporary folder. A
file's name carries a hash of everything that it depends on, so that a changed mechanism never meets a stale file.
"""

from __future__ import annotations

import functools
import importlib.util
import os
import sys
import tempfile
from pathlib import Path
from types import ModuleType

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.mechanisms.discovery import is_outside, place
from xb_muscle_ros.models.composition import Model
from xb_muscle_ros.models.fingerprint import fingerprint
from xb_muscle_ros.models.registry import compose


def cache_folder() -> Path:
    """Folder for generated code; made if need be.

    Raises:
        UserError: no folder can be written.
    """
    named = os.environ.get("XB_MUSCLE_CACHE")
    choices = [Path(named)] if named else []
    if not named:
        home = os.environ.get("XDG_CACHE_HOME") or str(Path("~/.cache").expanduser())
        choices = [Path(home) / "xb_muscle_ros", Path(tempfile.gettempdir()) / f"xb_muscle_ros_{os.getuid()}"]
    for folder in choices:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    tried = ", ".join(str(folder) for folder in choices)
    raise UserError(
        f"no folder for compiled models can be written (tried {tried}); set XB_MUSCLE_CACHE to one that can"
    )


def _path(model: Model, smooth: bool) -> Path:
    """File of a model's generated module."""
    return cache_folder() / f"m_{model.name}_{'smooth' if smooth else 'exact'}_{fingerprint(model)}.py"


def is_compiled(model: str, method: str, smooth: bool) -> bool:
    """Whether this machine's cache has a model's module, so that loading it takes no more than a moment.

    Raises:
        UserError: unknown names, or no folder to write to.
    """
    return _path(compose(model, method), smooth).exists()


@functools.cache
def compiled(model: str, method: str, smooth: bool) -> ModuleType:
    """The compiled module of a model: `advance`, `run`, `follow`, `outputs`, `rest`, `rhs` and its sizes.

    Args:
        model: registry name.
        method: representation of the distribution.
        smooth: with the released sets' smooth functions.

    Raises:
        UserError: unknown names, or no folder to write to.
    """
    composition = compose(model, method)
    path = _path(composition, smooth)
    stem = path.stem
    if not path.exists():
        text = _text(composition, smooth)
        # Under a name of its own first: another process may be at the same file.
        with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8") as file:
            file.write(text)
        Path(file.name).replace(path)
    spec = importlib.util.spec_from_file_location(f"xb_muscle_ros_generated_{stem}", path)
    if spec is None or spec.loader is None:
        raise UserError(f"compiled model {path} cannot be loaded; remove it and try again")
    module = importlib.util.module_from_spec(spec)
    # Numba's cache looks the module up by name when it loads compiled code.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def _text(model: Model, smooth: bool) -> str:
    """Text of a model's module.

    Raises:
        UserError: formulas from outside the package of which no code can be made.
    """
    try:
        return model.module_text(smooth)
    except Exception as error:
        outside = [place(type(block)) for block in model.blocks if is_outside(type(block))]
        if isinstance(error, UserError) or not outside:
            raise
        raise UserError(
            f"no code can be made of {' and '.join(outside)} ({type(error).__name__}: {error}); formulas may use "
            "+ - * / **, the functions of xb_muscle_ros.mechanisms.ops and those of q, but no if and no math"
        ) from error
