"""The record of a diagnosis, and its files, from a study that was searched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xb_muscle_ros.diagnose import notes, outside, rows
from xb_muscle_ros.diagnose.answers import MECHANISMS
from xb_muscle_ros.diagnose.component import Component
from xb_muscle_ros.diagnose.effort import Effort
from xb_muscle_ros.diagnose.inference.answer import answer_of, components, verdict_of
from xb_muscle_ros.diagnose.names import MEASUREMENT
from xb_muscle_ros.diagnose.next_experiment import plan, scaled
from xb_muscle_ros.diagnose.noise.closure import by_distribution
from xb_muscle_ros.diagnose.noise.residuals import Around
from xb_muscle_ros.diagnose.noise.significance import FLOOR_F0
from xb_muscle_ros.diagnose.outputs import NEXT, Files, augmented_name
from xb_muscle_ros.diagnose.residual import AnswerResidual, ResidualLaw
from xb_muscle_ros.diagnose.result import FORMAT, Diagnosis, NextExperiment, SetOfMechanisms, Verdict
from xb_muscle_ros.diagnose.search.system import Names
from xb_muscle_ros.diagnose.search.whole import beside, only
from xb_muscle_ros.diagnose.searching import Searched
from xb_muscle_ros.diagnose.tracing import directed, traced
from xb_muscle_ros.diagnose.words import percent
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre

# More noise than this hides what is looked for, F0; a base whose residual is more than this share of the force's
# standard deviation does not describe the recordings.
_NOISY_F0, _UNDESCRIBED = 0.02, 0.5
# A residual follows a law that predicts this share of it where it is left out.
_LAW = 0.2
# The fibre file as given is as good as the fitted base within this factor.
_AS_GOOD = 1.2
_MOST_SETS = 40


def recorded(study: Searched, effort: Effort, seed: int) -> tuple[Diagnosis, Files]:
    """What was found, and what goes into files; seconds are left to the caller."""
    judged, chosen = study.judged, study.judged.chosen
    count = len(study.fibres)
    before = [study.around((), i) for i in range(count)]
    after = [study.around(chosen, i) if chosen else before[i] for i in range(count)]
    of_answer = [study.recordings[i].significance(after[i]) if chosen else study.base[i] for i in range(count)]
    traces = traced(study, chosen, before, after)
    found = _by_component([directed(c, traces) for c in components(judged)])
    detected = any(s.detected() for s in study.base)
    described = _described(study, before, after)
    fine = all(
        rows.rmsd(t.start_f0 - t.measured_f0) <= max(_AS_GOOD * rows.rmsd(t.before_f0 - t.measured_f0), FLOOR_F0)
        for t in (each.forces for each in traces)
    )
    verdict = verdict_of(found, described, detected, fine)
    answer = answer_of(found) if described else ()
    names = [f.name for f in study.fibres]
    augmented = _augmented(study, chosen) if answer else {}
    proposal = plan(study, found) if detected or answer else None
    base_law, answer_law = (_law(study, arounds, detected) for arounds in (before, after))
    trials = rows.of_trials(study, chosen, traces)
    warned = [*(w for s in study.studies for t in s.trials for w in t.warnings), *study.lines]
    notes_of_all = _notes(study, chosen, effort)
    if augmented:
        for i in range(count):
            fibres = study.fibre_with(chosen, i), study.fibre_with((), i)
            warned += outside.warnings(*fibres, study.recorded[i].trials)
            notes_of_all.append(_without_errors(study, chosen, i))
        warned += outside.worse_left_out(trials)
    d = Diagnosis(
        format_version=FORMAT,
        fibres=tuple(names),
        model=study.studies[0].fibre.model,
        method=study.fibres[0].method,
        quick=effort != Effort(),
        seed=seed,
        seconds=0.0,
        verdict=verdict,
        answer=answer,
        components=found,
        explained_fraction=judged.explained(chosen) if chosen else 0.0,
        mismatch=rows.places(names, study.base),
        p_value=min(1.0, count * min(s.overall_p for s in study.base)),
        described=described,
        residual=AnswerResidual(
            rmsd_f0=rows.rmsd(np.concatenate([a.residual_f0 for a in after])),
            noise_f0=float(np.median(judged.noise_f0)),
            places=rows.places(names, of_answer),
            law=answer_law,
        ),
        base_law=base_law,
        before=rows.scores(study, ()),
        after=rows.scores(study, chosen),
        heldout_gain=judged.heldout.gain(chosen, ()) if chosen else None,
        benchmark_rmsd_f0=rows.benchmark(study, before),
        sets=_sets(study),
        by_fibre=rows.of_fibres(study, chosen, found),
        trials=trials,
        nuisance_parameters=rows.nuisance_parameters(study, chosen),
        map_before={n: s.map() for n, s in zip(names, study.base, strict=True)},
        map_after={n: s.map() for n, s in zip(names, of_answer, strict=True)},
        next_experiment=None
        if proposal is None
        else NextExperiment(NEXT, proposal.protocol.words, proposal.separates, proposal.difference_f0),
        augmented={f.name: name for name, f in augmented.items()},
        warnings=tuple(dict.fromkeys(warned)),
        missing=tuple(_missing(study, verdict, found, after)),
        notes=tuple(notes_of_all),
        # Of each fibre's two family-wise tests the lesser counts, twice.
        p_value_floor=2.0 / (effort.draws + 1.0),
    )
    d = replace(d, notes=(*d.notes, *notes.of_benchmark(d)))
    protocol = None
    if proposal is not None:
        fibre = study.fibres[0]
        protocol = scaled(proposal.protocol.trial, fibre.reference_length_m, fibre.f0_n)
    return d, Files(augmented, tuple(t.forces for t in traces), protocol)


def _by_component(found: Sequence[Component]) -> tuple[Component, ...]:
    """Rivals by the components that they are or are members of; a component is no rival of itself."""
    of = {name: c.name for c in found for name in c.members}
    rivals = [dict.fromkeys(of.get(name, name) for name in c.not_separable_from) for c in found]
    return tuple(
        replace(c, not_separable_from=tuple(name for name in names if name != c.name))
        for c, names in zip(found, rivals, strict=True)
    )


def _without_errors(study: Searched, chosen: Names, i: int) -> str:
    """A line on what an augmented file does by itself: measurement artefacts are in the fit, not in the fibre."""
    recorded, values = study.recorded[i], study.explorer.fits[chosen][i].values
    problem = recorded.problem(chosen, values)
    z = np.array(
        [c.inward(0.0) if c.group is not None else s for c, s in zip(problem.coordinates, problem.start, strict=True)]
    )
    name = f"fibre {study.fibres[i].name}"
    try:
        forces = problem.predicted(z)
    except UserError:
        return f"{name}: the augmented file has no solution without the measurement artefacts of the fit"
    left = rows.rmsd(np.concatenate([f - t.measured_f0 for f, t in zip(forces, recorded.trials, strict=True)]))
    with_errors = rows.rmsd(study.around(chosen, i).residual_f0)
    return (
        f"{name}: a replay of the augmented file leaves {percent(left)} % F0, because files "
        "have no measurement artefacts (pCa shifts, gain of length, offsets); with those of the fit it is "
        f"{percent(with_errors)} % F0"
    )


def _described(study: Searched, before: Sequence[Around], after: Sequence[Around]) -> bool:
    """Whether there is anything to build on: the model describes the recordings, and noise does not hide all."""
    for i, recorded in enumerate(study.recorded):
        spread = float(np.std(recorded.measured))
        residual = min(rows.rmsd(before[i].residual_f0), rows.rmsd(after[i].residual_f0))
        if study.judged.noise_f0[i] > _NOISY_F0 or residual > _UNDESCRIBED * spread:
            return False
    return True


def _law(study: Searched, arounds: Sequence[Around], detected: bool) -> ResidualLaw | None:
    """The law of the fibre whose residual follows one best; None where none does."""
    if not detected:
        return None
    laws = [recordings.law(around) for recordings, around in zip(study.recordings, arounds, strict=True)]
    found = [law for law in laws if law is not None and law.explained_fraction >= _LAW]
    return max(found, key=lambda law: law.explained_fraction, default=None)


def _sets(study: Searched) -> tuple[SetOfMechanisms, ...]:
    averages = study.judged.averages
    chances = averages.probability
    return tuple(
        SetOfMechanisms(
            names=averages.sets[k],
            probability=float(chances[k]),
            log_evidence=float(averages.log_evidence[k]),
            rmsd_f0=float(np.sqrt(averages.mean_square_f0[k])),
            fitted=bool(averages.fitted[k]),
        )
        for k in np.argsort(-averages.log_evidence)[:_MOST_SETS]
    )


def _augmented(study: Searched, chosen: Names) -> dict[str, Fibre]:
    """Fibres with the answer's mechanisms, by file name.

    Where the Gaussian form's own error was taken out, they go by the distribution, which does not have it.
    """
    names = tuple(n for n in chosen if n not in MEASUREMENT)
    made = {}
    for i, given in enumerate(study.fibres):
        fibre = only(study.fibre_with(chosen, i), given, names)
        fibre = by_distribution(fibre) if study.recorded[i].closure_f0 else fibre
        words = " and ".join(names)
        trials = len(study.recorded[i].trials)
        source = f"fitted by this package to {trials} trials of fibre {fibre.name}, with {words} (diagnosed)"
        made[augmented_name(given.name, len(study.fibres) > 1)] = replace(fibre, source=source)
    return made


def _missing(study: Searched, verdict: Verdict, found: Sequence[Component], after: Sequence[Around]) -> list[str]:
    """What a firmer answer would need, a line each."""
    lines = []
    if not study.judged.heldout:
        lines.append("at least three trials, so that some can be held out: without that no mechanism is sure")
    for i, recorded in enumerate(study.recorded):
        name, noise = study.fibres[i].name, study.judged.noise_f0[i]
        if noise > _NOISY_F0:
            lines.append(f"force with less noise: {100 * noise:.1f} % F0 in fibre {name} hides what is looked for")
        if rows.rmsd(after[i].residual_f0) > _UNDESCRIBED * float(np.std(recorded.measured)):
            lines.append(
                "recordings that the model describes at all: after the fit the residual of fibre "
                f"{name} is half of its force's variation; check that channels, units, calcium and fibre fit"
            )
    if all(t.facts.pca is None or t.facts.pca < 8.0 for s in study.studies for t in s.trials):
        lines.append("a trial without calcium (pCa 9), which tells passive from active effects")
    if verdict is Verdict.AMBIGUOUS and all(c.heldout_gain is None or not c.heldout_gain.beyond_error for c in found):
        lines.append("more conditions: nothing predicts those left out better than its standard error")
    return lines


def _notes(study: Searched, chosen: Names, effort: Effort) -> list[str]:
    lines = list(notes.of_effort(effort, {s.fibre.name: len(s.trials) for s in study.studies}))
    several = len(study.fibres) > 1
    for i, each in enumerate(study.studies):
        own = [
            *each.notes,
            *notes.of_order([t.facts.trial for t in each.trials]),
            *notes.of_folds(study.recorded[i].trials, study.judged.heldout.folds[i]),
            *notes.of_fibre(
                each.fibre, each.trials, study.recordings[i], study.explorer.systems[i], study.explorer.fits[chosen][i]
            ),
        ]
        lines += [f"fibre {study.fibres[i].name}: {line}" if several else line for line in own]
    allowed = set.intersection(*(set(beside(f)) for f in study.fibres))
    left_out = [n for n in MECHANISMS if n not in allowed]
    return [*lines, *notes.of_search(study.explorer.unsolved, left_out)]
