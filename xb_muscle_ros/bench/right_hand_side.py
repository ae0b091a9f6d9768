"""One evaluation of the right-hand side, beside the same expressions compiled by a C compiler."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from xb_muscle_ros.bench.c_code import c_text
from xb_muscle_ros.bench.measure import Figure, Setting, smooth_and_exact, timed
from xb_muscle_ros.models.muscle import Array, Muscle
from xb_muscle_ros.models.registry import compose

_CALLS = 1_000_000
_REPEATS = 11
# Every state depends a little on the evaluation before, so that no compiler can take any part of it out of the loop.
_NUDGE = 1e-12
_C_LOOP = """
void loop(const double *z0, double velocity, double calcium, const double *p, double *out, long calls) {
    double z[SIZE];
    for (int i = 0; i < SIZE; i++) z[i] = z0[i];
    for (long k = 0; k < calls; k++) {
        rhs(z, velocity, calcium, p, out);
        for (int i = 0; i < SIZE; i++) z[i] = z0[i] + 1e-12 * out[i];
    }
}
"""


def study(setting: Setting) -> list[Figure]:
    """Of a fibre's model, smooth and exact."""
    return [figure for muscle in smooth_and_exact(setting.fibre) for figure in figures(muscle)]


def figures(muscle: Muscle, pca: float = 6.1) -> list[Figure]:
    """Time per evaluation at an isometric state in Numba and, where a C compiler is there, in C."""
    smooth = muscle.fibre.values["smoothing"] > 0.0
    calcium = 10.0 ** (6.0 - pca)
    state = muscle.settle(0.0, calcium)
    z = np.concatenate([state[:-3], [0.0]])
    name = f"right-hand side, {muscle.fibre.model}, {'smooth' if smooth else 'exact'}"
    c = _c_loop(muscle, z, calcium)
    ours = timed(name, _numba_loop(muscle, z, calcium), _REPEATS, "ns", "paper: 17 µs (MATLAB)", _CALLS)
    if c is None:
        return [replace(ours, compared_with=f"{ours.compared_with}; no C compiler here")]
    theirs = timed(f"{name}, in C (-O3 -march=native)", c, _REPEATS, "ns", "the same expressions", _CALLS)
    return [
        replace(ours, compared_with=f"{ours.compared_with}; same in C: {theirs.value:.1f} ns"),
        theirs,
        Figure(f"{name}, ratio to C", ours.value / theirs.value, "1", "1: as fast as C"),
    ]


def _numba_loop(muscle: Muscle, z0: Array, calcium: float) -> Any:
    rhs, parameters = muscle.code.rhs, muscle.parameters

    @njit
    def loop(z0: Array, velocity: float, calcium: float, p: Array, out: Array, calls: int) -> None:
        z = z0.copy()
        for _ in range(calls):
            rhs(z, velocity, calcium, p, out)
            for i in range(z.size):
                z[i] = z0[i] + _NUDGE * out[i]

    out = np.zeros_like(z0)
    return lambda: loop(z0, 0.4545, calcium, parameters, out, _CALLS)


def _c_loop(muscle: Muscle, z: Array, calcium: float) -> Any:
    """The loop in C, or None where there is no compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    source = c_text(compose(muscle.fibre.model, muscle.fibre.method), muscle.fibre.values["smoothing"] > 0.0)
    with tempfile.TemporaryDirectory() as folder:
        text = Path(folder) / "rhs.c"
        library = Path(folder) / "rhs.so"
        text.write_text(
            source.replace("void rhs(", "static __attribute__((noinline)) void rhs(")
            + _C_LOOP.replace("SIZE", str(z.size))
        )
        command = [compiler, "-O3", "-march=native", "-shared", "-fPIC", "-o", str(library), str(text), "-lm"]
        subprocess.run(command, check=True, capture_output=True)
        loaded = ctypes.CDLL(str(library))
    pointer = ctypes.POINTER(ctypes.c_double)
    loaded.loop.argtypes = [pointer, ctypes.c_double, ctypes.c_double, pointer, pointer, ctypes.c_long]
    loaded.loop.restype = None
    out = np.zeros_like(z)
    arrays = [a.ctypes.data_as(pointer) for a in (z, muscle.parameters, out)]
    return lambda: loaded.loop(arrays[0], 0.4545, calcium, arrays[1], arrays[2], _CALLS)
