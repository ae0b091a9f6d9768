"""The 84 conditions that every fibre was tested in: activation classes, what was done before, and sets of both."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.trials.trial import Array

# How hard a fibre works at a pCa, by its isometric force.
CLASSES = ("passive", "low", "intermediate", "high")
BOUNDS_F0 = (0.05, 0.30, 0.70)
UNKNOWN = -1

AMPLITUDES_L0 = (0.0012, 0.0038, 0.0121, 0.0383)
RECOVERIES_S = (0.001, 0.1, 0.316, 1.0, 10.0)
# The condition that the paper's figures vary one thing at a time from.
COMMON_AMPLITUDE_L0, COMMON_RECOVERY_S, COMMON_PCA, COMMON_CLASS = 0.0383, 0.001, 6.3, "intermediate"
LARGE_ABOVE_L0 = 0.03
LARGE_BELOW_S = 0.5

Mask = npt.NDArray[np.bool_]


def activation_class(isometric_f0: Array) -> npt.NDArray[np.int64]:
    """Index into `CLASSES` for each isometric force, `UNKNOWN` where the force is not known.

    Passive below 5 %, low from 5 to below 30 %, intermediate from 30 to 70 %, high above 70 % of F0
    (van der Zee et al. 2026).

    Args:
        isometric_f0: any shape, F0; NaN where not measured.
    """
    force = np.asarray(isometric_f0, dtype=np.float64)
    low, middle, high = BOUNDS_F0
    level = (force >= low).astype(np.int64) + (force >= middle) + (force > high)
    return np.where(np.isfinite(force), level, UNKNOWN)


class Condition(NamedTuple):
    """What was done before the test stretch.

    Attributes:
        amplitude_l0: of the conditioning stretch, L0; 0 is the reference trial.
        recovery_s: between shortening and test stretch, s.
    """

    amplitude_l0: float
    recovery_s: float


# The reference first: a trial without conditioning stretch has no recovery; by convention the shortest.
CONDITIONS = (
    Condition(0.0, RECOVERIES_S[0]),
    *(Condition(amplitude, recovery) for amplitude in AMPLITUDES_L0 for recovery in RECOVERIES_S),
)
SHAPE = (len(CLASSES), len(CONDITIONS))
SETS = ("large", "small", "all")


def _large(classes: tuple[str, ...]) -> Mask:
    strong = np.array([c.amplitude_l0 > LARGE_ABOVE_L0 and c.recovery_s < LARGE_BELOW_S for c in CONDITIONS])
    chosen = np.array([name in classes for name in CLASSES])
    mask: Mask = chosen[:, None] & strong
    return mask


LARGE: dict[str, Mask] = {"text": _large(("low", "intermediate")), "released": _large(CLASSES)}
"""Conditions with large reductions of SRS, shape (classes, conditions), two readings of which they are.

``text``: low or intermediate activation, amplitude above 3 % L0, recovery below 0.5 s (van der Zee et al. 2026,
Methods): 6 of 84. ``released``: the same at all four levels, as the authors' programs have it: 12 of 84. Only the
latter can give the paper's three values for the Hill-type model with series element (0.312 over large, at most 0.180
over small, 0.204 over all 84 conditions): 84 · 0.204² - n · 0.312² <= (84 - n) · 0.180² asks for n >= 12.
"""


def sets(large: str) -> dict[str, Mask]:
    """Masks of shape (classes, conditions) by the names in `SETS`, for a reading of ``large`` (see `LARGE`)."""
    mask = LARGE[large]
    return {"large": mask, "small": ~mask, "all": np.ones(SHAPE, dtype=bool)}


def nominal(amplitude_l0: float | None, recovery_s: float | None) -> tuple[float | None, float | None]:
    """Amplitude (L0) and recovery (s) that were found in a record, as the condition they are of.

    Ramps are good to some 6 % of their amplitude, pauses to some 10 ms; shorter pauses are not seen. What is near none
    of the paper's conditions is rounded, so that repeats are of one condition.
    """
    amplitude = None if amplitude_l0 is None else _near(amplitude_l0, (0.0, *AMPLITUDES_L0), 0.06, 3e-4)
    recovery = None if recovery_s is None else _near(recovery_s, RECOVERIES_S, 0.05, 0.01)
    return amplitude, recovery


def _near(value: float, levels: tuple[float, ...], relative: float, absolute: float) -> float:
    """The level that a value is near to, else the value to two digits."""
    nearest = min(levels, key=lambda level: abs(level - value))
    return nearest if abs(nearest - value) <= max(relative * nearest, absolute) else float(f"{value:.2g}")
