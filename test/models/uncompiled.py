"""Generated code run as plain Python: what Numba compiles in ten seconds runs here at once, slowly."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from xb_muscle_ros.models.composition import Model
from xb_muscle_ros.models.muscle import GUARD, SCRATCH_ROWS
from xb_muscle_ros.symbolic import intrinsics


def _as_compiled(function: Callable[..., float], beyond: float) -> Callable[..., float]:
    """A function of `math` that gives infinity or NaN where compiled code does and Python raises."""

    def safe(*values: float) -> float:
        try:
            return function(*values)
        except OverflowError:
            return beyond
        except (ValueError, ZeroDivisionError):
            return math.nan

    return safe


_MATH = SimpleNamespace(
    **{name: _as_compiled(getattr(math, name), math.inf) for name in dir(math) if callable(getattr(math, name))},
    inf=math.inf,
    pi=math.pi,
)


def _njit(*_: Any, **__: Any) -> Callable[[Any], Any]:
    return lambda function: function


def uncompiled(model: Model, smooth: bool) -> SimpleNamespace:
    """The functions of a model's module, uncompiled.

    Raises:
        NameError: on a call, where the text names what compiled modules do not have.
    """
    text = model.module_text(smooth)
    head, _, body = text.partition("\nOK, NOT_FINITE")
    names = head.rpartition("import (")[2].partition(")")[0].replace(",", " ").split()
    scope: dict[str, Any] = {name: getattr(intrinsics, name) for name in names}
    scope |= {"math": _MATH, "np": np, "prange": range, "get_thread_id": lambda: 0}
    scope |= {"njit": _njit, "straight_line": lambda function: function}
    assert body, "the head of generated modules has changed"
    exec(compile("OK, NOT_FINITE" + body, model.name, "exec"), scope)
    return SimpleNamespace(**scope)


class Uncompiled:
    """Rest, steps and outputs of a model by its uncompiled code."""

    def __init__(self, model: Model, values: dict[str, float]) -> None:
        self.code = uncompiled(model, values["smoothing"] > 0.0)
        self.p = self.code.prepare(np.array([values[row.name] for row in model.parameters]))
        self.rows = model.parameters
        self.n = len(model.state_rows(values)) + 3
        self.names = [row.name for row in model.state_rows(values)]
        self.work = np.zeros((SCRATCH_ROWS, self.n))

    def rest(self) -> np.ndarray:
        state = np.zeros(self.n)
        self.code.rest(self.p, state)
        return state

    def step(self, state: np.ndarray, length: float, calcium: float, dt_s: float, h: float | None = None) -> np.ndarray:
        out = np.empty(self.n)
        code, fault, t, *_ = self.code.advance(
            state, length, calcium, dt_s, self.p, dt_s if h is None else h, GUARD, out, self.work
        )
        name = self.names[fault] if fault >= 0 else "no state"
        assert code == self.code.OK, f"code {code}, {name} at {t:g} s: {out}"
        return out

    def force(self, state: np.ndarray) -> float:
        out = np.zeros(len(self.code.OUTPUTS))
        self.code.outputs(state, self.p, out)
        assert np.isfinite(out).all(), out
        return float(out[0])
