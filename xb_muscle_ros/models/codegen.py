"""From equations to the text of a Python module that Numba compiles: one flat right-hand side, one flat step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import sympy

from xb_muscle_ros.mechanisms import Parameter
from xb_muscle_ros.models.composition import INPUTS, OUTPUTS, Equations, Model
from xb_muscle_ros.models.elimination import Elimination
from xb_muscle_ros.models.factoring import replaced
from xb_muscle_ros.models.program import Program, jacobian, program, python
from xb_muscle_ros.stepping import rosenbrock3
from xb_muscle_ros.symbolic.symbols import CALLS

_HEADER = '''"""Generated from the mechanisms of model {name}{smooth}; do not edit."""

import math

import numpy as np
from numba import get_thread_id, njit, prange

from xb_muscle_ros.symbolic.intrinsics import (
    {intrinsics},
)
from xb_muscle_ros.models.straight_line import straight_line
'''
# How wrong a moment may be relative to the heads attached, as a multiple of the tolerance: 1/0.01.
_SHARE_OF_HEADS = 0.01
# Inlined, because a call hands over each array in seven pieces: that took a quarter of a step.
_JIT = '@njit(cache=True, error_model="numpy", forceinline=True)'


def header(model: Model, smooth: bool, order: int, interpolated: bool) -> str:
    """Head of a generated module: imports, and the constants that the loops of `stepping.kernels` use."""
    kind = " with smooth functions" if smooth else ""
    head = _HEADER.format(name=model.name, smooth=kind, intrinsics=", ".join(sorted(CALLS.values())))
    constants = [
        "OK, NOT_FINITE, OUT_OF_BOUNDS, TOO_MANY_STEPS = 0, 1, 2, 3",
        "MAX_ATTEMPTS = 20000",
        f"EXPONENT = {1.0 / order!r}",
        f"SMALL_ERROR = {(0.9 / 5.0) ** order!r}",
        f"INTERPOLATED = {interpolated}",
        f"ORDER = {order}",
        f"OUTPUTS = {OUTPUTS!r}",
    ]
    return "\n".join([head, "", *constants, ""])


def flat_module(model: Model, smooth: bool) -> str:
    """A model whose every state is a symbol: one flat right-hand side, one flat Rosenbrock step."""
    e = model.equations(smooth)
    shared = program(all_rates(e), "t")
    prepare = function("prepare(p)", "Parameters and what is computed from them once.", ["return p.copy()"])
    stay = function("regrid(s, p, work)", "Moments need no grid.", ["pass"])
    parts = [
        header(model, smooth, rosenbrock3.ORDER, interpolated=True),
        prepare,
        stay,
        _rhs(e, shared),
        _attempt(e, shared),
    ]
    parts += [_slope(e), vector("rest", e.parameters, e.rest), _outputs(e), _violation(e, smooth)]
    return "\n\n".join(parts) + "\n\n\n" + kernels() + "\n"


def moving(e: Equations) -> list[str]:
    """What moves within a step beside the states: the shift, and the length change where rates depend on it."""
    return ["shift", "length_change"] if e.follows_length else ["shift"]


def all_rates(e: Equations) -> Sequence[Any]:
    """Rates of the states and of what moves beside them."""
    return e.derivatives if e.follows_length else e.derivatives[:-1]


def function(head: str, doc: str, lines: Iterable[str]) -> str:
    """Text of a compiled function."""
    return f"{_JIT}\n{_plain(head, doc, lines)}"


def straight(head: str, doc: str, lines: Iterable[str]) -> str:
    """Text of a compiled function without branches, which `straight_line` compiles in a fraction of Numba's time."""
    name, _, arguments = head.partition("(")
    body = _plain(f"{name}_lines({arguments}", doc, lines)
    return f"@straight_line\n{body}\n\n{function(head, doc, [f'return {name}_lines({arguments}'])}"


def _plain(head: str, doc: str, lines: Iterable[str]) -> str:
    body = "\n".join(f"    {line}" for line in lines)
    return f'def {head}:\n    """{doc}"""\n{body}\n'


def computed(parameters: Sequence[Parameter], *bodies: Program) -> list[str]:
    """Lines that load the parameters that some programs use, and lines of the first of them."""
    names = {str(s) for s in used_symbols(*bodies)}
    loads = [f"{p.name} = p[{i}]" for i, p in enumerate(parameters) if p.name in names]
    return [*loads, *(f"{symbol} = {python(expression)}" for symbol, expression in bodies[0].lines)]


