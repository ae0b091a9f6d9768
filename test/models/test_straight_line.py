"""Straight lines handed to LLVM against the same text compiled by Numba."""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numba import njit

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.registry import compose
from xb_muscle_ros.models.straight_line import straight_line

_FUNCTIONS = '''
import math
from xb_muscle_ros.symbolic.intrinsics import limited

def both(x, y, p):
    """A pair."""
    z = x / y - p[1]
    return (z, -z * 1/3)

def every_kind(s, x, p, out):
    """All that a straight line may contain."""
    a = s[0]
    r = both(a, x, p)
    b = r[0]**(3/2) + 2*r[1]
    a = math.exp(-a) + limited(40*x) - (b)
    e = max(a, abs(b))
    out[0] = a
    out[1] = 1
    out[2] = e**p[0]
    return e if e == e else math.inf

def loops(s, x, p, out):
    for i in range(3):
        out[i] = x
'''


def _module(folder: Path, text: str, name: str) -> ModuleType:
    file = folder / f"{name}.py"
    file.write_text(text)
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _called(lines: Any) -> Any:
    @njit(error_model="numpy")
    def call(s: Any, x: float, p: Any, out: Any) -> float:
        return lines(s, x, p, out)

    return call


@pytest.mark.slow
@pytest.mark.parametrize("s", [np.array([0.3]), np.array([[0.7, 9.0], [1.1, 9.0]])[:, 0], np.array([2])])
@pytest.mark.parametrize("x", [0.25, 7, -0.4, math.nan])
def test_every_construct_is_what_numba_makes_of_it(tmp_path: Path, s: np.ndarray, x: float) -> None:
    module: Any = _module(tmp_path, _FUNCTIONS, "straight_line_functions")
    p = np.array([1.7, -0.2])
    ours, theirs = np.zeros(3), np.zeros(3)
    straight = _called(straight_line(module.every_kind))(s, x, p, ours)
    module.both = njit(error_model="numpy")(module.both)
    plain = njit(error_model="numpy")(module.every_kind)(s, x, p, theirs)
    np.testing.assert_array_equal(ours, theirs)
    assert straight == plain


def test_what_is_no_straight_line_is_refused_by_name(tmp_path: Path) -> None:
    module: Any = _module(tmp_path, _FUNCTIONS, "straight_line_functions")
    with pytest.raises(NotImplementedError, match="loops: 'for i in range"):
        _called(straight_line(module.loops))(np.zeros(1), 0.5, np.zeros(2), np.zeros(3))


@pytest.mark.slow
def test_a_models_steps_are_what_numba_makes_of_them(tmp_path: Path) -> None:
    """The same text, once with straight lines for LLVM and once all for Numba: every state and output to the bit."""
    composition = compose("3state_coop")
    text = composition.module_text(False).replace("cache=True, ", "")
    plain = text.replace("@straight_line", "@njit(error_model='numpy')").replace("\ndef rates(", "\n@njit\ndef rates(")
    values = load_fibre("18Dec2017a").values | {"smoothing": 0.0}
    p = np.array([values[row.name] for row in composition.parameters])
    found = []
    for name, source in (("model_of_lines", text), ("model_of_numba", plain)):
        code: Any = _module(tmp_path, source, name)
        n = len(composition.state_rows(values)) + 3
        state, work = np.zeros(n), np.zeros((14, n))
        code.rest(p, state)
        states, table = np.zeros((200, n)), np.zeros((200, len(code.OUTPUTS)))
        length = 0.01 * np.sin(np.arange(200) / 20.0)
        code.run(state, np.full(199, 1e-3), length, np.full(200, 3.0), p, 1e-4, 1, 1, states, work)
        code.outputs_of(states, p, table)
        found.append(np.hstack([states, table]))
    assert found[0][-1, 0] > 0.01, "no head attached: nothing was tested"
    np.testing.assert_array_equal(found[0], found[1])
