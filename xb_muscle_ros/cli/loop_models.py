"""Models and numbers that scenes of ``xb_muscle loop`` are asked for."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError

if TYPE_CHECKING:
    from xb_muscle_ros.models.fibre_file import Fibre

_PLATFORM = {"displacement": "displacement_m", "speed": "speed_m_per_s", "acceleration": "acceleration_m_per_s2"}


def values_of(arguments: argparse.Namespace, names: Mapping[str, str]) -> dict[str, float]:
    """Numbers that were given, under the names that they have within; what was not given has its default there.

    Args:
        arguments: parsed.
        names: of options, and what they are called within.
    """
    return {within: getattr(arguments, name) for name, within in names.items() if getattr(arguments, name) is not None}


def platform_values(arguments: argparse.Namespace) -> dict[str, float]:
    """What was given of the platform's motion, for `RampAndHold`."""
    return values_of(arguments, _PLATFORM)


def fibres_of(name: str, models: Sequence[str] | None, defaults: Sequence[str]) -> list[Fibre | None]:
    """A fibre for each model; None is MuJoCo's muscle. A default that the fibre file has no set for is left out.

    Args:
        name: fibre file, or name of a fibre in the package.
        models: that were asked for; None: the defaults.
        defaults: of the scene.

    Raises:
        UserError: the fibre, or a model that was asked for, is not there.
    """
    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.plant.drives import OWN

    fibres: list[Fibre | None] = []
    for model, count in Counter(models or ()).items():
        if count > 1:
            common.warn(f"--model {model} is given {count} times; it runs once")
    load_fibre(name)  # a fibre that is not there is an error, not a model to leave out
    for model in dict.fromkeys(models or defaults):
        if model == OWN:
            fibres.append(None)
            continue
        try:
            fibres.append(load_fibre(name, model))
        except UserError as error:
            if models:
                raise
            common.warn(f"model {model} is left out: {error}")
    return fibres
