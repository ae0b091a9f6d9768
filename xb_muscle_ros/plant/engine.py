"""MuJoCo, which is an extra of this package."""

from __future__ import annotations

import importlib
from typing import Any

from xb_muscle_ros.errors import UserError


def mujoco() -> Any:
    """The engine's module.

    Raises:
        UserError: it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ImportError as error:
        raise UserError(
            f"MuJoCo cannot be imported ({error}); install it with pip install 'xb_muscle_ros[mujoco]'"
        ) from None
