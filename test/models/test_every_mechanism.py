"""Every mechanism with every released set and every method, smoothing on and off: the generated code runs.

Compiled, these 200 models would take an hour; as plain Python the Gaussian form takes a second or two each, most of it
SymPy's (five with two half-sarcomeres), a strain grid a tenth of that. What Numba makes of the same text is tested
for one model each with `test_mechanisms` and `test_contract`.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping

import numpy as np
import pytest
from mechanism_effects import EFFECT
from uncompiled import Uncompiled

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.parameters import complete
from xb_muscle_ros.models.registry import EXTRAS, METHODS, SWAPS, compose, split_set, with_mechanisms

FIBRE = "18Dec2017a"
RELEASED = ("2state", "3state_coop", "4state_coop", "hill_se")
SMOOTHING = 100.0
LENGTHS = "+active_force_length+passive_force_length"
GRIDS = tuple(method for method in METHODS if method != "gaussian")


def _goes(name: str) -> bool:
    try:
        split_set(name)
    except UserError:
        return False
    return True


def _with(base: str, mechanism: str) -> str:
    """The base with a mechanism, or its slack form where that alone has what the mechanism needs."""
    name = with_mechanisms(base, mechanism)
    return name if mechanism in SWAPS or _goes(name) else with_mechanisms(f"{base}_slack", mechanism)


MODELS = [
    name
    for base in RELEASED
    for name in (base, f"{base}_slack", *(_with(base, mechanism) for mechanism in (*EXTRAS, *SWAPS)))
    if _goes(name)
]
# Relations that belong together, on either kind of series element that they go with.
MODELS += [f"{base}{kind}{LENGTHS}" for base in RELEASED if base != "hill_se" for kind in ("_slack", "_rigid")]
MODELS += [f"{name}{LENGTHS}" for name in ("hill", "hill_se")]
HEADS = [name for name in MODELS if not name.startswith("hill")]
CASES = [(name, "gaussian", smoothing) for name in MODELS for smoothing in (0.0, SMOOTHING)]
CASES += [(name, "characteristics", smoothing) for name in HEADS for smoothing in (0.0, SMOOTHING)]


@functools.cache
def _all_released() -> Mapping[str, float]:
    """What a swapped block needs beyond the set of its model."""
    return {key: value for name in RELEASED for key, value in load_fibre(FIBRE, name).values.items()}


def values_of(name: str, method: str, smoothing: float, released: str = "") -> dict[str, float]:
    base, _, mechanism = name.partition("+")
    own = load_fibre(FIBRE, released or base, method).values
    given = {**_all_released(), **own, **EFFECT.get(mechanism, {}), "smoothing": smoothing, "bins": 60.0}
    wanted = {row.name for row in compose(name, method).parameters}
    return complete({key: value for key, value in given.items() if key in wanted}, name, "test", method)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method", "smoothing"), CASES, ids=str)
def test_generated_code_steps_through_a_quick_release(name: str, method: str, smoothing: float) -> None:
    values = values_of(name, method, smoothing)
    fibre = Uncompiled(compose(name, method), values)
    if name == "3state_coop" and smoothing:
        # The same code, with the other released set.
        fibre.p = fibre.code.prepare(
            np.array([values_of(name, method, smoothing, f"{name}_v3")[row.name] for row in fibre.rows])
        )
    state = fibre.rest()
    for _ in range(10):
        state = fibre.step(state, 0.0, 1.0, 5e-3)
    assert 0.01 < fibre.force(state) < 2.0
    rates = np.zeros(fibre.n - 3)
    fibre.code.slope(state, 0.0, 1.0, fibre.p, rates)
    assert np.isfinite(rates).all()
    lowest = np.inf
    for length in (-0.1, -0.2, -0.2, -0.2, -0.1, 0.0, 0.0):
        state = fibre.step(state, length, 1.0, 1e-3)
        lowest = min(lowest, fibre.force(state))
    if "slack" in name:
        assert lowest >= 0.0
    assert lowest < 0.2


# Two half-sarcomeres take SymPy five seconds a text.
@pytest.mark.parametrize("name", [name for name in HEADS if "half_sarcomere" not in name])
def test_strain_grids_differ_in_their_remap_alone(name: str) -> None:
    """What holds for the code of one of them holds for all: `test_contract` compiles each with the bare models."""

    def body(method: str) -> list[str]:
        lines = compose(name, method).module_text(True).splitlines()
        return [line for line in lines if not line.startswith(('"""Generated', "regrid = ", "N_OTHERS", "BINS"))]

    bodies = [body(method) for method in GRIDS]
    assert len(bodies[0]) > 300
    assert all(other == bodies[0] for other in bodies[1:])
