"""Equations of models evaluated as they stand, for any of the registry's within a second: nothing is compiled."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.mechanisms import InSeries
from xb_muscle_ros.models.composition import INPUTS, OUTPUTS, Equations
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.program import python
from xb_muscle_ros.models.registry import compose, model_of_set
from xb_muscle_ros.symbolic import intrinsics

_SCOPE = {"math": math, **vars(intrinsics)}


class Written(NamedTuple):
    """A model at one state.

    Attributes:
        rates: of its states by name.
        outputs: by name.
    """

    rates: dict[str, float]
    outputs: dict[str, float]


@functools.cache
def _equations(model: str, method: str) -> tuple[Equations, Any, Any]:
    e = compose(model_of_set(model), method).equations(False)
    names = [str(symbol) for symbol in e.symbols.values()]
    head = f"lambda {', '.join([*names, str(e.shift)])}: "

    def function(expressions: Any) -> Any:
        return eval(head + "[" + ", ".join(python(x) for x in expressions) + "]", dict(_SCOPE))

    return e, function([*e.derivatives, *e.outputs]), function(e.rest)


def evaluated(fibre: Fibre, state: Mapping[str, float]) -> Written:
    """A fibre's model at a state: names that it has not are passed over, names that are missing are as at rest."""
    e, rates, rest = _equations(fibre.model, fibre.method)
    none = {row.name: 0.0 for row in (*e.states, *INPUTS)}
    known = {**none, **fibre.values}
    at_rest = rest(*(known[n] for n in e.symbols), 0.0)
    known |= dict(zip((row.name for row in e.states), at_rest, strict=True))
    known |= {name: value for name, value in state.items() if name in none}
    found = [float(x) for x in rates(*(known[n] for n in e.symbols), 0.0)]
    count = len(e.derivatives)
    names = [*(row.name for row in e.states), "shift", "length_change"]
    return Written(dict(zip(names, found[:count], strict=True)), dict(zip(OUTPUTS, found[count:], strict=True)))


def some_states(fibre: Fibre, count: int, seed: int = 0) -> list[dict[str, float]]:
    """States within what a fibre may be in, with inputs; of all states that its model has."""
    e, _, _ = _equations(fibre.model, fibre.method)
    random = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        attached = float(random.uniform(0.05, 0.5))
        mean, sd = float(random.uniform(-0.4, 0.6)), float(random.uniform(0.2, 0.8))
        own = {"q0": attached, "q1": attached * mean, "q2": attached * (sd**2 + mean**2)}
        state = {row.name: own.get(row.name, float(random.uniform(0.0, 0.25))) for row in e.states}
        state |= {"n_on": float(random.uniform(attached, 1.0))} if "n_on" in state else {}
        found.append(
            {
                **state,
                "length_change": float(random.uniform(-0.03, 0.06)),
                "velocity": float(random.uniform(-0.5, 0.5)),
                "calcium": float(10.0 ** random.uniform(-1.0, 1.5)),
            }
        )
    return found


def with_ready_heads(state: Mapping[str, float]) -> dict[str, float]:
    """A state with the heads that are ready where nothing puts any to rest: all that are not attached or torn off.

    Those of the half-sarcomere in series as well.
    """
    ready = {
        f"{of}drx": 1.0 - state.get(f"{of}q0", 0.0) - state.get(f"{of}r", 0.0)
        for of in ("", InSeries.PREFIX)
        if f"{of}q0" in state
    }
    return {**ready, **state}
