"""MuJoCo, which is an extra of this package."""

from __future__ import annotations

import contextlib
import importlib
import warnings
from collections.abc import Iterator
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


def myo_sim() -> Any:
    """The package of the MyoSuite's bodies.

    Raises:
        UserError: it is not installed.
    """
    try:
        return importlib.import_module("myo_sim")
    except ImportError as error:
        raise UserError(
            f"myo_sim cannot be imported ({error}); install it with pip install 'xb_muscle_ros[body]'"
        ) from None


@contextlib.contextmanager
def quiet(mj: Any) -> Iterator[None]:
    """Keep MuJoCo's warnings on how a packaged model is put together, also out of a log in the working folder.

    Args:
        mj: the engine's module.
    """
    before = mj.get_mju_user_warning()
    mj.set_mju_user_warning(lambda _: None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        mj.set_mju_user_warning(before)
