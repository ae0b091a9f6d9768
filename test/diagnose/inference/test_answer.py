"""From probabilities to answer and verdict."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from by_hand import DRAG, NOISE_F0, SHIFT, STIFFNESS, TITIN, explorer, fit, with_odds
from made_trials import given_fibre

from xb_muscle_ros.diagnose.component import Component, HeldOutGain, Kind, OfFibre
from xb_muscle_ros.diagnose.inference.answer import Judged, answer_of, verdict_of
from xb_muscle_ros.diagnose.inference.heldout import HeldOut
from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.diagnose.search.system import System

BETTER = HeldOutGain(0.2, 0.05, "log RMSD ratio", 5, 0.02, 0.016)
NO_BETTER = HeldOutGain(0.04, 0.05, "log RMSD ratio", 5, 0.02, 0.019)


def component(name: Name, probability: float, gain: HeldOutGain | None = BETTER, *others: Name) -> Component:
    kind = Kind.ARTEFACT if name is SHIFT else Kind.MECHANISM
    members = (name, *others)
    return Component(name, kind, FAMILY[name], members, probability, heldout_gain=gain)


TABLE = [
    # Components, described, detected, fine: verdict.
    ((), True, False, True, Verdict.NONE),
    ((), True, False, False, Verdict.PARAMETERS),
    ((), True, True, True, Verdict.UNEXPLAINED),
    ((component(DRAG, 0.95),), True, True, False, Verdict.PHYSICS),
    ((component(DRAG, 0.9),), True, True, False, Verdict.PHYSICS),
    ((component(DRAG, 0.89),), True, True, False, Verdict.AMBIGUOUS),
    ((component(DRAG, 0.99, NO_BETTER),), True, True, False, Verdict.AMBIGUOUS),
    ((component(DRAG, 0.99, None),), True, True, False, Verdict.AMBIGUOUS),
    ((component(DRAG, 0.5),), True, True, False, Verdict.AMBIGUOUS),
    ((component(DRAG, 0.49),), True, True, False, Verdict.UNEXPLAINED),
    ((component(DRAG, 0.49),), True, False, False, Verdict.PARAMETERS),
    ((component(SHIFT, 0.95),), True, True, False, Verdict.MEASUREMENT),
    ((component(SHIFT, 0.95), component(DRAG, 0.3)), True, True, False, Verdict.MEASUREMENT),
    # Physics beside an artefact is physics, and partial physics is.
    ((component(SHIFT, 0.95), component(DRAG, 0.92)), True, True, False, Verdict.PHYSICS),
    ((component(TITIN, 0.6, NO_BETTER), component(DRAG, 0.92)), True, True, False, Verdict.PHYSICS),
    # What does not describe the recordings at all explains nothing.
    ((component(DRAG, 0.99),), False, True, False, Verdict.UNEXPLAINED),
    ((), False, False, True, Verdict.UNEXPLAINED),
]


@pytest.mark.parametrize(("found", "described", "detected", "fine", "verdict"), TABLE)
def test_every_verdict(
    found: tuple[Component, ...], described: bool, detected: bool, fine: bool, verdict: Verdict
) -> None:
    for order in itertools.permutations(found):
        assert verdict_of(order, described, detected, fine) is verdict


def test_the_answer_has_mechanisms_of_evidence_and_a_family_s_likeliest_member() -> None:
    found = [component(SHIFT, 0.99), component(TITIN, 0.8, BETTER, STIFFNESS), component(DRAG, 0.5)]
    assert answer_of(found) == ("active_titin", "viscous_drag")
    assert answer_of([component(DRAG, 0.49)]) == ()


def judged(*rows: tuple[tuple[Name, ...], float]) -> Judged:
    made = with_odds(*rows)
    recorded = [System(given_fibre(), (), np.empty(0), NOISE_F0)]
    return Judged.of(made, HeldOut(made, recorded), [NOISE_F0])


def test_the_chosen_set_has_all_that_is_named_and_no_more() -> None:
    """The best set has a name more, whose own probability is below one half."""
    rows = (((), 0.0), ((DRAG,), 28.0), ((DRAG, TITIN), 28.1), ((DRAG, SHIFT), 28.05))
    found = judged(*rows)
    assert found.probability([DRAG]) > 0.99
    assert found.probability([TITIN]) < 0.5
    assert found.chosen == (DRAG,)


def test_of_a_family_that_is_not_told_apart_one_member_is_chosen() -> None:
    found = judged(((), 0.0), ((TITIN,), 16.0), ((STIFFNESS,), 15.8))
    assert (TITIN, STIFFNESS) in found.groups
    assert found.chosen == (TITIN,)


def test_names_of_evidence_that_no_set_has_together_are_chosen_together() -> None:
    found = judged(((), -20.0), ((DRAG,), 0.0), ((SHIFT,), 0.0), ((DRAG, SHIFT, TITIN), 4.9))
    assert found.probability([DRAG]) > 0.5 < found.probability([SHIFT])
    assert found.chosen == (DRAG, SHIFT)


def test_nothing_of_evidence_leaves_the_base() -> None:
    assert judged(((), 3.0), ((DRAG,), 0.0)).chosen == ()


def test_a_fibre_replicates_what_it_adds_to_the_others() -> None:
    rows = {(): [fit((), 0.0) for _ in range(3)], (DRAG,): [fit((DRAG,), gained) for gained in (6.0, -1.0, 0.9)]}
    e = explorer(rows, 3)
    judged = Judged.of(e, HeldOut(e, e.systems), [NOISE_F0] * 3)
    assert [judged.replication([DRAG], i) for i in range(3)] == pytest.approx([6.0, -1.0, 0.9])
    rated = [OfFibre("a", 0.1, 0.0, None, (), judged.replication([DRAG], i)) for i in range(3)]
    assert [row.replicates for row in rated] == [True, False, False]
    # Nobody looked at a model without it, so nothing can be said.
    only = explorer({(DRAG,): rows[DRAG,]}, 3)
    assert Judged.of(only, HeldOut(only, only.systems), [NOISE_F0] * 3).replication([DRAG], 0) is None


def test_one_fibre_replicates_nothing() -> None:
    e = with_odds(((), 0.0), ((DRAG,), 6.0))
    judged = Judged.of(e, HeldOut(e, e.systems), [NOISE_F0])
    assert judged.replication([DRAG], 0) is None
