"""Text of the module that steps a model on a strain grid: scalar functions from the blocks, loops over bins.

The strain dependence of every rate is tabulated once per parameter set: exp(slope x) at x = X_i + c is the table's
entry times exp(slope c), so that a step calls no exponential per bin, wherever the grid has moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import sympy

from xb_muscle_ros.mechanisms import ExponentialRate, StepRate
from xb_muscle_ros.models.codegen import compiled_text, computed, function, header, kernels, used_symbols, vector
from xb_muscle_ros.models.composition import INPUTS, Composition
from xb_muscle_ros.models.grid_equations import SUMS, GridEquations, grid_equations
from xb_muscle_ros.models.program import program, python
from xb_muscle_ros.stepping import rosenbrock2


def grid_module(model: Composition, smooth: bool, remap: str) -> str:
    """Text of the module.

    Args:
        model: a composition on a grid.
        smooth: with the released sets' smooth functions.
        remap: what brings the bins back after a step: ``roll``, ``linear`` or ``conservative``.
    """
    e = grid_equations(model, smooth)
    index = {p.name: i for i, p in enumerate(e.parameters)}
    constants = (
        f"GAMMA, ERROR_SHARE = {rosenbrock2.GAMMA!r}, {rosenbrock2.ERROR_SHARE!r}\n"
        f"N_OTHERS, N_PARAMETERS, N_RATES = {len(e.states)}, {len(e.parameters)}, {len(e.leaving)}\n"
        f"TEARS = {any(torn for _, torn in e.leaving)!r}\n"
        f"TORN = {_torn_state(e)!r}\n"
        f"IS_STEP = {tuple(isinstance(rate, StepRate) for rate, _ in e.leaving)!r}\n"
        f"BINS, RANGE, REGRID = {index['bins']}, {index['strain_range']}, {index.get('regrid', -1)}\n"
    )
    head = header(model, smooth, rosenbrock2.ORDER, interpolated=False)
    parts = [head + constants, _rate_constants(e), _factors(e), _spreads(e), _leave(e)]
    parts += [_others(e), _couplings(e), vector("rest_of_others", e.parameters, e.rest), _output_scalars(e), _bounds(e)]
    parts.append(_kernels(remap))
    return "\n\n".join(parts) + "\n\n\n" + kernels() + "\n"


def _scalar_function(e: GridEquations, head: str, doc: str, results: Sequence[Any], sums: Sequence[str] = ()) -> str:
    """A function of sums, states y (a tuple), inputs and parameters that returns a tuple."""
    body = program([sympy.sympify(r) for r in results], "t")
    used = {str(s) for s in used_symbols(body)}
    lines = [f"{s.name} = y[{i}]" for i, s in enumerate(e.states) if s.name in used]
    lines += computed(e.parameters, body)
    values = [python(r) for r in body.results]
    lines.append(f"return ({', '.join(v if '.' in v or not v.lstrip('-').isdigit() else v + '.0' for v in values)},)")
    arguments = [*sums, "y", *(i.name for i in INPUTS), "p"]
    return function(f"{head}({', '.join(arguments)})", doc, lines)


def _rate_constants(e: GridEquations) -> str:
    """Slope of the exponential in each rate's table; for a step, of the exponential inside its tanh."""
    slopes = [r.slope if isinstance(r, ExponentialRate) else -2 * r.steepness for r, _ in e.leaving]
    body = program([sympy.sympify(s) for s in slopes], "t")
    results = ", ".join(f"float({python(r)})" for r in body.results)
    lines = [*computed(e.parameters, body), f"return ({results},)"]
    return function("table_slopes(p)", "Slope of each rate's tabulated exponential, per power stroke.", lines)


def _factors(e: GridEquations) -> str:
    """Two numbers for each rate at a shift of the grid: of an exponential its factor, of a step height and factor."""
    shift = sympy.Symbol("shift", real=True)
    results: list[Any] = []
    for rate, _ in e.leaving:
        if isinstance(rate, ExponentialRate):
            results += [rate.scale * sympy.exp(rate.slope * shift), 0]
        else:
            results += [rate.height, sympy.exp(-2 * rate.steepness * (shift - rate.threshold))]
    doc = "Factors of the rates at a shift of the grid."
    return _scalar_function(e, "factors", doc, results, ["q0", "q1", "q2", "shift"])


