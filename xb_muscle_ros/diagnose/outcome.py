"""What a diagnosis found, and its files."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.closure import by_distribution
from xb_muscle_ros.diagnose.conflict import Conflict
from xb_muscle_ros.diagnose.crossval import HeldOut
from xb_muscle_ros.diagnose.kernel import Law
from xb_muscle_ros.diagnose.mismatch import Bound, Recordings, simulated
from xb_muscle_ros.diagnose.names import Verdict
from xb_muscle_ros.diagnose.next_experiment import Proposal, scaled
from xb_muscle_ros.diagnose.profile import Known
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.screen import Linear
from xb_muscle_ros.diagnose.search import Search
from xb_muscle_ros.diagnose.significance import Significance
from xb_muscle_ros.diagnose.study import Study
from xb_muscle_ros.diagnose.verdict import Decision
from xb_muscle_ros.files import matching, replaced, write_text
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.fibre_writing import write_fibre
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.trial import Trial

Array = npt.NDArray[np.float64]

AUGMENTED, NEXT = "augmented.yaml", "next_experiment"


@dataclass(frozen=True)
class Outcome:
    """What a diagnosis found.

    Attributes:
        trials, study: what was diagnosed.
        search: all fits.
        recordings: trials with their noise.
        before, after: significance of what the base and the final explanation left.
        last: the final explanation, taken as linear.
        heldout: scores by label.
        bound: what a flexible discrepancy foretells of trials left out, beside base and final explanation.
        conflicts: between parts of the study; empty where there is no mismatch.
        law: of what the base left.
        known: the leading mechanism's parameter.
        decision: the answer.
        proposal: the next experiment.
        start_forces: recorded force by the fibre file as given, by trial.
        warnings, missing: a line each.
        described: whether the recordings could be judged.
        notes: what was assumed, left out or not looked at, a line each.
        seconds: that it took.
        seed: of the bootstrap.
    """

    trials: tuple[Trial, ...]
    study: Study
    search: Search
    recordings: Recordings
    before: Significance
    after: Significance
    last: Linear
    heldout: Mapping[str, HeldOut]
    bound: Bound | None
    conflicts: tuple[Conflict, ...]
    law: Law | None
    known: Known | None
    decision: Decision
    proposal: Proposal | None
    start_forces: list[Array]
    warnings: tuple[str, ...]
    missing: tuple[str, ...]
    seconds: float
    seed: int
    described: bool = True
    notes: tuple[str, ...] = ()

    @property
    def shown(self) -> Fit:
        """The fit that stands for the answer: the final one, or the base where there is none."""
        named = self.decision.verdict in (Verdict.PHYSICS, Verdict.MEASUREMENT, Verdict.AMBIGUOUS)
        return self.search.final if named else self.search.base

    @property
    def augmented(self) -> bool:
        """Whether there is a model with more physics to write."""
        return bool(self.shown.explanation.mechanisms)


def older_results(out: Path) -> list[Path]:
    """What an older diagnosis left in a folder; not its journal, which holds what is computed already."""
    files = matching(out, r"diagnosis\.json", re.escape(AUGMENTED), r"traces\.npz", r"report\.html")
    return [*files, *([out / NEXT] if (out / NEXT).is_dir() else [])]


def write(out: Path, o: Outcome, found: dict[str, Any], report: bool = True) -> None:
    """Write all files of a diagnosis in the place of an older one's; each appears whole or not at all.

    Raises:
        UserError: the folder cannot be written.
    """
    from xb_muscle_ros.diagnose.report import write_report

    remove_results(older_results(out))
    if o.augmented:
        write_fibre(out / AUGMENTED, augmented_fibre(o), _comments(o))
    if o.proposal is not None:
        fibre = o.study.fibre
        write_trial(out / NEXT, scaled(o.proposal.protocol.trial, fibre.reference_length_m, fibre.f0_n))
    _write_traces(out / "traces.npz", o)
    write_text(out / "diagnosis.json", json.dumps(found, indent=1, ensure_ascii=False) + "\n")
    if report:
        write_report(out)


def augmented_fibre(o: Outcome) -> Fibre:
    """The fibre with the mechanisms of the answer.

    Where the Gaussian form's own error was taken out, it goes by the distribution, which does not have it.
    """
    problem = o.shown.problem(o.study)
    fibre = problem.fibre_at(problem.start)
    fibre = by_distribution(fibre) if o.study.closure_f0 else fibre
    names = " and ".join(n.value for n in o.shown.explanation.mechanisms)
    source = f"fitted by this package to {len(o.trials)} trials of fibre {fibre.name}, with {names} (diagnosed)"
    return replace(fibre, source=source)


def _comments(o: Outcome) -> list[str]:
    lines = [f"Model of fibre {o.study.fibre.name} with what a diagnosis found missing; see diagnosis.json beside it."]
    faults = [n.value for n in o.shown.explanation.faults]
    if faults:
        lines.append(f"The fit also moved faults of the measurement ({', '.join(faults)}), which no model has.")
    return lines


def _write_traces(path: Path, o: Outcome) -> None:
    base, shown = simulated(o.study, o.search.base), simulated(o.study, o.shown)
    arrays: dict[str, Array] = {}
    for i, trial in enumerate(o.study.trials):
        arrays[f"t{i}_time_s"] = trial.force_time_s
        arrays[f"t{i}_length_l0"] = np.interp(trial.force_time_s, trial.time_s, trial.length_l0)
        arrays[f"t{i}_measured_f0"] = trial.measured_f0
        arrays[f"t{i}_start_f0"] = o.start_forces[i]
        arrays[f"t{i}_before_f0"] = base[i]
        arrays[f"t{i}_after_f0"] = shown[i]
    with replaced(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)
