"""What a diagnosis assumed, left out or did not look at: one line each, so that nothing of it is silent."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from xb_muscle_ros.diagnose.effort import Effort
from xb_muscle_ros.diagnose.noise.residuals import Recordings
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.diagnose.search.descent import Fit
from xb_muscle_ros.diagnose.search.system import SATURATING, Names, System, at_bound, label
from xb_muscle_ros.diagnose.words import human, percent
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.scores.noise.model import Source
from xb_muscle_ros.scores.noise.trials import ENOUGH
from xb_muscle_ros.trials.trial import Trial

# A nuisance parameter this many prior SDs large is at the edge of what is ordinary.
_EDGE = 2.0
# Length that moves less than this does not move, L0.
_MOVES = 1e-6
_MOST_NAMES = 6


def of_effort(effort: Effort, trials: Mapping[str, int]) -> list[str]:
    """Lines on how hard was looked, and what could not be held out, from the number of trials of each fibre."""
    lines, usual = [], Effort()
    if effort != usual:
        lines.append(
            f"this is a quick diagnosis: at most {effort.steps} names in a set (else {usual.steps}), "
            f"{effort.candidates} candidates fitted at each step ({usual.candidates}), {effort.folds} "
            f"groups left out in turn ({usual.folds}), {effort.draws} repeats of the bootstrap ({usual.draws})"
        )
    few = {name: count for name, count in trials.items() if count < 3}
    for name, count in few.items():
        of = f" of fibre {name}" if len(trials) > 1 else ""
        lines.append(
            f"nothing{of} could be left out of the fit: there {'is 1 trial' if count == 1 else f'are {count} trials'}, "
            f"at least 3 are needed{', so no mechanism is sure' if len(few) == len(trials) else ''}"
        )
    return lines


def of_benchmark(d: Diagnosis) -> list[str]:
    """A line on a benchmark that the base beats."""
    if not d.benchmark_is_beaten:
        return []
    return [
        f"the non-parametric discrepancy benchmark ({percent(d.benchmark_rmsd_f0 or 0.0)} % F0 held out) is worse than "
        f"the base model ({percent(d.before.heldout_rmsd_f0 or 0.0)} % F0): it says nothing of what could be predicted"
    ]


def of_fibre(given: Fibre, trials: Sequence[Trial], recordings: Recordings, system: System, shown: Fit) -> list[str]:
    """Lines on one fibre: its inputs, its noise, and how the fit that stands for the answer (`shown`) ended."""
    coordinates = system.problem(shown.names, shown.values).coordinates
    return [
        *_inputs(given, trials),
        *_noise(recordings),
        *_closure(system),
        *_bounds(coordinates),
        *_edges(coordinates, system),
    ]


def of_folds(trials: Sequence[FitTrial], folds: Sequence[Collection[str]]) -> list[str]:
    """A line on trials that stay in every fit."""
    held = set().union(*folds) if folds else set()
    kept = [t.name for t in trials if t.name not in held]
    if not folds or not kept:
        return []
    return [f"{_named(kept)} stayed in every fit: {SATURATING} defines F0, so nothing is predicted there"]


def of_order(names: Sequence[str]) -> list[str]:
    """A line on the order in which run-down counts trials."""
    return [f"run-down is counted in the order of the bags: {_named(names)}"] if len(names) > 1 else []


def of_search(unsolved: Sequence[Names], left_out: Sequence[str]) -> list[str]:
    """Lines on what could not be tried."""
    lines = []
    if unsolved:
        once = list(dict.fromkeys(label(names) for names in unsolved))
        named = "; ".join(once[:_MOST_NAMES])
        more = f" and {len(once) - _MOST_NAMES} more" if len(once) > _MOST_NAMES else ""
        lines.append(f"sets for which the model had no solution, not tried further: {named}{more}")
    if left_out:
        lines.append(f"mechanisms that do not go with the base model, or are part of it: {', '.join(left_out)}")
    return lines


def _inputs(given: Fibre, trials: Sequence[Trial]) -> Iterator[str]:
    smoothing = float(given.values.get("smoothing", 0.0))
    if smoothing:
        yield (
            f"the fibre file's smoothing of {smoothing:g} was switched off: what smooth functions blur is no physics "
            "to be looked for"
        )
    still = [t.facts.trial for t in trials if np.ptp(t.length_change_l0) < _MOVES]
    if len(still) == len(trials):
        yield "length never moves in these trials: what length does to force cannot be seen in them"
    elif still:
        yield f"length never moves in {_named(still)}"
    dead = [t.facts.trial for t in trials if t.facts.trial not in still and t.force_n.size and np.ptp(t.force_n) == 0.0]
    if dead:
        yield f"force is the same in every sample of {_named(dead)} though length moves: check the force channel"
    if len({t.facts.pca for t in trials}) == 1:
        yield "all trials are at one pCa: errors of calcium and of calcium's effects cannot be separated"
    bare = [t.facts.trial for t in trials if not t.facts.phases]
    if bare:
        yield f"no phases are known or found of {_named(bare)}: a mismatch there is not located within the trial"


def _noise(recordings: Recordings) -> Iterator[str]:
    rows = recordings.noise.trials
    for source, words in (
        (Source.CURVE, "from the residual of smooth curves through force"),
        (Source.DIFFERENCES, "from what neighbouring samples do not predict of each other"),
        (Source.OTHERS, "from the other trials"),
    ):
        named = [row.trial for row in rows if row.source is source]
        if named:
            yield f"noise was taken {words} in {_named(named)}"
    if sum(row.samples for row in rows) < ENOUGH:
        yield f"noise is known from {sum(row.samples for row in rows)} samples only"


def _closure(system: System) -> Iterator[str]:
    if system.closure_f0:
        size = float(np.sqrt(np.mean(np.concatenate([v**2 for v in system.closure_f0.values()]))))
        yield (
            f"the Gaussian form's own error, {100.0 * size:.2f} % F0, was taken out (by the distribution's force at "
            "the base's fit)"
        )


def _bounds(coordinates: Sequence[Coordinate]) -> Iterator[str]:
    at = [f"{c.label} at {c.start:.3g}" for c in coordinates if at_bound(c, c.inward(c.start))]
    if at:
        yield f"coordinates that ended at a bound: {', '.join(at)}"


def _edges(coordinates: Sequence[Coordinate], system: System) -> Iterator[str]:
    far = [
        f"{human(c.name)}{f' of {c.group}' if c.group else ''} {c.start:.3g} (ordinary: {system.error_sd(c.name):.3g})"
        for c in coordinates
        if c.group is not None and abs(c.start) > _EDGE * system.error_sd(c.name)
    ]
    if far:
        yield f"ordinary measurement artefacts beyond {_EDGE:g} of their usual sizes: {', '.join(far)}"


def _named(names: Sequence[str]) -> str:
    shown = ", ".join(names[:_MOST_NAMES])
    more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return f"{'trial' if len(names) == 1 else 'trials'} {shown}{more}"
