"""Rows of the record: trials, fibres, nuisance parameters, places and scores."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.diagnose.component import NAMED, Component, Kind
from xb_muscle_ros.diagnose.inference.left_out import left_out
from xb_muscle_ros.diagnose.noise.residuals import Around
from xb_muscle_ros.diagnose.noise.significance import Significance
from xb_muscle_ros.diagnose.residual import Place
from xb_muscle_ros.diagnose.result import NuisanceParameter, OfStudyFibre, OfTrial, Scores
from xb_muscle_ros.diagnose.search.system import Names
from xb_muscle_ros.diagnose.searching import Searched
from xb_muscle_ros.diagnose.tracing import Traced
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.models.parameters import PARAMETERS
from xb_muscle_ros.trials.trial import Array

_MOST_PLACES = 12


def rmsd(values: Array) -> float:
    """Root mean square of differences."""
    return float(np.sqrt(np.mean(values**2)))


def places(names: Sequence[str], found: Sequence[Significance]) -> tuple[Place, ...]:
    """Where residuals stand out: of one fibre as in `Significance.places`, of several the largest place first."""
    rows = [place for name, s in zip(names, found, strict=True) for place in s.places(name)]
    if len(names) > 1:
        rows = sorted(rows, key=lambda p: -p.size_f0)[:_MOST_PLACES]
    return tuple(rows)


def scores(study: Searched, names: Names, i: int | None = None) -> Scores:
    """How far a set is from the recordings, of all fibres or of one."""
    chosen = range(len(study.fibres)) if i is None else [i]
    squares = np.concatenate([study.around(names, k).residual_f0 for k in chosen])
    return Scores(names, rmsd(squares), study.judged.heldout.rmsd(names, i))


def benchmark(study: Searched, before: Sequence[Around]) -> float | None:
    """Held-out RMSD of a discrepancy without physics on top of the base, F0; None where nothing is left out."""
    squares, samples = 0.0, 0
    for recordings, around, folds in zip(study.recordings, before, study.judged.heldout.folds, strict=True):
        found = recordings.benchmark(around, folds) if folds else None
        if found is not None:
            squares, samples = squares + found[0], samples + found[1]
    return float(np.sqrt(squares / samples)) if samples else None


def of_trials(study: Searched, chosen: Names, traces: Sequence[Traced]) -> tuple[OfTrial, ...]:
    """A row for each trial."""
    rows = []
    for t in traces:
        name = t.residual.trial
        noise = study.recordings[t.fibre].noise.of([name]).trials[0]
        held = (study.judged.heldout.rmsd_by_trial(s).get((t.fibre, name), np.inf) for s in ((), chosen))
        held_before, held_after = (value if np.isfinite(value) else None for value in held)
        rows.append(
            OfTrial(
                fibre=study.fibres[t.fibre].name,
                trial=name,
                pca=t.residual.pca,
                phases=tuple((p.name, p.start_s, p.end_s) for p in t.residual.phases),
                noise_sd_f0=noise.sd_f0,
                noise_source=noise.source.value,
                noise_samples=noise.samples,
                before_rmsd_f0=rmsd(t.forces.before_f0 - t.forces.measured_f0),
                after_rmsd_f0=rmsd(t.forces.after_f0 - t.forces.measured_f0),
                heldout_before_f0=held_before,
                heldout_after_f0=held_after,
            )
        )
    return tuple(rows)


def nuisance_parameters(study: Searched, chosen: Names) -> tuple[NuisanceParameter, ...]:
    """Ordinary measurement artefacts as estimated beside the answer and the base."""
    rows = []
    for i, system in enumerate(study.explorer.systems):
        fit, base = study.explorer.fits[chosen][i], study.explorer.fits[()][i]
        for c in system.problem(chosen, fit.values).coordinates:
            if c.group is not None:
                rows.append(
                    NuisanceParameter(
                        fibre=study.fibres[i].name, name=c.name, group=c.group, unit=ARTEFACTS[c.name].unit,
                        value=fit.values[c.label], sd=fit.sds[c.label], prior_sd=system.error_sd(c.name),
                        before=base.values.get(c.label),
                    )
                )  # fmt: skip
    return tuple(rows)


def of_fibres(study: Searched, chosen: Names, found: Sequence[Component]) -> tuple[OfStudyFibre, ...]:
    """A row for each fibre."""
    rows = []
    predicted = left_out(study, chosen) if len(study.fibres) > 1 and chosen else [None] * len(study.fibres)
    for i, fibre in enumerate(study.fibres):
        base = study.explorer.fits[()][i]
        own = [
            (c.by_fibre[i].inclusion_probability, c.members[0])
            for c in found
            if c.kind is Kind.MECHANISM and c.by_fibre[i].inclusion_probability >= NAMED
        ]
        closure = study.recorded[i].closure_f0
        size = rmsd(np.concatenate(list(closure.values()))) if closure else 0.0
        rows.append(
            OfStudyFibre(
                fibre=fibre.name,
                model=study.studies[i].fibre.model,
                trials=len(study.recorded[i].trials),
                answer=tuple(name for _, name in sorted(own, reverse=True)),
                before=scores(study, (), i),
                after=scores(study, chosen, i),
                left_out_rmsd_f0=predicted[i],
                p_value=study.base[i].overall_p,
                base_parameters=tuple(
                    (name, float(fibre.values[name]), value, PARAMETERS[name].unit)
                    for name, value in base.values.items()
                    if name in fibre.values
                ),
                closure_f0=size,
            )
        )
    return tuple(rows)
