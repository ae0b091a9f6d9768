"""Every trial sample by sample: as measured, as base and answer have it, and without each of the answer's parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from xb_muscle_ros.diagnose.component import Component
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.noise.cells import Residual
from xb_muscle_ros.diagnose.noise.residuals import Around
from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.search.system import Names
from xb_muscle_ros.diagnose.search.whole import FRAMES
from xb_muscle_ros.diagnose.searching import Searched
from xb_muscle_ros.diagnose.words import percent, phase_words
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.trials.trial import Array

# A smaller effect on the force is not reported, F0.
_LEAST_F0 = 5e-4


@dataclass(frozen=True)
class Traced:
    """One trial.

    Attributes:
        fibre: place of the fibre in the study.
        residual: of the base, with the trial's phases.
        forces: measured, by the fibre file as given, base, answer and held-out predictions; the answer without each of
            its parts: its effect set to nothing, all else as fitted; of a part that is another model, that model's
            absence fitted anew.
    """

    fibre: int
    residual: Residual
    forces: TrialTraces


def traced(study: Searched, chosen: Names, before: Sequence[Around], after: Sequence[Around]) -> list[Traced]:
    """All trials of all fibres."""
    found: list[Traced] = []
    heldout = study.judged.heldout
    for i, recorded in enumerate(study.recorded):
        starts = _start(study, i)
        parts = {name: _without(study, chosen, name, i) for name in chosen}
        residuals = study.recordings[i].residuals(before[i])
        fits = [
            [t.measured_f0 - r for t, r in zip(recorded.trials, around.by_trial(), strict=True)]
            for around in (before[i], after[i])
        ]
        for k, trial in enumerate(recorded.trials):
            held = [heldout.forces(names).get((i, trial.name)) for names in ((), chosen)]
            forces = TrialTraces(
                fibre=study.fibres[i].name,
                trial=trial.name,
                time_s=trial.force_time_s,
                length_l0=np.interp(trial.force_time_s, trial.time_s, trial.length_l0),
                measured_f0=trial.measured_f0,
                start_f0=starts[k],
                before_f0=fits[0][k],
                after_f0=fits[1][k],
                heldout_before_f0=held[0],
                heldout_after_f0=held[1],
                without_f0={n: p[k] for n, p in parts.items() if p is not None},
            )
            found.append(Traced(i, residuals[k], forces))
    return found


def _start(study: Searched, i: int) -> list[Array]:
    """Recorded force by the fibre file as given; zeros where it has no solution."""
    recorded = study.recorded[i]
    try:
        return Problem(study.fibres[i], recorded.trials, (), {}).predicted(np.empty(0))
    except UserError:
        return [np.zeros_like(t.measured_f0) for t in recorded.trials]


def _without(study: Searched, chosen: Names, name: Name, i: int) -> list[Array] | None:
    """The answer without one of its parts; None where the model has no solution then."""
    recorded = study.recorded[i]
    rest = tuple(n for n in chosen if n is not name)
    fit = study.explorer.fits[chosen][i]
    try:
        if name in FRAMES:
            if rest not in study.explorer.fits:
                return None
            problem = recorded.problem(rest, study.explorer.fits[rest][i].values)
            return problem.predicted(problem.start)
        problem = recorded.problem(chosen, fit.values)
        z = problem.start.copy()
        if name in MEASUREMENT:
            for j, c in enumerate(problem.coordinates):
                if c.name == name:
                    z[j] = 0.0
            return problem.predicted(z)
        gone = CATALOGUE[name].absent
        kept = [j for j, c in enumerate(problem.coordinates) if c.name not in gone]
        fibre = problem.fibre_at(z)
        fibre = replace(fibre, values={**fibre.values, **gone})
        bare = replace(problem, fibre=fibre, coordinates=tuple(problem.coordinates[j] for j in kept))
        return bare.predicted(z[kept])
    except UserError:
        return None


def directed(c: Component, traces: Sequence[Traced]) -> Component:
    """A component of the answer with what it does to the force."""
    name = c.members[0]
    adds = [(t.residual, t.forces.adds_f0(name)) for t in traces if name in t.forces.without_f0]
    return replace(c, direction=direction(adds)) if adds else c


def direction(adds_f0: Sequence[tuple[Residual, Array]]) -> str:
    """Where a component raises force most and where it lowers it most, in plain words.

    Args:
        adds_f0: for each trial what the component adds to the force at the residual's times, F0.
    """
    sums: dict[str, list[float]] = {}
    for residual, adds in adds_f0:
        for phase in residual.phases:
            inside = (residual.time_s >= phase.start_s) & (residual.time_s <= phase.end_s)
            if np.any(inside):
                sums.setdefault(phase_words(phase.name), []).append(float(np.mean(adds[inside])))
    if not sums:
        return ""
    means = {phase: float(np.mean(values)) for phase, values in sums.items()}
    up, down = max(means, key=lambda p: means[p]), min(means, key=lambda p: means[p])
    parts = []
    if means[up] > _LEAST_F0:
        parts.append(f"raises force in the {up} by {percent(means[up])} % F0")
    if means[down] < -_LEAST_F0:
        parts.append(f"lowers it in the {down} by {percent(-means[down])} % F0")
    if len(parts) == 1 and means[up] <= _LEAST_F0:
        parts = [parts[0].replace("lowers it", "lowers force")]
    text = " and ".join(parts)
    return f"{text} on average" if text else "changes force by less than 0.05 % F0 on average in every phase"
