"""The coefficients of the Rosenbrock method of order 3 against the conditions that define it."""

import numpy as np
import pytest

from xb_muscle_ros.stepping import rosenbrock3


def _filled(rows):
    matrix = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        matrix[i, : len(row)] = row
    return matrix


# Back from the form without products: Gamma^-1 = I/gamma - C, alpha = A Gamma, b = M Gamma.
GAMMAS = np.linalg.inv(np.eye(3) / rosenbrock3.GAMMA - _filled(rosenbrock3.C))
ALPHA = _filled(rosenbrock3.A) @ GAMMAS
BETA = ALPHA + GAMMAS
WEIGHTS = np.array(rosenbrock3.M) @ GAMMAS
EMBEDDED = (np.array(rosenbrock3.M) - np.array(rosenbrock3.E)) @ GAMMAS


def _order_2(b):
    return [b.sum(), b @ BETA.sum(1)]


def _order_3(b):
    return [b @ ALPHA.sum(1) ** 2, b @ BETA @ BETA.sum(1)]


def _left_at_infinity(b):
    return 1.0 - b @ np.linalg.solve(BETA, np.ones(3))


def test_method_meets_the_conditions_of_order_3():
    assert _order_2(WEIGHTS) == pytest.approx([1.0, 1 / 2], abs=1e-14)
    assert _order_3(WEIGHTS) == pytest.approx([1 / 3, 1 / 6], abs=1e-14)


def test_embedded_method_meets_those_of_order_2_and_no_more():
    assert _order_2(EMBEDDED) == pytest.approx([1.0, 1 / 2], abs=1e-14)
    assert abs(EMBEDDED @ BETA @ BETA.sum(1) - 1 / 6) > 0.01


def test_one_condition_of_order_4_is_met():
    strict = BETA - np.diag(np.diag(BETA))
    assert WEIGHTS @ strict @ ALPHA.sum(1) ** 2 == pytest.approx(1 / 12 - rosenbrock3.GAMMA / 3, abs=1e-14)


def test_nothing_is_left_of_an_infinitely_stiff_component():
    assert _left_at_infinity(WEIGHTS) == pytest.approx(0.0, abs=1e-13)
    assert _left_at_infinity(EMBEDDED) == pytest.approx(0.5, abs=1e-13)


def test_amplification_stays_below_one_in_the_left_half_plane():
    """On the imaginary axis, which bounds it there (the poles lie at 1/gamma > 0)."""
    z = 1j * np.logspace(-3, 5, 2000)
    r = [abs(1.0 + x * WEIGHTS @ np.linalg.solve(np.eye(3) - x * BETA, np.ones(3))) for x in z]
    assert max(r) <= 1.0 + 1e-12


def test_both_later_stages_look_at_the_end_of_the_step():
    assert ALPHA.sum(1) == pytest.approx([0.0, 1.0, 1.0], abs=1e-14)