def filled(results: Iterable[Any]) -> list[str]:
    """Lines that put results into the vector ``out``."""
    return [f"out[{i}] = {python(r)}" for i, r in enumerate(results)]


def _states(e: Equations) -> list[str]:
    """Lines that load the states, and the length change where rates depend on it."""
    lines = [f"{s.name} = s[{i}]" for i, s in enumerate(e.states)]
    return [*lines, f"length_change = s[{len(e.states)}]"] if e.follows_length else lines


def used_symbols(*programs: Program) -> set[Any]:
    """All symbols of some programs."""
    parts = [part for body in programs for part in (*(line for _, line in body.lines), *body.results)]
    return set().union(*(part.free_symbols for part in parts))


def _rhs(e: Equations, body: Program) -> str:
    """Rates of change in the fixed frame, scalars in and a tuple out: nothing touches memory."""
    names = ", ".join([*(s.name for s in e.states), *moving(e)])
    lines = [*computed(e.parameters, body), f"return ({', '.join(python(r) for r in body.results)},)"]
    # Called by straight lines only, which take it in.
    text = _plain(f"rates({names}, velocity, calcium, p)", "Rates of the states and of the shift.", lines)
    size = len(all_rates(e))
    call = [f"r = rates({', '.join(f'z[{i}]' for i in range(size))}, velocity, calcium, p)"]
    call += [f"out[{i}] = r[{i}]" for i in range(size)]
    doc = f"The same on arrays; z ends in {' and '.join(moving(e))}."
    return text + "\n\n" + straight("rhs(z, velocity, calcium, p, out)", doc, call)


def _attempt(e: Equations, body: Program) -> str:
    """One Rosenbrock step, written out."""
    names = [*(s.name for s in e.states), *moving(e)]
    variables = [*(e.symbols[s.name] for s in e.states), e.shift, e.symbols["length_change"]][: len(names)]
    starts = ["0.0" if name == "shift" else name for name in names]
    n = len(names)
    both, rows = jacobian(body, variables, "d")
    # The frame is fixed at the start of the step, so the Jacobian is wanted where the shift is zero.
    flat = Program(both.lines, [*both.results, *(x for row in rows for x in row)])
    flat = flat.substituted({e.shift: sympy.Integer(0)}).needed()
    first, entries = flat.results[:n], flat.results[n:]
    solver = Elimination([[entries[i * n + j] != 0 for j in range(n)] for i in range(n)])
    lines = [*_states(e), *computed(e.parameters, flat)]
    lines += ["per_h = 1.0 / h", f"diagonal = per_h * {1.0 / rosenbrock3.GAMMA!r}"]
    for i, j in solver.entries():
        entry = entries[i * n + j]
        value = "" if entry == 0 else f" - ({python(entry)})"
        lines.append(f"a_{i}_{j} = {'diagonal' if i == j else '0.0'}{value}")
    lines += solver.factor("a")
    lines += [f"f0_{i} = {python(r)}" for i, r in enumerate(first)]
    values, last_point = [f"f0_{i}" for i in range(n)], list[str]()
    for stage in range(len(rosenbrock3.A)):
        k = f"k{stage}"
        point = [_sum([starts[i]], rosenbrock3.A[stage], i) for i in range(n)]
        if stage > 0 and point != last_point:
            lines.append(f"f{stage} = rates({', '.join(point)}, velocity, calcium, p)")
            values = [f"f{stage}[{i}]" for i in range(n)]
        last_point = point
        for i in range(n):
            memory = _sum([], rosenbrock3.C[stage], i)
            lines.append(f"{k}_{i} = {values[i]}" + (f" + per_h * ({memory})" if memory else ""))
        lines += solver.solve("a", k)
    lines += [f"e_{i} = {_sum([], rosenbrock3.E, i)}" for i in range(n)]
    lines += [f"y_{i} = {_sum([starts[i]], rosenbrock3.M, i)}" for i in range(n)]
    swap = {symbol: sympy.Symbol(f"y_{i}", real=True) for i, symbol in enumerate(variables)}
    arrival = program([replaced(x, swap) for x in e.arrival], "m")
    lines += [*computed((), arrival), *filled(arrival.results)]
    # Relative for large moments, absolute otherwise: forces and fractions are of order one.
    lines += ["error = 0.0"]
    for i in range(n):
        lines.append(f"error = max(error, abs(e_{i}) / (1.0 + abs(y_{i})))")
    if e.shares:
        # With few heads attached their mean strain and its variance are quotients of small numbers: an error that is
        # nothing to the force could still make the variance negative, and with it the detachment rates nonsense.
        lines.append(f"share = {_SHARE_OF_HEADS!r} / (abs(y_{names.index(e.shares[0])}) + 1e-6)")
        lines += [f"error = max(error, abs(e_{names.index(name)}) * share)" for name in e.shares]
    lines += ["return error if error == error else math.inf"]
    doc = "One Rosenbrock step of h seconds; returns the largest embedded error."
    return straight("attempt(s, h, velocity, calcium, p, out, work)", doc, lines)


