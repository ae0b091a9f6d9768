"""Parts of an explanation that make held-out predictions worse go; made fits, no simulation."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import pytest

from xb_muscle_ros.diagnose.crossval import HeldOut
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.parsimony import kept_to_what_foretells
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.search import Search
from xb_muscle_ros.diagnose.study import Explanation

TRIALS = ("a", "b", "c")


def fit(cost: float, *names: Name) -> Fit:
    explanation = Explanation()
    for name in names:
        explanation = explanation.plus(name)
    return Fit(explanation, {}, cost, 0.001, 1)


BASE, DRAG, SHIFT = fit(1000.0), fit(300.0, Name.VISCOUS_DRAG), fit(500.0, Name.TIME_SHIFT)
BOTH = fit(100.0, Name.VISCOUS_DRAG, Name.TIME_SHIFT)


def search_of(final: Fit, *fits: Fit) -> Search:
    study = SimpleNamespace(trials=[SimpleNamespace(name=t) for t in TRIALS])
    return Search(study, BASE, final, (), None, {f.explanation.label: f for f in (BASE, *fits, final)})  # type: ignore[arg-type]


@pytest.mark.parametrize(("heldout_of_both", "kept"), [(0.002, BOTH), (0.006, DRAG)])
def test_a_part_stays_only_if_it_foretells_more(heldout_of_both: float, kept: Fit) -> None:
    errors = {BOTH.explanation.label: heldout_of_both, DRAG.explanation.label: 0.004}
    asked: list[str] = []

    def scored(fits: Sequence[Fit]) -> dict[str, HeldOut]:
        asked.extend(f.explanation.label for f in fits)
        return {
            f.explanation.label: HeldOut(
                dict.fromkeys(TRIALS, errors[f.explanation.label] ** 2), dict.fromkeys(TRIALS, 100)
            )
            for f in fits
        }

    search = search_of(BOTH, DRAG, SHIFT)
    scores = kept_to_what_foretells(search, scored)
    assert search.final is kept
    # The best of the shorter ones is what it is held against.
    assert asked == [BOTH.explanation.label, DRAG.explanation.label]
    assert set(scores) == set(asked)


def test_one_part_is_never_taken_away_here() -> None:
    search = search_of(DRAG)
    assert kept_to_what_foretells(search, lambda fits: pytest.fail("nothing to ask")) == {}
    assert search.final is DRAG


def test_without_held_out_trials_everything_stays() -> None:
    search = search_of(BOTH, DRAG, SHIFT)
    assert kept_to_what_foretells(search, lambda fits: {}) == {}
    assert search.final is BOTH
