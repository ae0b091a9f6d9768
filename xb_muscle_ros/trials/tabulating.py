"""A trial as tables of columns whose names end in their units: simulated and measured side by side on one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from xb_muscle_ros.trials.custom_data import facts_to_custom_data
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.trial import Array, Trial

MEASURED, SIMULATED = "measured_force", "simulated"


@dataclass(frozen=True)
class TrialTable:
    """Columns of one clock.

    Attributes:
        name: of the table beside the trial's own; empty for that one.
        columns: by name, ``time_s`` first; shape (n,) each.
        facts: of the trial, as texts.
        notes: what was done to the samples, one line each.
    """

    name: str
    columns: Mapping[str, Array]
    facts: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def tables_of(trial: Trial, simulated: Simulated | None, interpolate: bool = False) -> tuple[TrialTable, ...]:
    """The tables of a trial: one on its own clock, and one for each signal that has another clock.

    Args:
        trial: lengths (m), calcium (µM) and force (N).
        simulated: what a model answered; None where none did.
        interpolate: put signals of another clock on that of the lengths, by straight lines between their samples, where
            they cover it; those that do not keep a table of their own.

    Returns:
        the trial's own table first. Calcium has in it what holds at each sample.
    """
    facts = facts_to_custom_data(trial.facts)
    columns = {
        "time_s": trial.time_s,
        "length_m": trial.length_m,
        "length_change_l0": trial.length_change_l0,
        "calcium_um": _held(trial),
    }
    notes = list(_of_calcium(trial))
    others: list[TrialTable] = []
    for name, time_s, more in _answers(trial, simulated):
        names = ", ".join(more)
        if _same_clock(time_s, trial.time_s):
            columns |= more
        elif interpolate and time_s[0] <= trial.time_s[0] and time_s[-1] >= trial.time_s[-1]:
            columns |= {key: np.interp(trial.time_s, time_s, values) for key, values in more.items()}
            notes.append(f"{names}: interpolated by straight lines from a clock of its own ({time_s.size} samples)")
        else:
            notes.append(f"{names}: in a table of its own, since its clock is another ({time_s.size} samples)")
            others.append(TrialTable(name, {"time_s": time_s, **more}, facts))
    return (TrialTable("", columns, facts, tuple(notes)), *others)


def _answers(trial: Trial, simulated: Simulated | None) -> list[tuple[str, Array, dict[str, Array]]]:
    """What was measured and what a model answered: name, clock, columns."""
    l0, f0 = trial.facts.reference_length_m, trial.facts.f0_n
    found: list[tuple[str, Array, dict[str, Array]]] = []
    if trial.force_n.size and trial.force_is_measured:
        measured = {"force_measured_n": trial.force_n, "force_measured_f0": trial.measured_f0}
        found.append((MEASURED, trial.force_time_s, measured))
    if simulated is not None:
        more = {
            "force_simulated_n": simulated.force_n,
            "force_simulated_f0": simulated.force_n / f0,
            "ce_length_m": simulated.ce_length_m,
            "ce_length_l0": simulated.ce_length_m / l0,
            "ce_velocity_m_per_s": simulated.ce_velocity_m_per_s,
            **simulated.moments,
        }
        found.append((SIMULATED, simulated.time_s, more))
    elif trial.force_n.size and not trial.force_is_measured:
        more = {"force_simulated_n": trial.force_n, "force_simulated_f0": trial.measured_f0}
        found.append((SIMULATED, trial.force_time_s, more))
    return found


def _same_clock(one_s: Array, other_s: Array) -> bool:
    return one_s.shape == other_s.shape and bool(np.array_equal(to_ns(one_s), to_ns(other_s)))


def _held(trial: Trial) -> Array:
    """Calcium at each length: the last value holds; before the first there is that one."""
    at = np.searchsorted(to_ns(trial.calcium_time_s), to_ns(trial.time_s), side="right") - 1
    held: Array = trial.calcium_um[np.maximum(at, 0)]
    return held


def _of_calcium(trial: Trial) -> tuple[str, ...]:
    if trial.calcium_time_s.size < 2:
        return ()
    between = np.count_nonzero(~np.isin(to_ns(trial.calcium_time_s[1:]), to_ns(trial.time_s)))
    if not between:
        return ()
    return (f"calcium_um: {between} changes lie between samples of length and show at the next one",)
