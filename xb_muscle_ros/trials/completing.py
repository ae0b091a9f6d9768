"""What a bag does not tell of a trial: taken from the command line, the fibre file, or the samples, and said."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bag_reading import Reading
from xb_muscle_ros.trials.phases import conditioning, detect_phases, initial_isometric, moves
from xb_muscle_ros.trials.trial import Trial

# Digits of a pCa that is taken from calcium: 10^(6 - pCa) does not come back to the last bit.
_PCA_DIGITS = 6
CONDITIONING_FOUND = "amplitude and recovery found from length"
_PHASES = "phases found from length"
_CUT = "phases of the bag go on after its lengths end; of those the scores have a part, or none"
_OTHER_CLOCK = "phases of the bag lie at other times than its lengths and are left out"


class FibreConstants(Protocol):
    """What is needed of a fibre file: its `Fibre` has it."""

    @property
    def name(self) -> str: ...
    @property
    def path(self) -> Path | None: ...
    @property
    def reference_length_m(self) -> float: ...
    @property
    def f0_n(self) -> float: ...


@dataclass(frozen=True)
class Known:
    """What is known of a fibre beside its bags.

    Attributes:
        reference_length_m: the user's L0, m; goes before that of a bag.
        first_isometric: the user wants the length before the first stretch for L0.
        f0_n: the user's F0, N; goes before that of a bag.
        file_reference_length_m: L0 of the fibre file, m; taken where a bag has none.
        file_f0_n: F0 of the fibre file, N; taken where a bag has none.
        file: name of the fibre file; empty without one.
    """

    reference_length_m: float | None = None
    first_isometric: bool = False
    f0_n: float | None = None
    file_reference_length_m: float = 1.0
    file_f0_n: float = 1.0
    file: str = ""

    def of_file(self, fibre: FibreConstants) -> Known:
        """The same with L0 and F0 of a fibre file."""
        return replace(
            self,
            file_reference_length_m=fibre.reference_length_m,
            file_f0_n=fibre.f0_n,
            file=fibre.name if fibre.path is None else fibre.path.name,
        )


def complete(reading: Reading, known: Known) -> tuple[Trial, tuple[str, ...]]:
    """The trial with all facts, and a line for each kind of fact that is not the bag's own.

    L0 and F0 are the user's, else the bag's, else the fibre file's (1 m and 1 N, as for normalised data, where it says
    nothing else). Phases are found from length, amplitude and recovery from phases that are the paper's protocol, and
    pCa from calcium that is constant. Calcium that was replaced before the first length has no part in the trial.

    Raises:
        UserError: L0 is to be the length before the first stretch, and that is none.
    """
    trial, unknown = reading
    notes: list[str] = []
    trial = _with_acting_calcium(trial)
    if "phases" not in unknown and not _overlap(trial):
        unknown |= {"phases"}
        trial = replace(trial, facts=replace(trial.facts, phases=()))
        notes.append(_OTHER_CLOCK)
    elif _cut(trial):
        notes.append(_CUT)
    if "phases" in unknown:
        facts, l0 = trial.facts, _length_for_phases(trial, unknown, known)
        phases = detect_phases(trial.time_s, trial.length_m, facts.amplitude_l0, facts.recovery_s, l0)
        trial = replace(trial, facts=replace(facts, phases=phases))
        hidden = [phase.name for phase in trial.facts.phases] == ["isometric"] and moves(trial.length_m)
        notes.append("no phases found, though length moves: its noise hides them" if hidden else _PHASES)
    trial, told = _with_scales(trial, unknown, known)
    notes += told
    facts = trial.facts
    amplitude, recovery = conditioning(trial.time_s, trial.length_m, facts.reference_length_m, facts.phases)
    found = replace(
        facts,
        amplitude_l0=amplitude if facts.amplitude_l0 is None else facts.amplitude_l0,
        recovery_s=recovery if facts.recovery_s is None else facts.recovery_s,
        pca=pca_of(trial),
    )
    if (found.amplitude_l0, found.recovery_s) != (facts.amplitude_l0, facts.recovery_s):
        notes.append(CONDITIONING_FOUND)
    if found.pca != facts.pca:
        notes.append("pCa taken from constant calcium")
    elif found.pca is None and np.ptp(trial.calcium_um) > 0.0:
        notes.append("calcium changes, so there is no pCa")
    return replace(trial, facts=found), tuple(notes)


def pca_of(trial: Trial) -> float | None:
    """The pCa of a trial: as it says, or from calcium where that is constant; None where calcium changes."""
    calcium = trial.calcium_um
    if trial.facts.pca is not None or np.ptp(calcium) > 0.0 or calcium[0] <= 0.0:
        return trial.facts.pca
    return round(float(6.0 - np.log10(calcium[0])), _PCA_DIGITS)


def _with_acting_calcium(trial: Trial) -> Trial:
    """The trial without calcium that was replaced before the first length; a node's topic keeps such."""
    first = max(int(np.searchsorted(trial.calcium_time_s, trial.time_s[0], side="right")) - 1, 0)
    if not first:
        return trial
    return replace(trial, calcium_time_s=trial.calcium_time_s[first:], calcium_um=trial.calcium_um[first:])


