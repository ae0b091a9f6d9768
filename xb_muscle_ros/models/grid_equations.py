"""The scalar part of a model on a strain grid: everything but the sums over bins."""

from __future__ import annotations

from dataclasses import dataclass

import sympy

from xb_muscle_ros.distribution.base import Ways
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.mechanisms import ExponentialRate, Quantities, StrainRate
from xb_muscle_ros.models.assembly import rates, rest_of_states
from xb_muscle_ros.models.composition import Composition, Written

SUMS = ("q0", "q1", "q2", "kin0", "kin1", "kin2", "torn_off", "reattached")


@dataclass(frozen=True, kw_only=True)
class GridEquations(Written):
    """A model on a grid: states are those beside the bins, symbols are also those of `SUMS`.

    Attributes:
        ways: how heads come and go.
    """

    ways: Ways

    @property
    def leaving(self) -> tuple[tuple[StrainRate, bool], ...]:
        """All rates at which heads leave, with whether they are torn off."""
        return (*((rate, False) for rate in self.ways.detach), *((rate, True) for rate in self.ways.tear))


def grid_equations(model: Composition, smooth: bool) -> GridEquations:
    """Write a composition on a grid out.

    Raises:
        AttributeError: a block asks for a quantity that no block provides.
        UserError: a strain dependence whose shape changes with the state, which a grid's tables cannot follow.
    """
    symbols = model.symbols(*SUMS)
    q = Quantities(symbols, "composition", symbols["smoothing"] if smooth else None)
    parts = rates(model, q)
    fixed = {symbols[p.name] for p in model.parameters}
    for rate in (*parts.ways.detach, *parts.ways.tear):
        shape = (rate.slope,) if isinstance(rate, ExponentialRate) else (rate.threshold, rate.steepness)
        for expression in shape:
            if sympy.sympify(expression).free_symbols - fixed:
                raise UserError(
                    f"model {model.name}: strain dependence {expression} must depend on parameters alone on a strain "
                    "grid; take method gaussian"
                )
    return GridEquations(
        states=model.states,
        parameters=model.parameters,
        symbols=symbols,
        ways=parts.ways,
        derivatives=[*(parts.others[s.name] for s in model.states), parts.own_velocity],
        rest=rest_of_states(model, symbols),
        outputs=parts.outputs,
    )
