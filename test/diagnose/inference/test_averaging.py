"""Inclusion probabilities of sets whose evidence is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from by_hand import DRAG, EFFECTIVE, LATTICE, NOISE_F0, SHIFT, STIFFNESS, TITIN, VISCO, explorer, fit, with_odds

from xb_muscle_ros.diagnose.inference.averaging import averaged, by_family, grouped
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.search.explore import Explorer


def test_probabilities_of_sets_and_names_add_up_as_by_hand() -> None:
    found = averaged(with_odds(((), 0.0), ((DRAG,), 2.0), ((SHIFT,), 1.0), ((DRAG, SHIFT), 2.5)))
    weights = {(): 1.0, (DRAG,): math.exp(2.0), (SHIFT,): math.exp(1.0), (DRAG, SHIFT): math.exp(2.5)}
    total = sum(weights.values())
    for names, p in zip(found.sets, found.probability, strict=True):
        assert p == pytest.approx(weights[names] / total)
    drag = (weights[DRAG,] + weights[DRAG, SHIFT]) / total
    assert found.including([DRAG]) == pytest.approx(drag)
    assert found.including([DRAG, SHIFT]) == pytest.approx(1.0 - 1.0 / total)
    assert found.including([TITIN]) == 0.0
    assert found.log_odds([DRAG]) == pytest.approx(math.log(drag / (1.0 - drag)))
    assert found.log_odds([TITIN]) == -math.inf
    assert averaged(with_odds(((DRAG,), 0.0))).log_odds([DRAG]) == math.inf


def test_evidence_counts_odds_fit_priors_and_their_width() -> None:
    e = explorer({(): [fit((), -3.0)], (DRAG,): [fit((DRAG,), -1.0, occam=0.7)]})
    assert e.evidence((DRAG,)) - e.evidence(()) == pytest.approx(2.0 - 0.7 + math.log(0.1))
    assert Explorer.odds((DRAG, SHIFT)) == pytest.approx(math.log(0.1) + math.log(0.05))


def test_of_several_fibres_the_evidence_adds_up_and_each_has_its_own() -> None:
    e = explorer({(): [fit((), 0.0), fit((), 0.0)], (DRAG,): [fit((DRAG,), 6.0), fit((DRAG,), -1.0)]}, 2)
    both, first, second = averaged(e), averaged(e, [0]), averaged(e, [1])
    assert both.log_odds([DRAG]) == pytest.approx(5.0 + math.log(0.1))
    assert first.log_odds([DRAG]) == pytest.approx(6.0 + math.log(0.1))
    assert second.log_odds([DRAG]) == pytest.approx(-1.0 + math.log(0.1))


def test_a_set_that_only_a_line_tells_of_counts_less_than_the_best_fitted_one() -> None:
    e = explorer({(): [fit((), 0.0, mean_square_f0=1e-5)]})
    e.promised[DRAG,] = (4e-6,)
    found = averaged(e)
    by_hand = 0.5 * EFFECTIVE * math.log((NOISE_F0**2 + 1e-5) / (NOISE_F0**2 + 4e-6)) - 1.5 + math.log(0.1)
    assert by_hand > 0.0
    # It may not be the best by what it only promises.
    assert found.log_odds([DRAG]) == pytest.approx(-1.0)
    assert list(found.fitted) == [True, False]
    e.promised[DRAG,] = (9.5e-6,)
    little = 0.5 * EFFECTIVE * math.log((NOISE_F0**2 + 1e-5) / (NOISE_F0**2 + 9.5e-6)) - 1.5 + math.log(0.1)
    assert averaged(e).log_odds([DRAG]) == pytest.approx(little)
    # What would make the residual larger promises nothing.
    e.promised[DRAG,] = (3e-5,)
    assert averaged(e).log_odds([DRAG]) == pytest.approx(-1.5 + math.log(0.1))
    e.unsolved.append((DRAG,))
    assert averaged(e).sets == ((),)


def test_members_of_a_family_that_share_its_probability_are_one_component() -> None:
    found = averaged(with_odds(((), 0.0), ((TITIN,), 5.0), ((STIFFNESS,), 4.5), ((DRAG,), 1.0)))
    groups = grouped(found, [DRAG, TITIN, STIFFNESS])
    assert (TITIN, STIFFNESS) in groups
    assert (DRAG,) in groups
    assert found.including([TITIN, STIFFNESS]) > 0.95 > found.including([TITIN])


def test_a_member_that_is_likely_within_its_family_stands_for_itself() -> None:
    found = averaged(with_odds(((), 0.0), ((TITIN,), 5.0), ((STIFFNESS,), 1.0)))
    assert grouped(found, [TITIN, STIFFNESS]) == [(TITIN,), (STIFFNESS,)]


def test_members_that_act_together_are_two_components() -> None:
    found = averaged(with_odds(((), 0.0), ((TITIN,), 2.0), ((STIFFNESS,), 2.0), ((TITIN, STIFFNESS), 6.0)))
    assert set(grouped(found, [TITIN, STIFFNESS])) == {(TITIN,), (STIFFNESS,)}


def test_artefacts_are_never_grouped() -> None:
    offset, drift = Name.FORCE_OFFSET, Name.FORCE_DRIFT
    found = averaged(with_odds(((), 0.0), ((offset,), 5.0), ((drift,), 5.0)))
    assert set(grouped(found, [offset, drift])) == {(offset,), (drift,)}


def test_names_that_take_each_other_s_place_are_rivals() -> None:
    found = averaged(with_odds(((), 0.0), ((DRAG,), 4.0), ((TITIN,), 3.8), ((DRAG, LATTICE), 3.0)))
    others = [VISCO, TITIN, LATTICE]
    assert found.rivals(DRAG, others) == [TITIN]
    assert found.rivals(TITIN, [DRAG, LATTICE])[0] is DRAG
    sure = averaged(with_odds(((), 0.0), ((DRAG,), 9.0), ((TITIN,), 1.0), ((DRAG, TITIN), 9.0)))
    assert sure.rivals(DRAG, others) == []


def test_families_are_those_of_the_names() -> None:
    found = by_family([DRAG, TITIN, STIFFNESS, VISCO])
    assert found["parallel_viscoelasticity"] == [DRAG, VISCO]
    assert found["calcium_dependent_elasticity"] == [TITIN, STIFFNESS]
    assert np.sum([len(v) for v in found.values()]) == 4


def test_a_contribution_is_what_the_best_set_with_a_name_takes_off() -> None:
    rows = {(): 1e-4, (DRAG,): 4e-5, (TITIN,): 9e-5, (DRAG, TITIN): 3.1e-5}
    e = explorer({names: [fit(names, 9.0 * len(names), mean_square_f0=ms)] for names, ms in rows.items()})
    found = averaged(e)
    assert found.contribution_f0([TITIN]) == pytest.approx(3e-3)
    assert found.contribution_f0([DRAG]) == pytest.approx(math.sqrt(9e-5 - 3.1e-5))
    assert found.contribution_f0([LATTICE]) == 0.0