def _overlap(trial: Trial) -> bool:
    """Whether any phase lies within the lengths: phases of another clock do not."""
    begin_s, end_s = trial.time_s[0], trial.time_s[-1]
    return any(phase.start_s <= end_s and phase.end_s >= begin_s for phase in trial.facts.phases)


def _cut(trial: Trial) -> bool:
    """Whether phases end later than the lengths, by more than two samples."""
    steps = np.diff(trial.time_s)
    end_s = max((phase.end_s for phase in trial.facts.phases), default=-np.inf)
    return bool(end_s > trial.time_s[-1] + 2.0 * (float(np.median(steps)) if steps.size else 0.0))


def counted(notes: Iterable[tuple[str, ...]]) -> list[str]:
    """Lines of all trials of a run, each once with the number of trials it holds for."""
    counts = Counter(line for of_trial in notes for line in of_trial)
    return [f"{line} ({n} trial{'s' if n > 1 else ''})" for line, n in counts.items()]


def _length_for_phases(trial: Trial, unknown: frozenset[str], known: Known) -> float | None:
    """L0 (m) by which speeds are judged; None for the record's median, where it is not sure."""
    if known.reference_length_m is not None:
        return known.reference_length_m
    sure = "reference_length_m" not in unknown and not known.first_isometric
    return trial.facts.reference_length_m if sure else None


def _with_scales(trial: Trial, unknown: frozenset[str], known: Known) -> tuple[Trial, list[str]]:
    """The trial with L0 and F0, and a line on those that are not the bag's own."""
    notes, taken = [], []
    file = f"of fibre file {known.file}"
    l0, f0 = trial.facts.reference_length_m, trial.facts.f0_n
    if known.first_isometric:
        start = trial.length_m[initial_isometric(trial.time_s, trial.facts.phases)]
        l0 = float(np.mean(start if start.size else trial.length_m[:1]))
        if l0 <= 0.0:
            raise UserError(
                f"trial {trial.facts.trial}: the length before the first stretch is {l0:.3g} m and cannot be L0; "
                "lengths of a bag are absolute, not changes; import the bag with --length-is change"
            )
        notes.append(f"L0 is the length {'before the first stretch' if start.size else 'of the first sample'}")
    elif known.reference_length_m is not None:
        l0 = known.reference_length_m
    elif "reference_length_m" in unknown:
        l0 = known.file_reference_length_m
        taken.append(f"L0 = {l0:g} m ({'as for normalised data' if l0 == 1.0 else file})")
    if known.f0_n is not None:
        f0 = known.f0_n
    elif "f0_n" in unknown:
        f0 = known.file_f0_n
        taken.append(f"F0 = {f0:g} N ({'as for normalised data' if f0 == 1.0 else file})")
    if taken:
        notes.append(f"facts missing in the bag, taken: {', '.join(taken)}; --reference-length and --f0 give others")
    return replace(trial, facts=replace(trial.facts, reference_length_m=l0, f0_n=f0)), notes
