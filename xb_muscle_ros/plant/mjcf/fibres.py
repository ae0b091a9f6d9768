"""The fibre of each muscle: a calibrated fibre with the muscle's force-length relations, tendon and constants."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, changed
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.passive import passive_twice_line
from xb_muscle_ros.plant.mjcf.actuators import MuscleActuators
from xb_muscle_ros.plant.mjcf.calibration import Calibration, calibrated
from xb_muscle_ros.plant.mjcf.fitting import NAMES, fitted
from xb_muscle_ros.plant.mjcf.relations import Relations, relations_of
from xb_muscle_ros.plant.mjcf.spring import series_values, spring_of
from xb_muscle_ros.plant.mjcf.table import Choice
from xb_muscle_ros.plant.plant import Array

_USUAL_L0 = (0.0, 2.0)
"""Within this fibres settle; ends of operating ranges of MyoLeg's muscles are 0.1 to 1.8 L0."""
_SHORT_L0, _LONG_L0 = 0.7, 1.3
"""Lengths over which force and length are fitted even where a muscle's operating range is narrower.

Models go beyond it: MyoLeg's vastus medialis, of 1.15 to 1.61 L0, is at 0.73 L0 where the knee is straight.
"""


@dataclass(frozen=True, eq=False)
class Built:
    """Fibres of a model's muscles, in order.

    Attributes:
        fibres: one for each muscle; named after it, with its F0 and L0.
        calcium_um: tables of calcium by activation, shape (table, point), see `Calibration`.
        table: which of them each muscle has, shape (muscle,).
        least: activation without calcium, shape (muscle,).
        elastic_l0: slack length of elastic tendons, L0, shape (muscle,); 0 where they are rigid.
        relations: isometric force by length.
        warnings: lines on what was taken for granted.
    """

    fibres: tuple[Fibre, ...]
    calcium_um: Array
    table: npt.NDArray[np.int64]
    least: Array
    elastic_l0: Array
    relations: Relations
    warnings: tuple[str, ...]


def build(mj: Any, muscles: MuscleActuators, chosen: Sequence[Choice]) -> Built:
    """Make the fibres.

    Args:
        mj: MuJoCo.
        muscles: what the model says.
        chosen: of each muscle.

    Raises:
        UserError: an unknown fibre, model or parameter, or one that a muscle cannot have.
    """
    known: dict[tuple[object, ...], tuple[int, Calibration]] = {}
    # Left and right legs are alike.
    fit = functools.cache(functools.partial(fitted, mj))
    fibres, table, rigid, elastic = [], [], [], []
    for k, (name, choice) in enumerate(zip(muscles.names, chosen, strict=True)):
        where = f"muscle {name}"
        if choice.key not in known:
            known[choice.key] = len(known), calibrated(choice, where)
        row, calibration = known[choice.key]
        fibre, slack_l0 = calibration.fibre, float(muscles.slack_m[k] / muscles.l0_m[k])
        if choice.tendon == "elastic" and slack_l0 > 0.0:
            fibre = changed(fibre, series_values(fibre, slack_l0, where), where)
        elif choice.tendon == "elastic":
            rigid.append(name)
        own = (float(muscles.fl_min[k]), float(muscles.fl_max[k]), float(muscles.fp_max[k]))
        low, high = muscles.range_l0[k].tolist()
        low, high = round(min(low, _SHORT_L0), 3), round(max(high, _LONG_L0), 3)
        values = fit(own, (low, high), spring_of(fibre)).tolist()
        fibre = changed(fibre, dict(zip(NAMES, values, strict=True)), where)
        f0_n, l0_m = float(muscles.f0_n[k]), float(muscles.l0_m[k])
        fibre = replace(fibre, name=name, f0_n=f0_n, reference_length_m=l0_m)
        _refuse_unreachable(fibre, muscles.range_l0[k].tolist(), where)
        fibres.append(fibre)
        table.append(row)
        elastic.append(slack_l0 if choice.tendon == "elastic" and slack_l0 > 0.0 else 0.0)
    calcium = np.stack([calibration.calcium_um for _, calibration in known.values()])
    least = np.array([calibration.least for _, calibration in known.values()])[table]
    relations, told = relations_of(fibres), _told(rigid, fibres)
    return Built(tuple(fibres), calcium, np.array(table), least, np.array(elastic), relations, told)


def _refuse_unreachable(fibre: Fibre, range_l0: Sequence[float], where: str) -> None:
    """Refuse an operating range whose ends no fibre comes to; a number too many, mostly.

    Raises:
        UserError: relaxed, the fibre does not settle there.
    """
    unusual = [end for end in range_l0 if not _USUAL_L0[0] <= end <= _USUAL_L0[1]]
    for end in unusual:
        try:
            Muscle(fibre).settle(end - 1.0, 0.0)
        except UserError as error:
            low, high = range_l0
            raise UserError(
                f"{where} has operating range {low:g} to {high:g} L0, and no fibre settles at {end:g} L0 ({error}); "
                "give range='low high' within 0 to 2, for example '0.75 1.05', or a larger lmax"
            ) from error


def _told(rigid: Sequence[str], fibres: Sequence[Fibre]) -> tuple[str, ...]:
    """Lines on muscles whose tendons have no length, and on those whose passive force is there twice."""
    made = [f"{', '.join(rigid)}: tendons stay rigid, since the model's numbers leave no length for one"]
    twice: dict[str, list[str]] = {}
    for fibre in fibres:
        own = {**fibre.values, "fp_max": float(fibre.values["fp_max"] > 0.0)}
        if said := passive_twice_line(own):
            twice.setdefault(said, []).append(fibre.name)
    return (*made[not rigid :], *(f"{', '.join(names)}: {said}" for said, names in twice.items()))
