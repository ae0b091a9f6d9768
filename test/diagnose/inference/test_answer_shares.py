"""Shares of a mismatch, by hand."""

from __future__ import annotations

import pytest
from by_hand import DRAG, TITIN, ByHand, explorer, fit

from xb_muscle_ros.diagnose.inference.answer import Judged
from xb_muscle_ros.diagnose.inference.heldout import HeldOut

ALL = (DRAG, TITIN)


def judged(e: ByHand) -> Judged:
    """Fits of fibres whose recordings have a noise of 0.1 % F0."""
    return Judged.of(e, HeldOut(e, e.systems), [1e-3] * len(e.systems))


def squares(base: float, drag: float, titin: float, both: float) -> Judged:
    rows = {(): base, (DRAG,): drag, (TITIN,): titin, ALL: both}
    return judged(explorer({names: [fit(names, 0.0, mean_square_f0=value)] for names, value in rows.items()}))


def test_shares_are_of_the_mean_square_beyond_noise() -> None:
    e = squares(1.1e-5, 6e-6, 5e-6, 2e-6)
    assert e.explained(ALL) == pytest.approx(0.9)
    assert e.explained((DRAG,)) == pytest.approx(0.5)
    assert e.explained(()) == 0.0
    # Without titin the drag alone is left, and the other way round.
    assert e.ablation_loss(ALL, (DRAG,)) == pytest.approx(0.4)
    assert e.ablation_loss(ALL, (TITIN,)) == pytest.approx(0.3)


def test_shares_stay_between_nothing_and_all() -> None:
    assert squares(1.1e-5, 6e-6, 5e-6, 0.5e-6).explained(ALL) == 1.0
    assert squares(1.1e-5, 2e-5, 5e-6, 2e-6).explained((DRAG,)) == 0.0
    assert squares(1.1e-5, 1e-6, 5e-6, 2e-6).ablation_loss(ALL, (DRAG,)) == 0.0


def test_where_there_is_no_mismatch_or_no_fit_nothing_is_explained() -> None:
    e = squares(0.9e-6, 0.5e-6, 0.5e-6, 0.5e-6)
    assert e.explained(ALL) == 0.0
    assert e.ablation_loss(ALL, (DRAG,)) == 0.0
    missing = judged(explorer({(): [fit((), 0.0, mean_square_f0=1e-5)], ALL: [fit(ALL, 0.0, mean_square_f0=1e-6)]}))
    assert missing.ablation_loss(ALL, (DRAG,)) == 0.0


def test_each_fibre_has_its_own_shares() -> None:
    rows = {(): (1.1e-5, 1.1e-5), (DRAG,): (1e-6, 1.1e-5)}
    e = judged(explorer({n: [fit(n, 0.0, mean_square_f0=v) for v in values] for n, values in rows.items()}, 2))
    assert e.explained((DRAG,)) == pytest.approx(0.5)
    assert e.ablation_loss((DRAG,), (), 0) == pytest.approx(1.0)
