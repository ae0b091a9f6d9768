"""One trial made of a recording and a mapping: the same for every format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.trials.checks import belied, unrecorded, unusual
from xb_muscle_ros.trials.inspecting.names import name_pattern
from xb_muscle_ros.trials.mains import hum_line, laid_notch
from xb_muscle_ros.trials.phases import conditioning
from xb_muscle_ros.trials.readers.base import Draft, Recording, Signal
from xb_muscle_ros.trials.readers.calcium import PCA_RANGE, SAME_PCA, pcas_in, read_calcium
from xb_muscle_ros.trials.readers.clock import check_gaps, read_clock, times_of
from xb_muscle_ros.trials.readers.description import ImportMapping, filled
from xb_muscle_ros.trials.readers.force import read_force
from xb_muscle_ros.trials.readers.length import Length, read_length
from xb_muscle_ros.trials.readers.plausibility import SPIKE_F0, warn_of_f0, warn_of_force, warn_of_spikes
from xb_muscle_ros.trials.spool import release, settle
from xb_muscle_ros.trials.stamps import GAP_STEPS
from xb_muscle_ros.trials.trial import Array, Trial, TrialFacts

# The test stretch may begin this much later or earlier than the file tells, s.
ONSET_TOLERANCE_S = 0.005
FACT_RANGES = {"pca": PCA_RANGE, "recovery_s": (0.0, 1e4)}


def trial_of(recording: Recording, mapping: ImportMapping, path: Path, isometric_scaling: bool | None = None) -> Trial:
    """Make a trial that every command takes; see `made_of`.

    Raises:
        UserError: see `made_of`, or a command would refuse the trial, see `checks.unusual`.
    """
    trial = made_of(recording, mapping, path, isometric_scaling)
    with naming(recording.where):
        unusual(trial)
    return trial


def made_of(recording: Recording, mapping: ImportMapping, path: Path, isometric_scaling: bool | None = None) -> Trial:
    """Make a trial.

    Lengths in m stay as they are and ``reference_length_m`` tells L0; lengths in L0 and half-sarcomere lengths are
    stored with L0 = 1 m. Forces in N stay and ``f0_n`` tells F0; stresses and forces in F0 are stored with F0 = 1 N.
    Phases are found in the length record; amplitude and recovery are taken from them where they are not given.
    Negative times are shifted to begin at 0. Stimulation becomes calcium by `activation`.

    Args:
        recording: signals and facts as the file has them.
        mapping: units, meanings and facts.
        path: the file, for the names of fibre and trial.
        isometric_scaling: multiply the force so that its initial isometric part equals that of the matching
            isometric trial; None does so where the mapping has a table for it.

    Raises:
        UserError: time that does not increase, values that no muscle has, or scaling that is asked for and cannot be
            done.
    """
    draft = Draft(recording, mapping, [mapping.source, *recording.notes], [*recording.warnings])
    given, signal = recording.facts, recording.signals.get("force")
    _check_facts(draft)
    _compare_facts(draft, path)
    clock = read_clock(draft)
    release(recording.signals["time"].values)
    force_s = clock.time_s if signal is None else times_of(signal, clock, draft)
    notch = laid_notch(mapping.notch_hz, force_s, np.empty(0) if signal is None else signal.values)
    length = read_length(draft, clock.time_s, notch)
    calcium = read_calcium(draft, clock)
    force = read_force(draft, force_s, length.phases, calcium.pca, isometric_scaling)
    release(*(each.values for each in recording.signals.values()))
    force_f0 = force.force_n / force.f0_n
    if signal is not None and signal.times is not None:
        _check_cover(draft, signal, clock.time_s, force_s)
    warn_of_force(draft, force_f0, calcium.pca)
    _check_name(draft, calcium.pca, path)
    if signal is not None:
        warn_of_spikes(draft, signal, force_f0, SPIKE_F0, "F0")
    del force_f0
    warn_of_f0(draft, force.f0_n, length.reference_m)
    _check_onset(draft, length)
    with naming(draft.where):
        force_n = notch.without("force", force.time_s, force.force_n)
    draft.notes.append(notch.note)
    amplitude_l0, recovery_s = conditioning(clock.time_s, length.length_m, length.reference_m, length.phases)
    facts = TrialFacts(
        fibre=filled(mapping.fibre, path),
        trial=recording.trial,
        pca=calcium.pca,
        amplitude_l0=amplitude_l0 if given.get("amplitude_l0") is None else given["amplitude_l0"],
        recovery_s=recovery_s if given.get("recovery_s") is None else given["recovery_s"],
        reference_length_m=length.reference_m,
        f0_n=force.f0_n,
        phases=length.phases,
        source="; ".join(text for text in draft.notes if text),
        data_set=filled(mapping.data_set, path),
    )
    trial = Trial(
        facts=facts,
        time_s=settle(clock.time_s),
        length_m=settle(length.length_m),
        calcium_time_s=calcium.time_s,
        calcium_um=calcium.calcium_um,
        force_time_s=settle(force.time_s),
        force_n=settle(force_n),
    )
    trial = _with_shown_facts(draft, trial, path, {"amplitude_l0": amplitude_l0, "recovery_s": recovery_s})
    for line in unrecorded(trial):
        draft.warn(line)
    if line := hum_line(trial, mapping.notch_hz):
        draft.warn(line)
    return replace(trial, warnings=tuple(draft.warnings))


def _check_name(draft: Draft, pca: float | None, path: Path) -> None:
    """Warn where what a trial is called within its file, or else the file, tells another pCa."""
    if pca is None:
        return
    told = pcas_in(draft.recording.trial.removeprefix(filled(draft.mapping.trial, path)))
    if told:
        if len(told) == 1 and abs(told[0] - pca) > SAME_PCA:
            draft.warn(
                f"the name of the trial, '{draft.recording.trial}', tells pCa {told[0]:g}, it has {pca:g}; check both"
            )
        return
    named = name_pattern([path])
    # What a pattern of the mapping reads in the name was compared before.
    if named is not None and "pca" not in draft.mapping.named(path) and abs(named.found["pca"] - pca) > SAME_PCA:
        draft.warn(f"the file's name tells pCa {named.found['pca']:g}, the trial has {pca:g}; check both")


def _with_shown_facts(draft: Draft, trial: Trial, path: Path, shown: Mapping[str, float | None]) -> Trial:
    """The trial with amplitude and recovery as its lengths show them, where they belie what the file tells."""
    told = draft.mapping.facts_of(path)
    for fact in belied(trial):
        found = shown[fact.name]
        if told[fact.name] is None and found is not None:
            draft.warn(f"{fact.what}; {fact.name} is taken as {found:g}")
            changes: dict[str, Any] = {fact.name: found}
            trial = replace(trial, facts=replace(trial.facts, **changes))
    return trial


def _check_facts(draft: Draft) -> None:
    for name, (low, high) in FACT_RANGES.items():
        value = draft.recording.facts.get(name)
        if value is not None and not low <= value <= high:
            allowed = f"allowed is {low:g} to {high:g}; look at {draft.mapping.where}"
            raise UserError(f"{draft.where}: {name} is {value:g}; {allowed}")


def _compare_facts(draft: Draft, path: Path) -> None:
    """Warn where the name of the file tells another fact than the option or the mapping."""
    mapping = draft.mapping
    for name, told in mapping.named(path).items():
        given = mapping.facts.get(name)
        if given is None or given == told:
            continue
        if name in mapping.sure:
            draft.warn(f"{name} is {given:g}, as the option gives it; the file's name tells {told:g}")
        else:
            draft.warn(
                f"{name} is {told:g}, as the file's name tells by file_name.pattern; the mapping's {given:g} is for "
                f"names that tell none: to have it, take the pattern out or give --{name.partition('_')[0]}"
            )


def _check_cover(draft: Draft, force: Signal, time_s: Array, force_s: Array) -> None:
    """Warn where a force with its own clock has gaps, or begins or ends far from where the lengths do."""
    if force_s[0] > time_s[-1]:
        raise UserError(
            f"{draft.where}, {force.name}: force begins at {force_s[0]:.6g} s, after the lengths have ended at "
            f"{time_s[-1]:.6g} s; both have to be of one clock; record them together, or try 'stamp: log'"
        )
    check_gaps(draft, force, force_s)
    apart_s = GAP_STEPS * max(float(np.median(np.diff(each))) if each.size > 1 else 0.0 for each in (time_s, force_s))
    if force_s[0] - time_s[0] > apart_s or abs(time_s[-1] - force_s[-1]) > apart_s:
        draft.warnings.append(
            f"{draft.where}, {force.name}: force is there from {force_s[0]:.6g} to {force_s[-1]:.6g} s, length from "
            f"{time_s[0]:.6g} to {time_s[-1]:.6g} s"
        )


def _check_onset(draft: Draft, length: Length) -> None:
    """Warn where the test stretch is not where the file tells."""
    told_s = draft.recording.test_start_s
    found = next((phase.start_s for phase in length.phases if phase.name == "test_stretch"), None)
    if told_s is None or (found is not None and abs(found - told_s) <= ONSET_TOLERANCE_S):
        return
    shown = "shows no test stretch" if found is None else f"shows the test stretch at {found:.6g} s"
    draft.warn(f"the length record {shown}; the file tells of one at {told_s:.6g} s")