def _spreads(e: GridEquations) -> str:
    """Heads per second and width of each way to attach, the first from the ready state."""
    results = [x for spread in (e.ways.attach, *e.ways.reattach) for x in (spread.rate, spread.width)]
    return _scalar_function(e, "spreads", "Rate and width of each way to attach.", results, ["q0", "q1", "q2"])


def _leave(e: GridEquations) -> str:
    """Detachment rates of one bin: to the ready state and torn off."""
    back: list[str] = []
    torn: list[str] = []
    for i, (rate, is_torn) in enumerate(e.leaving):
        table = f"p[table + {i} * bins + i]"
        if isinstance(rate, ExponentialRate):
            term = f"c[{2 * i}] * {table}"
        else:
            # height (1 + tanh(s (x - x_c)))/2 = height / (1 + exp(-2 s (x - x_c)))
            term = f"c[{2 * i}] / (1.0 + c[{2 * i + 1}] * {table})"
        (torn if is_torn else back).append(term)
    text = []
    for name, terms, doc in (
        ("leaving", back, "Rate at which heads of bin i detach to the ready state."),
        ("tearing_off", torn, "Rate at which heads of bin i are torn off."),
    ):
        text.append(function(f"{name}(c, table, bins, i, p)", doc, [f"return {' + '.join(terms) or '0.0'}"]))
    return "\n\n".join(text)


def _others(e: GridEquations) -> str:
    doc = "Rates of change of the states beside the bins, then of the shift."
    return _scalar_function(e, "others", doc, e.derivatives, SUMS)


def _torn_state(e: GridEquations) -> int:
    """Index of the state whose heads come back to the bins, -1 for none.

    Raises:
        ValueError: there is more than one, which the step has no elimination for.
    """
    if not e.ways.reattach:
        return -1
    names = [s.name for s in e.states]
    found = [n for n in names if sympy.diff(e.ways.reattach[0].rate, e.symbols[n]) != 0]
    if len(e.ways.reattach) > 1 or len(found) != 1:
        raise ValueError(f"heads come back to a grid from one state only, not from {', '.join(found) or 'none'}")
    return names.index(found[0])


def _couplings(e: GridEquations) -> str:
    """How rates of the other states follow the sums of fluxes, and their own states: parts of the Jacobian."""
    results: list[Any] = []
    for i, d in enumerate(e.derivatives):
        results += [sympy.diff(d, e.symbols[name]) for name in ("kin0", "kin1", "kin2", "torn_off")]
        # Only decay goes on the implicit matrix: growth (thin-filament cooperativity) is left to the error control.
        own = sympy.diff(d, e.symbols[e.states[i].name]) if i < len(e.states) else 0
        results += [own, sympy.diff(d, e.symbols["reattached"])]
    torn = _torn_state(e)
    comes_back = sympy.diff(e.ways.reattach[0].rate, e.symbols[e.states[torn].name]) if torn >= 0 else 0
    results.append(comes_back)
    doc = (
        "Derivatives of each rate by kin0, kin1, kin2, torn-off heads, its own state, returning heads; rate of return."
    )
    return _scalar_function(e, "couplings", doc, results, SUMS)


def _output_scalars(e: GridEquations) -> str:
    return _scalar_function(e, "output_scalars", "Values of OUTPUTS.", e.outputs, SUMS)


def _bounds(e: GridEquations) -> str:
    lines = []
    for i, s in enumerate(e.states):
        lines += [f"if not ({s.lower!r} - slack <= s[bins + {i}] <= {s.upper!r} + slack):", f"    return bins + {i}"]
    doc = "First of the states beside the bins that is out of bounds, else -1."
    return function("others_violation(s, bins, slack)", doc, [*lines, "return -1"])


def _kernels(remap: str) -> str:
    """The loops over bins, with one of the remappings under the name `regrid`."""
    from xb_muscle_ros.stepping import grid_kernels, grid_remap

    text = compiled_text(Path(grid_kernels.__file__)) + "\n\n\n" + compiled_text(Path(grid_remap.__file__))
    return text + f"\n\nregrid = {remap}\n"
