"""The spring in series with half-sarcomeres: a fibre's own, or that and a tendon."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.plant.tendon import strain


class Spring(NamedTuple):
    """F = force_f0 (exp(extension/length_l0) - 1).

    Attributes:
        length_l0: extension by which the force and its offset grow e times, L0; 0: rigid.
        force_f0: offset, F0.
    """

    length_l0: float
    force_f0: float


def spring_of(fibre: Fibre) -> Spring:
    """The series element of a fibre's model; rigid where it has none."""
    values = fibre.values
    if "kse" not in values:
        return Spring(0.0, 1.0)
    return Spring(1.0 / (values["kse"] * values["gamma"]), values["kse0"] * values["Fscale"])


def with_tendon(spring: Spring, slack_l0: float) -> Spring:
    """The one spring that stretches as a fibre's own and a tendon do in series.

    Both are exponential, so that one of the same kind comes close: its extension is that of both at one F0, and nearest
    to theirs from 0 to 1.2 F0.

    Args:
        spring: of the fibre.
        slack_l0: slack length of the tendon, L0.
    """
    force = np.linspace(0.0, 1.2, 61)[1:]
    both = spring.length_l0 * np.log1p(force / spring.force_f0) + slack_l0 * strain(force)
    whole = spring.length_l0 * np.log1p(1.0 / spring.force_f0) + slack_l0 * float(strain(np.array(1.0)))
    # A grid of toes is fine enough: between 0.05 and 5 F0 in steps of 1 %.
    toes = np.geomspace(0.05, 5.0, 461)[:, None]
    length = whole / np.log1p(1.0 / toes)
    error = np.sum((length * np.log1p(force / toes) - both) ** 2, axis=1)
    best = int(np.argmin(error))
    return Spring(float(length[best, 0]), float(toes[best, 0]))


def series_values(fibre: Fibre, slack_l0: float, where: str) -> dict[str, float]:
    """Parameters of a series element that takes a tendon up.

    Args:
        fibre: without the tendon.
        slack_l0: slack length of the tendon, L0.
        where: begins the message.

    Raises:
        UserError: the model is rigid.
    """
    spring = spring_of(fibre)
    if spring.length_l0 == 0.0:
        raise UserError(
            f"{where}: model {fibre.model} has no series element that could take an elastic tendon up; take a model "
            "with one (3state_coop_slack, hill_se), or tendon: rigid"
        )
    both = with_tendon(spring, slack_l0)
    return {"kse": 1.0 / (both.length_l0 * fibre.values["gamma"]), "kse0": both.force_f0 / fibre.values["Fscale"]}
