"""An explanation's parts have to earn their place on trials that the fits did not see."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from xb_muscle_ros.diagnose.crossval import HeldOut, difference
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.search import Search, penalised


def kept_to_what_foretells(search: Search, scored: Callable[[Sequence[Fit]], dict[str, HeldOut]]) -> dict[str, HeldOut]:
    """Take out of the final explanation what makes predictions of trials left out worse.

    What a fit gains where it was fitted is no reason to keep a part of it.

    Args:
        search: its final explanation is changed.
        scored: held-out scores of fits, by label; none where nothing can be held out.

    Returns:
        all scores that were asked for.
    """
    scores: dict[str, HeldOut] = {}
    while len(names := search.final.explanation.names) > 1:
        shorter = [
            search.fits[e.label] for n in names if (e := search.final.explanation.without(n)).label in search.fits
        ]
        best = min(shorter, key=penalised, default=None)
        if best is None:
            break
        scores |= scored([f for f in (search.final, best) if f.explanation.label not in scores])
        after, before = (scores.get(f.explanation.label) for f in (search.final, best))
        if after is None or before is None or difference(after, before).delta_elpd >= 0.0:
            break
        search.final = best
    return scores
