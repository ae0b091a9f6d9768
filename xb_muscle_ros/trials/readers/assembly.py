"""One trial made of a recording and a mapping: the same for every format."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.phases import conditioning
from xb_muscle_ros.trials.readers.calcium import PCA_RANGE, read_calcium
from xb_muscle_ros.trials.readers.clock import GAP_STEPS, gaps, read_clock, times_of
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.force import Context, read_force
from xb_muscle_ros.trials.readers.length import Length, read_length
from xb_muscle_ros.trials.readers.plausibility import SPIKE_F0, f0_doubts, force_doubts, spikes
from xb_muscle_ros.trials.readers.recording import Recording
from xb_muscle_ros.trials.trial import Array, Trial, TrialFacts

# The test stretch may begin this much later or earlier than the file tells, s.
ONSET_TOLERANCE_S = 0.005
FACT_RANGES = {"pca": PCA_RANGE, "amplitude_l0": (0.0, 1.0), "recovery_s": (0.0, 1e4)}


def trial_of(recording: Recording, mapping: ImportMapping, path: Path, isometric_scaling: bool | None = None) -> Trial:
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
    where, given = recording.where, recording.facts
    _check_facts(recording, mapping)
    clock = read_clock(recording, mapping)
    length = read_length(recording, mapping, clock.time_s, given.get("amplitude_l0"), given.get("recovery_s"))
    calcium = read_calcium(recording, mapping, clock, given.get("pca"))
    force_s = clock.time_s if recording.force is None else times_of(recording.force, clock, recording, mapping)
    context = Context(where, force_s, length.phases, calcium.pca)
    force = read_force(recording.force, mapping, context, isometric_scaling)
    amplitude_l0, recovery_s = conditioning(clock.time_s, length.length_m, length.reference_m, length.phases)
    notes = (mapping.source, *recording.notes, *length.notes, *calcium.notes, *force.notes)
    facts = TrialFacts(
        fibre=mapping.fibre_of(path),
        trial=recording.trial,
        pca=calcium.pca,
        amplitude_l0=amplitude_l0 if given.get("amplitude_l0") is None else given["amplitude_l0"],
        recovery_s=recovery_s if given.get("recovery_s") is None else given["recovery_s"],
        reference_length_m=length.reference_m,
        f0_n=force.f0_n,
        phases=length.phases,
        source="; ".join(text for text in notes if text),
        data_set=mapping.data_set_of(path),
    )
    return Trial(
        facts=facts,
        time_s=clock.time_s,
        length_m=length.length_m,
        calcium_time_s=calcium.time_s,
        calcium_um=calcium.calcium_um,
        force_time_s=force.time_s,
        force_n=force.force_n,
        warnings=(
            *recording.warnings,
            *clock.warnings,
            *length.warnings,
            *calcium.warnings,
            *force.warnings,
            *_coverage(recording, mapping, clock.time_s, force_s),
            *force_doubts(where, mapping, force.force_n / force.f0_n, calcium.pca),
            *(
                ()
                if recording.force is None
                else spikes(where, recording.force, force.force_n / force.f0_n, SPIKE_F0, "F0")
            ),
            *f0_doubts(where, mapping, force.f0_n, length.reference_m),
            *_onset(recording, length),
        ),
    )


def _check_facts(recording: Recording, mapping: ImportMapping) -> None:
    for name, (low, high) in FACT_RANGES.items():
        value = recording.facts.get(name)
        if value is not None and not low <= value <= high:
            raise UserError(
                f"{recording.where}: {name} is {value:g}; allowed is {low:g} to {high:g}; look at {mapping.where}"
            )


def _coverage(recording: Recording, mapping: ImportMapping, time_s: Array, force_s: Array) -> Iterator[str]:
    """Lines where a force with its own clock has gaps, or begins or ends far from where the lengths do."""
    force = recording.force
    if force is None or force.times is None:
        return
    if force_s[0] > time_s[-1]:
        raise UserError(
            f"{recording.where}, {force.name}: force begins at {force_s[0]:.6g} s, after the lengths have ended at "
            f"{time_s[-1]:.6g} s; both have to be of one clock; record them together, or try 'stamp: log'"
        )
    yield from gaps(recording.where, force, force_s, mapping)
    apart_s = GAP_STEPS * max(float(np.median(np.diff(each))) if each.size > 1 else 0.0 for each in (time_s, force_s))
    if force_s[0] - time_s[0] > apart_s or abs(time_s[-1] - force_s[-1]) > apart_s:
        yield (
            f"{recording.where}, {force.name}: force is there from {force_s[0]:.6g} to {force_s[-1]:.6g} s, length "
            f"from {time_s[0]:.6g} to {time_s[-1]:.6g} s"
        )


def _onset(recording: Recording, length: Length) -> tuple[str, ...]:
    """A warning where the test stretch is not where the file tells."""
    told_s = recording.test_start_s
    if told_s is None:
        return ()
    found = next((phase.start_s for phase in length.phases if phase.name == "test_stretch"), None)
    if found is not None and abs(found - told_s) <= ONSET_TOLERANCE_S:
        return ()
    shown = "shows no test stretch" if found is None else f"shows the test stretch at {found:.6g} s"
    return (f"{recording.where}: the length record {shown}; the file tells of one at {told_s:.6g} s",)
