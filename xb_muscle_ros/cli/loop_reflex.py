"""The stretch reflex that scenes of ``xb_muscle loop`` are asked for."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from xb_muscle_ros.errors import UserError

if TYPE_CHECKING:
    from xb_muscle_ros.plant.reflex import Reflex

_REFLEX = (
    ("length_per_l0", "PER_L0", "excitation (0 to 1) per L0 of stretch since the start"),
    ("velocity_s_per_l0", "S_PER_L0", "excitation per L0/s of lengthening"),
    ("force_per_f0", "PER_F0", "excitation per F0 of force above that of the start"),
    ("delay_s", "S", "from fibre to excitation, whole ticks (default 0.04)"),
    ("length_threshold_l0", "L0", "stretch below which length has no effect (default 0)"),
    ("velocity_threshold_l0_per_s", "L0_PER_S", "velocity below which it has no effect (default 0)"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the reflex."""
    group = parser.add_argument_group("stretch reflex; off unless one of the first three is given")
    for name, unit, meaning in _REFLEX:
        option = f"--reflex-{name.replace('_', '-')}"
        group.add_argument(option, dest=f"reflex_{name}", type=float, metavar=unit, help=meaning)
    group.add_argument(
        "--reflex-muscle", dest="reflex_muscles", metavar="NAME", action="append",
        help="name or pattern of muscles that have it (may be given again; default: all)",
    )  # fmt: skip


def reflex_of(arguments: argparse.Namespace) -> Reflex:
    """The reflex asked for; none by default.

    Raises:
        UserError: a number out of range, or a delay without a gain.
    """
    from xb_muscle_ros.plant.reflex import Reflex

    given = {name: getattr(arguments, f"reflex_{name}") for name, _, _ in _REFLEX}
    values = {name: value for name, value in given.items() if value is not None}
    muscles = tuple(arguments.reflex_muscles or ())
    reflex = Reflex(**values, muscles=muscles)
    if (values or muscles) and not reflex.works:
        raise UserError("the reflex has no gain above 0; give --reflex-length-per-l0 or another, or drop the others")
    return reflex