def _sum(start: list[str], weights: Iterable[float], i: int) -> str:
    """Terms ``w_j k_j_i`` behind some others."""
    terms = list(start) if start != ["0.0"] else []
    for j, w in enumerate(weights):
        if w == 1.0:
            terms.append(f"k{j}_{i}")
        elif w != 0.0:
            terms.append(f"{w!r} * k{j}_{i}")
    return " + ".join(terms) if terms or not start else "0.0"


def moving_rates(e: Equations) -> list[Any]:
    """Rates of the states in the frame that moves along: dx/dt = d arrival/d(state, shift) . rates, at zero shift."""
    variables = [*(e.symbols[s.name] for s in e.states), e.shift]
    rates = e.derivatives[:-1]
    moving = []
    for x in e.arrival:
        total = sum(sympy.diff(x, v) * r for v, r in zip(variables, rates, strict=True) if v in x.free_symbols)
        moving.append(replaced(sympy.sympify(total), {e.shift: sympy.Integer(0)}))
    return moving


def _slope(e: Equations) -> str:
    """Rates of change, for interpolation and to tell whether a fibre is at rest."""
    body = program(moving_rates(e), "t")
    lines = [*_states(e), *computed(e.parameters, body), *filled(body.results)]
    return straight("slope(s, velocity, calcium, p, out)", "Rates of change of the integrated states.", lines)


def _outputs(e: Equations) -> str:
    body = program(e.outputs, "t")
    lines = [f"{s.name} = s[{i}]" for i, s in enumerate((*e.states, *INPUTS))]
    lines += [*computed(e.parameters, body), *filled(body.results)]
    return straight("outputs(s, p, out)", "Forces, contractile element and states, as named in OUTPUTS.", lines)


def vector(name: str, parameters: Sequence[Parameter], expressions: Iterable[Any]) -> str:
    """Text of a function of the parameters that fills a vector."""
    body = program(list(expressions), "t")
    lines = [*computed(parameters, body), *filled(body.results)]
    return straight(f"{name}(p, out)", "State of a fibre at rest without calcium.", lines)


def _violation(e: Equations, smooth: bool) -> str:
    """Bounds of the states; the smooth functions of the released sets widen those that they blur."""
    index = [p.name for p in e.parameters].index("smoothing")
    lines = []
    for i, s in enumerate(e.states):
        room = f"slack + {s.blur!r} / p[{index}]" if smooth and s.blur else "slack"
        # Written so that a NaN fails the comparison.
        lines += [f"room = {room}", f"if not ({s.lower!r} - room <= s[{i}] <= {s.upper!r} + room):", f"    return {i}"]
    doc = "First state out of bounds by more than slack, else -1."
    return function("violation(s, p, slack)", doc, [*lines, "return -1"])


def kernels() -> str:
    """The loops of `stepping.kernels` and `stepping.clamp_kernels`, decorated."""
    from xb_muscle_ros.stepping import clamp_kernels
    from xb_muscle_ros.stepping import kernels as loops

    return "\n\n\n".join(compiled_text(Path(file)) for file in (loops.__file__, clamp_kernels.__file__))


def compiled_text(path: Path) -> str:
    """Functions of a module of kernels, without their types and with Numba's decorator."""
    text = path.read_text(encoding="utf-8").split("# BEGIN COMPILED\n", 1)[1]
    for types in (": Array", ": float", ": int", ": Any", " -> Any", " -> None", " -> float", " -> int"):
        text = text.replace(types, "")
    text = f"\n{text}".replace("\ndef ", f"\n{_JIT}\ndef ")
    return text.replace(f"# PARALLEL\n{_JIT}", _JIT.replace("(", "(parallel=True, ", 1)).strip()
