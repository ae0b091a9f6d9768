"""The answer that evidence allows, and when there is none: made fits, no simulation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from made_evidence import TRIALS, evidence, fit, scores

from xb_muscle_ros.diagnose import run
from xb_muscle_ros.diagnose.crossval import HeldOut
from xb_muscle_ros.diagnose.mismatch import Bound
from xb_muscle_ros.diagnose.names import Name, Verdict
from xb_muscle_ros.diagnose.verdict import decide, weights_against

DRAG = fit(0.0008, Name.VISCOUS_DRAG)


def test_a_mechanism_that_explains_all_is_named() -> None:
    d = decide(evidence(DRAG, fit(0.004, Name.TIME_SHIFT), fit(0.003, Name.WEAKLY_BOUND_HEADS)))
    assert d.verdict is Verdict.PHYSICS
    assert d.answer == (Name.VISCOUS_DRAG,)
    assert d.family == "parallel_viscoelasticity"
    assert d.confidence > 0.9
    assert all(c.passed for c in d.checks)


def test_nothing_beyond_noise_is_none_or_parameters() -> None:
    quiet = evidence(fit(0.0008), base=0.0008, detected=False, p_value=0.4)
    assert decide(quiet).verdict is Verdict.PARAMETERS
    assert decide(replace(quiet, start_rmsd_f0=0.0009)).verdict is Verdict.NONE
    assert decide(quiet).answer == ()


def test_a_fault_that_explains_all_is_measurement() -> None:
    d = decide(evidence(fit(0.0008, Name.TIME_SHIFT), fit(0.004, Name.VISCOUS_DRAG), interval=None))
    assert d.verdict is Verdict.MEASUREMENT
    assert d.answer == (Name.TIME_SHIFT,)


def test_rivals_of_one_family_leave_the_family() -> None:
    d = decide(evidence(DRAG, fit(0.00082, Name.PASSIVE_VISCOELASTICITY)))
    assert d.verdict is Verdict.PHYSICS
    assert d.answer == (Name.VISCOUS_DRAG, Name.PASSIVE_VISCOELASTICITY)
    assert d.family == "parallel_viscoelasticity"


@pytest.mark.parametrize("rival", [Name.WEAKLY_BOUND_HEADS, Name.TRANSDUCER_LAG])
def test_rivals_of_another_family_or_kind_leave_it_open(rival: Name) -> None:
    d = decide(evidence(DRAG, fit(0.00081, rival)))
    assert d.verdict is Verdict.AMBIGUOUS
    assert set(d.answer) == {Name.VISCOUS_DRAG, rival}
    assert d.family is None


def test_what_does_nothing_beside_the_others_is_no_rival() -> None:
    shift = fit(0.0012, Name.TIME_SHIFT)
    idle = fit(0.0012, Name.LATTICE_SPACING, Name.TIME_SHIFT)
    final = fit(0.00118, Name.VISCOUS_DRAG, Name.TIME_SHIFT)
    search = evidence(final, shift, idle, fit(0.0058, Name.VISCOUS_DRAG)).search
    assert Name.LATTICE_SPACING not in weights_against(search, Name.VISCOUS_DRAG, len(TRIALS))
    assert Name.VISCOUS_DRAG in weights_against(search, Name.VISCOUS_DRAG, len(TRIALS))


def test_rivals_are_no_answer_where_trials_left_out_are_not_predicted() -> None:
    rival = fit(0.00081, Name.TRANSDUCER_LAG)
    worse = {"base": scores(0.006), "viscous_drag": scores(0.007)}
    assert decide(evidence(DRAG, rival, heldout=worse)).verdict is Verdict.UNEXPLAINED
    assert decide(evidence(DRAG, rival, heldout={})).verdict is Verdict.UNEXPLAINED


@pytest.mark.parametrize(
    "against",
    [
        {"p_value": 0.03},
        {"cleaned": 0.3},
        {"interval": (-0.01, 0.03)},
        {"at_bound": True},
        {"heldout": {}},
        {"heldout": {"base": scores(0.006), "viscous_drag": scores(0.007)}},
        {"bound": Bound(0.0016, 0.0014, 0.0001)},
        {"described": False},
    ],
    ids=lambda a: next(iter(a)),
)
def test_no_mechanism_is_named_where_a_condition_fails(against: dict[str, Any]) -> None:
    d = decide(evidence(DRAG, **against))
    assert d.verdict is Verdict.UNEXPLAINED
    assert d.answer == ()


def uneven(*rmsds: float) -> HeldOut:
    return HeldOut({name: rmsd**2 for name, rmsd in zip(TRIALS, rmsds, strict=True)}, dict.fromkeys(TRIALS, 1000))


def test_held_out_gains_have_to_be_those_of_most_trials() -> None:
    before = uneven(*[0.004] * 6, 0.02)
    one_trial = {"base": before, "viscous_drag": uneven(*[0.0041] * 6, 0.008)}
    assert decide(evidence(DRAG, heldout=one_trial)).verdict is Verdict.UNEXPLAINED
    most = {"base": before, "viscous_drag": uneven(*[0.001] * 6, 0.019)}
    assert decide(evidence(DRAG, heldout=most)).verdict is Verdict.PHYSICS


def test_a_fault_of_single_trials_may_miss_one_of_them() -> None:
    drift = fit(0.0008, Name.FORCE_DRIFT)
    heldout = {"base": uneven(*[0.006] * 6, 0.02), "force_drift": uneven(*[0.004] * 6, 0.03)}
    assert decide(evidence(drift, interval=None, heldout=heldout, bound=None)).verdict is Verdict.MEASUREMENT
    worse = {"base": uneven(*[0.006] * 7), "force_drift": uneven(*[0.007] * 7)}
    assert decide(evidence(drift, interval=None, heldout=worse, bound=None)).verdict is Verdict.UNEXPLAINED


def test_faults_that_leave_much_are_no_answer() -> None:
    much = fit(0.0045, Name.FORCE_OFFSET)
    given = evidence(much, base=0.04, interval=None)
    assert decide(given).verdict is Verdict.UNEXPLAINED
    assert decide(evidence(fit(0.0035, Name.FORCE_OFFSET), base=0.04, interval=None)).verdict is Verdict.MEASUREMENT


def test_either_way_to_hold_trials_out_may_reach_the_flexible_bound() -> None:
    ran_away = Bound(1.3 * 0.006, 0.02, 0.001)
    assert decide(evidence(DRAG, bound=ran_away)).verdict is Verdict.PHYSICS
    assert decide(evidence(DRAG, bound=Bound(0.0079, 0.0075, -0.01))).verdict is Verdict.UNEXPLAINED


def test_half_an_explanation_is_none() -> None:
    d = decide(evidence(fit(0.0045, Name.VISCOUS_DRAG)))
    assert d.verdict is Verdict.UNEXPLAINED


def test_a_mechanism_that_only_tidies_up_after_a_fault_is_not_named() -> None:
    shift = fit(0.0012, Name.TIME_SHIFT)
    final = fit(0.001, Name.NONLINEAR_CROSSBRIDGE, Name.TIME_SHIFT)
    d = decide(evidence(final, shift, fit(0.0058, Name.NONLINEAR_CROSSBRIDGE)))
    assert d.verdict is Verdict.MEASUREMENT
    assert d.answer[0] is Name.TIME_SHIFT


def test_weights_are_shares_and_follow_the_fit() -> None:
    e = evidence(DRAG, fit(0.0009, Name.WEAKLY_BOUND_HEADS), fit(0.003, Name.TIME_SHIFT))
    weights = weights_against(e.search, Name.VISCOUS_DRAG, 7)
    assert sum(weights.values()) == pytest.approx(1.0)
    assert weights[Name.VISCOUS_DRAG] > weights[Name.WEAKLY_BOUND_HEADS] > weights[Name.TIME_SHIFT] > 0.0


def test_the_next_experiment_separates_different_mechanisms(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same two in another order are no rival of theirs."""
    pair = fit(0.001, Name.VISCOUS_DRAG, Name.LATTICE_SPACING)
    again = fit(0.00101, Name.LATTICE_SPACING, Name.VISCOUS_DRAG)
    search = evidence(pair, again, fit(0.002, Name.WEAKLY_BOUND_HEADS)).search
    monkeypatch.setattr(run, "propose", lambda _, first, second, pcas: (first, second))
    first, second = run._proposal(search, decide(evidence(pair, again)), [])  # type: ignore[misc]
    assert first is pair
    assert second.explanation.names == (Name.WEAKLY_BOUND_HEADS,)
