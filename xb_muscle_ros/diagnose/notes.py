"""What a diagnosis assumed, left out or did not look at: one line each, so that nothing of it is silent."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from xb_muscle_ros.diagnose.catalogue import CATALOGUE, applicable
from xb_muscle_ros.diagnose.mismatch import Recordings
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.search import Effort, Search
from xb_muscle_ros.diagnose.words import human
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.scores.noise.model import Source
from xb_muscle_ros.scores.noise.trials import ENOUGH
from xb_muscle_ros.trials.trial import Trial

# A fault this many of its usual sizes large is at the edge of what is plausible.
_EDGE = 2.0
# A value this near a bound, as a share of the way between bounds, ended there.
_AT_BOUND = 1e-3
# Trials, length or force that move less than this do not move, F0 and L0.
_MOVES = 1e-6
_MOST_NAMES = 6


def notes(given: Fibre, trials: Sequence[Trial], recordings: Recordings, search: Search, shown: Fit) -> list[str]:
    """Lines on everything that a reader would not guess.

    Args:
        given: fibre as it was given.
        trials: that were diagnosed.
        recordings: with their noise.
        search: with all fits.
        shown: the fit that stands for the answer.
    """
    coordinates = shown.problem(search.study).coordinates
    return [
        *_inputs(given, trials),
        *_noise(recordings),
        *_closure(search),
        *_bounds(coordinates),
        *_edges(coordinates),
        *_candidates(search),
    ]


def of_effort(effort: Effort, usual: Effort, trials: int) -> list[str]:
    """Lines on how hard was looked, and what could not be held out.

    Args:
        effort: of this diagnosis.
        usual: without `--quick`.
        trials: how many there are.
    """
    lines = []
    if effort != usual:
        lines.append(
            f"this is a quick diagnosis: at most {effort.steps} explanations together (else {usual.steps}), "
            f"{effort.candidates} fitted at first ({usual.candidates}), {effort.folds} groups left out in turn "
            f"({usual.folds}), {effort.draws} repeats ({usual.draws}), no profile"
        )
    if trials < 3:
        lines.append(
            f"nothing could be left out of the fit: there {'is 1 trial' if trials == 1 else f'are {trials} trials'}, "
            "at least 3 are needed, so no explanation is named"
        )
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
        yield "length never changes in these trials: what only a stretch or a shortening shows was not looked for"
    elif still:
        yield f"length never changes in {_named(still)}"
    solutions = {t.facts.pca for t in trials}
    if len(trials) > 1 and len(solutions) == 1 and None not in solutions:
        pca = next(iter(solutions))
        yield f"all trials are at pCa {pca:g}: what changes with calcium cannot be told from what does not"
    bare = [t.facts.trial for t in trials if not t.facts.phases]
    if bare:
        yield f"no phases are known of {_named(bare)}: such a trial is looked at as a whole"


def _noise(recordings: Recordings) -> Iterator[str]:
    of = recordings.noise.trials
    few = [n.trial for n in of if n.source is not Source.OTHERS and n.samples < ENOUGH]
    curve = [n.trial for n in of if n.source is Source.CURVE]
    others = [n.trial for n in of if n.source is Source.OTHERS]
    rough = [n.trial for n in of if n.source is Source.DIFFERENCES]
    if rough:
        yield (
            f"the noise of {_named(rough)} was taken from the differences of neighbouring samples, as nothing holds "
            "still or moves steadily for long enough: slow noise is not seen"
        )
    if curve:
        yield f"the noise of {_named(curve)} was taken from what smooth curves leave of force"
    if others:
        yield f"the noise of {_named(others)} was taken to be like that of the other trials"
    if few and sum(n.samples for n in of) < ENOUGH:
        yield f"the noise is known from {sum(n.samples for n in of)} samples of force in all, which is little"


def _closure(search: Search) -> Iterator[str]:
    if search.study.closure_f0:
        largest = max(float(np.max(np.abs(v))) for v in search.study.closure_f0.values())
        yield (
            "the error of the Gaussian form of the heads' strain was taken out of every model, up to "
            f"{100.0 * largest:.2g} % F0"
        )


def _bounds(coordinates: Sequence[Coordinate]) -> Iterator[str]:
    ended = [c.name for c in coordinates if c.group is None and _at_bound(c)]
    if ended:
        yield f"the fit ended at a bound of {_named(ended)}, so that the value is the bound's and not the recordings'"


def _at_bound(c: Coordinate) -> bool:
    lower, upper, value = (c.inward(x) for x in (c.lower, c.upper, c.start))
    reach = _AT_BOUND * (upper - lower) if np.isfinite(upper - lower) else _AT_BOUND
    # An effect that may be absent sits at 0 where it is.
    return value <= lower + reach or value >= upper - reach


def _edges(coordinates: Sequence[Coordinate]) -> Iterator[str]:
    far = [
        f"{c.name} of {c.group}" if c.group else c.name
        for c in coordinates
        if c.group is not None and abs(c.start - c.prior_mean) >= _EDGE * c.prior_sd
    ]
    if far:
        yield f"larger than such faults usually are, by twice or more: {_named(far)}"


def _candidates(search: Search) -> Iterator[str]:
    model = search.study.fibre.model
    possible = {entry.name for entry in applicable(model)}
    left = [name.value for name in CATALOGUE if name not in possible]
    if left:
        names = _named([human(name) for name in left], len(left))
        yield f"not tried, as model {model} has them already or nothing for them to act on: {names}"
    if search.unsolved:
        yield f"no solution was found with {_named(list(dict.fromkeys(search.unsolved)))}"


def _named(names: Sequence[str], most: int = _MOST_NAMES) -> str:
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
