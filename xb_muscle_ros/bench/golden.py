"""Our models beside the authors' own output, cell by cell (pCa x recovery x amplitude).

The golden tables hold SRS of conditioning and test stretch and isometric force, computed by the authors' MATLAB code
with the released parameter sets. Their trials are sampled at 1 kHz on a grid that does not meet the corners, with the
velocity interpolated between samples, and their SRS is the slope over the first ten samples after onset; the same is
done here, so that what remains is the difference between the solutions.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.golden import METHODS, SETS
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Array, Muscle
from xb_muscle_ros.trials.protocol import SPEED_L0_PER_S, TEST_DURATION_S

# Of the tables made on a grid: 1,000 bins over ±15; nothing but force was smoothed.
GRID = {"bins": 1000.0, "strain_range": 15.0, "smooth_stiffness": 0.0}
# The authors leave out the active force of their Hill-type model at this pCa; its floor of activation stays otherwise.
_PASSIVE = {("hill_se", 9.0)}
STEPPERS = ("fixed", "variable")
QUANTITIES = ("srs_conditioning", "srs_test", "isometric_force")
_CONDITIONING_L0 = 0.0383
_SETTLE_S = 2.0
# The authors start the thick filament at 1/11 ready, not at its balance without force.
_READY_AT_START = 1.0 / 11.0


class Cell(NamedTuple):
    """One comparison.

    Attributes:
        table, fibre: which.
        pca, recovery_s, amplitude_l0: condition.
        quantity: one of `QUANTITIES`; F0/L0 or F0.
        stepper: ``fixed`` or ``variable``.
        ours, theirs: values.
    """

    table: str
    fibre: str
    pca: float
    recovery_s: float
    amplitude_l0: float
    quantity: str
    stepper: str
    ours: float
    theirs: float

    @property
    def error(self) -> float:
        """Difference relative to the larger of the golden value and 1 (F0/L0 or F0)."""
        return abs(self.ours - self.theirs) / max(abs(self.theirs), 1.0)


class Samples(NamedTuple):
    """A protocol on the authors' grid.

    Attributes:
        time_s, length_l0: shape (n,); the first sample is the last one before the first corner.
        conditioning_s, test_s: onsets of the stretches.
    """

    time_s: Array
    length_l0: Array
    conditioning_s: float
    test_s: float


def samples(amplitude_l0: float, recovery_s: float) -> Samples:
    """The protocol sampled as the authors sample it."""
    ramp = amplitude_l0 / SPEED_L0_PER_S
    total = 3.0 * TEST_DURATION_S + 2.0 * ramp + recovery_s + _SETTLE_S
    corners = np.cumsum([_SETTLE_S, ramp, ramp, recovery_s, TEST_DURATION_S])
    # The last corner but one comes out of a subtraction in the original; keep its rounding.
    corners[0] = total - (3.0 * TEST_DURATION_S + 2.0 * ramp + recovery_s)
    time_s = np.linspace(0.0, total, round(total / 1e-3))
    velocity = np.zeros(time_s.size)
    velocity[(time_s > corners[0]) & (time_s <= corners[1])] = SPEED_L0_PER_S
    velocity[(time_s > corners[1]) & (time_s <= corners[2])] = -SPEED_L0_PER_S
    velocity[(time_s > corners[3]) & (time_s <= corners[4])] = SPEED_L0_PER_S
    length = np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time_s))])
    first = int(np.searchsorted(time_s, corners[0], side="right")) - 1
    return Samples(time_s[first:], length[first:], float(corners[0]), float(corners[3]))


def _slope(s: Samples, force: Array, onset_s: float) -> float:
    i = int(np.searchsorted(s.time_s, onset_s, side="right"))
    return float(np.polyfit(s.length_l0[i : i + 10], force[i : i + 10], 1)[0])


def _settled(muscle: Muscle, calcium: float, duration_s: float) -> Array:
    state = muscle.rest()
    if "drx" in muscle.state_names:
        state[muscle.state_names.index("drx")] = _READY_AT_START
    return muscle.hold(state, calcium, duration_s)


def compare(
    golden: Path, table: str, steppers: Sequence[str] = STEPPERS, every: tuple[int, int, int, int] = (1, 1, 1, 1)
) -> Iterator[Cell]:
    """Compare a table, or every n-th fibre, pCa, recovery and amplitude of it.

    Args:
        golden: ``golden_srs.json``.
        table: name of the table.
        steppers: which to run; ``fixed`` takes one step per sample (1 ms), ``variable`` errors of 1e-6 per step.
        every: strides over fibres, pCa, recoveries, amplitudes.

    Raises:
        UserError: the file is missing, or the table unknown.
    """
    if not golden.is_file():
        raise UserError(f"golden tables {golden} do not exist; give the path of golden_srs.json")
    tables: dict[str, Any] = json.loads(golden.read_text(encoding="utf-8"))
    if table not in SETS or table not in tables:
        raise UserError(f"golden table '{table}' is not known; there are {', '.join(k for k in tables if k in SETS)}")
    data = tables[table]
    for fibre in list(data["fibres"])[:: every[0]]:
        loaded = load_fibre(fibre, SETS[table], METHODS.get(table))
        if table in METHODS:
            loaded = replace(loaded, values={**loaded.values, **GRID})
        muscle = Muscle(loaded)
        cells = data["fibres"][fibre]
        for i, pca in list(enumerate(data["pCa"]))[:: every[1]]:
            calcium = 10.0 ** (6.0 - pca)
            for j, recovery_s in list(enumerate(data["recovery_s"]))[:: every[2]]:
                for k, amplitude in list(enumerate(data["amplitude_L0"]))[:: every[3]]:
                    theirs = {q: cells[q][i][j][k] for q in QUANTITIES}
                    s = samples(amplitude, recovery_s)
                    for stepper in steppers:
                        states = _simulated(muscle, s, calcium, stepper)
                        force = "force_pe_f0" if (table, pca) in _PASSIVE else "force_f0"
                        conditioning = abs(amplitude - _CONDITIONING_L0) < 1e-9
                        ours = _measured(s, muscle.outputs_of(states)[force], conditioning)
                        for q in QUANTITIES:
                            if theirs[q] is not None and ours[q] is not None:
                                value = float(ours[q] or 0.0)
                                yield Cell(table, fibre, pca, recovery_s, amplitude, q, stepper, value, theirs[q])


def _simulated(muscle: Muscle, s: Samples, calcium: float, stepper: str) -> Array:
    start = _settled(muscle, calcium, float(s.time_s[0]))
    held = np.full(s.time_s.size, calcium)
    if stepper == "fixed":
        return muscle.run(start, np.diff(s.time_s), s.length_l0, held)
    return muscle.follow(start, s.time_s, s.length_l0, held, s.time_s)


def _measured(s: Samples, force: Array, conditioning: bool) -> dict[str, float | None]:
    return {
        "srs_conditioning": _slope(s, force, s.conditioning_s) if conditioning else None,
        "srs_test": _slope(s, force, s.test_s),
        "isometric_force": float(force[0]),
    }
