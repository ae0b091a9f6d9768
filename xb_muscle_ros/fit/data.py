"""Trials as a fit sees them: what the fibre was given sample by sample, and which measured force counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.rmsd import windows
from xb_muscle_ros.scores.steady import steady_part
from xb_muscle_ros.simulation.offline import calcium_per_step
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.trial import Array, Trial
from xb_muscle_ros.work.plain import from_plain, to_plain


@dataclass(frozen=True)
class FitTrial:
    """One trial, ready to be simulated and compared.

    Attributes:
        solution: of the bathing solution; trials of one share its faults.
        order: how many trials of the fibre came before it.
        held_out: whether it is kept out of the fit.
        weight: of its squared error.
        steady_s: begin and end of the steady isometric force before the first change of length, s, see
            `scores.steady`; None where there is none.
        moves: whether length changes at all.
        time_s, length_l0, calcium_um: shape (n,); calcium acts in the step that ends at a sample.
        force_time_s, measured_f0: shape (k,); the force that counts, within the trial's window.
    """

    name: str
    solution: str
    order: int
    held_out: bool
    weight: float
    steady_s: tuple[float, float] | None
    moves: bool
    time_s: Array
    length_l0: Array
    calcium_um: Array
    force_time_s: Array
    measured_f0: Array

    @property
    def steady(self) -> npt.NDArray[np.bool_]:
        """Which of the force that counts is steady before the first change of length, shape (k,)."""
        begin, end = self.steady_s or (np.inf, -np.inf)
        return (self.force_time_s >= begin) & (self.force_time_s <= end)

    @property
    def dt_s(self) -> Array:
        """Time between samples in whole nanoseconds, as messages have it, shape (n - 1,)."""
        return np.diff(to_ns(self.time_s)) / 1e9

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return to_plain(self)

    @staticmethod
    def from_json(row: Mapping[str, Any]) -> FitTrial:
        """A trial from plain data."""
        return from_plain(FitTrial, row)


def fit_trials(
    trials: Sequence[Trial], held_out: Sequence[bool], whole: bool = False, weights: Mapping[str, float] | None = None
) -> tuple[FitTrial, ...]:
    """Trials of one fibre in the order in which they were recorded.

    Args:
        trials: with measured force.
        held_out: for each trial, whether it is kept out.
        whole: compare the whole trial rather than the paper's window (0.0843 s before the first stretch to 0.0843 s
            after the test stretch, see `scores.rmsd.windows`).
        weights: of single trials by name; others weigh 1.

    Raises:
        UserError: a trial without force, two of one name, an unknown name among the weights.
    """  # fmt: skip
    weights = weights or {}
    names = [trial.facts.trial for trial in trials]
    for name in names:
        if names.count(name) > 1:
            raise UserError(f"trial {name} is there {names.count(name)} times; give each trial once")
    for name, weight in weights.items():
        if name not in names:
            raise UserError(f"weight of trial '{name}', which is not among the bags; there are {', '.join(names)}")
        if not weight >= 0.0:
            raise UserError(f"weight of trial '{name}' is {weight:g}; allowed is 0 and above")
    bare = [trial.facts.trial for trial in trials if not trial.force_n.size]
    if bare:
        named = f"trial {bare[0]} has" if len(bare) == 1 else f"trials {', '.join(bare)} have"
        raise UserError(f"{named} no measured force; a fit needs it, leave the bag{'s'[: len(bare) - 1]} out")
    return tuple(
        _fit_trial(trial, i, out, whole, float(weights.get(trial.facts.trial, 1.0)))
        for i, (trial, out) in enumerate(zip(trials, held_out, strict=True))
    )


def _fit_trial(trial: Trial, order: int, held_out: bool, whole: bool, weight: float) -> FitTrial:
    name = trial.facts.trial
    window = (
        (trial.time_s[0], trial.time_s[-1]) if whole else windows(trial)["whole"] or (trial.time_s[0], trial.time_s[-1])
    )
    early, late = max(window[0], trial.time_s[0]), min(window[1], trial.time_s[-1])
    inside = (trial.force_time_s >= early - 5e-10) & (trial.force_time_s <= late + 5e-10)
    if np.count_nonzero(inside) < 10:
        raise UserError(
            f"trial {name}: {np.count_nonzero(inside)} samples of force between {early:g} and {late:g} s; at least 10 "
            "are needed, leave the bag out"
        )
    # Nothing after the window bears on the force within it.
    last = min(int(np.searchsorted(trial.time_s, late - 5e-10)) + 1, trial.time_s.size)
    pca, phases = trial.facts.pca, trial.facts.phases
    steady, why, _ = steady_part(trial, trial.force_time_s, trial.measured_f0)
    return FitTrial(
        name=name,
        solution="changing" if pca is None else f"pCa {pca:g}",
        order=order,
        held_out=held_out,
        weight=weight,
        steady_s=None if why else (float(trial.force_time_s[steady][0]), float(trial.force_time_s[steady][-1])),
        moves=len(phases) > 1,
        time_s=trial.time_s[:last],
        length_l0=trial.length_change_l0[:last],
        calcium_um=calcium_per_step(trial)[:last],
        force_time_s=trial.force_time_s[inside],
        measured_f0=trial.measured_f0[inside],
    )  # fmt: skip
