"""Generated code against the blocks it was made of, and the pieces that make it."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from xb_muscle_ros.bench.c_code import c_text
from xb_muscle_ros.errors import StateViolation
from xb_muscle_ros.models.assembly import equations
from xb_muscle_ros.models.elimination import Elimination
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.program import jacobian, program
from xb_muscle_ros.models.registry import compose


@pytest.fixture(scope="module")
def muscle() -> Muscle:
    return Muscle(load_fibre("18Dec2017a"))


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 8), density=st.floats(0.0, 1.0))
def test_elimination_solves(seed: int, size: int, density: float) -> None:
    rng = np.random.default_rng(seed)
    pattern = rng.random((size, size)) < density
    matrix = np.where(pattern, rng.normal(size=(size, size)), 0.0) + np.diag(np.full(size, 2.0 * size))
    wanted = rng.normal(size=size)
    right = matrix @ wanted
    solver = Elimination(pattern.tolist())
    names: dict[str, float] = {f"a_{i}_{j}": float(matrix[i, j]) for i, j in solver.entries()}
    names |= {f"x_{i}": float(right[i]) for i in range(size)}
    exec("\n".join([*solver.factor("a"), *solver.solve("a", "x")]), {}, names)
    np.testing.assert_allclose([names[f"x_{i}"] for i in range(size)], wanted, atol=1e-9)


def test_jacobian_by_lines_is_the_derivative() -> None:
    x, y = sympy.symbols("x y", real=True)
    expressions = [sympy.exp(x * y) * sympy.tanh(x) + y, sympy.exp(x * y) ** 2 / (1 + x**2)]
    body, rows = jacobian(program(expressions, "t"), [x, y], "d")
    at = {x: 0.3, y: -0.7}
    for symbol, expression in body.lines:
        at[symbol] = float(expression.subs(at))
    for expression, row in zip(expressions, rows, strict=True):
        for variable, slope in zip((x, y), row, strict=True):
            exact = float(sympy.diff(expression, variable).subs({x: 0.3, y: -0.7}))
            assert float(slope.subs(at)) == pytest.approx(exact, rel=1e-12)


@pytest.mark.slow
@given(z=arrays(float, 6, elements=st.floats(0.01, 0.9)), velocity=st.floats(-2.0, 2.0), calcium=st.floats(0.001, 32.0))
def test_compiled_right_hand_side_is_the_blocks_own(
    muscle: Muscle, z: np.ndarray, velocity: float, calcium: float
) -> None:
    """The blocks' formulas, evaluated by SymPy's own arithmetic, against the compiled function."""
    e = equations(compose("3state_coop"), True)
    values = {e.symbols[s.name]: z[i] for i, s in enumerate(e.states)}
    values |= {e.symbols[name]: value for name, value in muscle.fibre.values.items()}
    values |= {e.shift: z[5], e.symbols["velocity"]: velocity, e.symbols["calcium"]: calcium}
    from xb_muscle_ros.mechanisms import ops
    from xb_muscle_ros.symbolic.symbols import Decay, HyperbolicTangent, Logistic, Positive, Softplus

    ours = np.zeros(6)
    muscle.code.rhs(z, velocity, calcium, muscle.parameters, ours)
    plain = [
        {
            "Decay": lambda v, k: 0.0,
            "Softplus": lambda v, k, _: ops.softplus(v, k),
            "Logistic": lambda v, k, _: 1.0 / (1.0 + np.exp(-k * v)),
            "Positive": ops.positive,
            "HyperbolicTangent": np.tanh,
        },
        "math",
    ]
    assert {f.__name__ for f in (Decay, Softplus, Positive, Logistic, HyperbolicTangent)} == set(plain[0])
    symbols = list(values)
    theirs = sympy.lambdify(symbols, e.derivatives[:-1], plain)(*(float(v) for v in values.values()))
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * max(1.0, float(np.abs(theirs).max())))


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler on this machine")
def test_c_text_computes_the_same(muscle: Muscle, tmp_path: Path) -> None:
    (tmp_path / "rhs.c").write_text(c_text(compose("3state_coop"), True))
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", tmp_path / "rhs.so", tmp_path / "rhs.c", "-lm"], check=True)
    library = ctypes.CDLL(str(tmp_path / "rhs.so"))
    pointer = ctypes.POINTER(ctypes.c_double)
    library.rhs.argtypes = [pointer, ctypes.c_double, ctypes.c_double, pointer, pointer]
    z = np.array([0.3, 0.05, 0.04, 0.5, 0.3, 0.02])
    ours, theirs = np.zeros(6), np.zeros(6)
    muscle.code.rhs(z, 0.4, 1.3, muscle.parameters, ours)
    library.rhs(
        *(z.ctypes.data_as(pointer), 0.4, 1.3), *(a.ctypes.data_as(pointer) for a in (muscle.parameters, theirs))
    )
    np.testing.assert_allclose(ours, theirs, rtol=1e-12)


def test_text_is_the_same_every_time() -> None:
    """Other processes find the compiled model by a hash of its sources: the same sources must give the same code."""
    assert compose("3state_coop").module_text(False) == compose("3state_coop").module_text(False)


def test_violation_names_fibre_state_value_and_time(muscle: Muscle) -> None:
    state = muscle.settle(0.0, 1.0)
    state[muscle.state_names.index("n_on")] = 1.7
    with pytest.raises(
        StateViolation, match=r"fibre 18Dec2017a: state n_on became 1\.\d+ at t = 0 s; allowed is 0 to 1"
    ):
        muscle.step(state, 0.0, 1.0, 1e-3)


def test_a_state_that_is_not_a_number_is_a_violation(muscle: Muscle) -> None:
    state = muscle.settle(0.0, 1.0)
    state[0] = float("nan")
    with pytest.raises(StateViolation, match="q0"):
        muscle.step(state, 0.0, 1.0, 1e-3)


@given(
    length=st.floats(-0.9, 5.0),
    calcium=st.floats(0.0, 1e4),
    dt=st.floats(1e-6, 0.1),
    pca=st.sampled_from([4.5, 6.2, 9.0]),
)
def test_any_finite_input_gives_a_finite_state_or_a_named_violation(
    muscle: Muscle, length: float, calcium: float, dt: float, pca: float
) -> None:
    state = muscle.settle(0.0, 10.0 ** (6.0 - pca))
    try:
        after = muscle.step(state, length, calcium, dt)
    except StateViolation as error:
        faults = error.fibre
    else:
        faults = "18Dec2017a"
        assert np.isfinite(after).all()
        assert np.isfinite(muscle.outputs(after)).all()
    assert faults == "18Dec2017a"


@pytest.mark.slow
def test_a_process_that_compiled_and_one_that_loaded_agree_to_the_bit(tmp_path: Path) -> None:
    """Regression: fused multiply-adds came out differently in code compiled here and code loaded from the cache."""
    import os
    import sys

    script = (
        "from xb_muscle_ros.models.muscle import Muscle\nfrom xb_muscle_ros.models.fibre_file import load_fibre\n"
        "m = Muscle(load_fibre('18Dec2017a'))\ns = m.settle(0.0, 31.6)\n"
        "for k in range(200): s = m.step(s, 0.0004 * k, 31.6, 1e-3)\nprint([x.hex() for x in s])\n"
    )
    root = Path(__file__).resolve().parents[2]
    env = {**os.environ, "XB_MUSCLE_CACHE": str(tmp_path), "PYTHONPATH": str(root)}
    runs = [
        subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert runs[0] == runs[1] != ""
