"""Shares of a mismatch, by hand."""

from __future__ import annotations

import pytest
from by_hand import DRAG, TITIN, ByHand, explorer, fit

from xb_muscle_ros.diagnose.inference.shares import explained, unique

NOISE = (1e-3,)
ALL = (DRAG, TITIN)


def squares(base: float, drag: float, titin: float, both: float) -> ByHand:
    rows = {(): base, (DRAG,): drag, (TITIN,): titin, ALL: both}
    return explorer({names: [fit(names, 0.0, mean_square_f0=value)] for names, value in rows.items()})


def test_shares_are_of_the_mean_square_beyond_noise() -> None:
    e = squares(1.1e-5, 6e-6, 5e-6, 2e-6)
    assert explained(e, ALL, NOISE) == pytest.approx(0.9)
    assert explained(e, (DRAG,), NOISE) == pytest.approx(0.5)
    assert explained(e, (), NOISE) == 0.0
    # Without titin the drag alone is left, and the other way round.
    assert unique(e, ALL, (DRAG,), NOISE) == pytest.approx(0.4)
    assert unique(e, ALL, (TITIN,), NOISE) == pytest.approx(0.3)


def test_shares_stay_between_nothing_and_all() -> None:
    assert explained(squares(1.1e-5, 6e-6, 5e-6, 0.5e-6), ALL, NOISE) == 1.0
    assert explained(squares(1.1e-5, 2e-5, 5e-6, 2e-6), (DRAG,), NOISE) == 0.0
    assert unique(squares(1.1e-5, 1e-6, 5e-6, 2e-6), ALL, (DRAG,), NOISE) == 0.0


def test_where_there_is_no_mismatch_or_no_fit_nothing_is_explained() -> None:
    e = squares(0.9e-6, 0.5e-6, 0.5e-6, 0.5e-6)
    assert explained(e, ALL, NOISE) == 0.0
    assert unique(e, ALL, (DRAG,), NOISE) == 0.0
    missing = explorer({(): [fit((), 0.0, mean_square_f0=1e-5)], ALL: [fit(ALL, 0.0, mean_square_f0=1e-6)]})
    assert unique(missing, ALL, (DRAG,), NOISE) == 0.0


def test_each_fibre_has_its_own_shares() -> None:
    rows = {(): (1.1e-5, 1.1e-5), (DRAG,): (1e-6, 1.1e-5)}
    e = explorer({n: [fit(n, 0.0, mean_square_f0=v) for v in values] for n, values in rows.items()}, 2)
    noise = (1e-3, 1e-3)
    assert explained(e, (DRAG,), noise) == pytest.approx(0.5)
    assert unique(e, (DRAG,), (), noise, 0) == pytest.approx(1.0)
