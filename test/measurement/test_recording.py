"""What each fault does to a recording."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.measurement.recording import given_calcium, given_length, recorded_force

TIME = np.arange(0.0, 0.2, 1e-3)
FORCE = 0.3 + np.interp(TIME, [0.0, 0.05, 0.1, 0.2], [0.0, 0.0, 0.5, 0.1])


def test_no_fault_is_no_change():
    np.testing.assert_array_equal(recorded_force(TIME, FORCE, {}, 3), FORCE)
    np.testing.assert_array_equal(recorded_force(TIME, FORCE, dict.fromkeys(ARTEFACTS, 0.0), 3), FORCE)
    np.testing.assert_array_equal(given_length(FORCE, {}), FORCE)
    np.testing.assert_array_equal(given_calcium(FORCE, {}), FORCE)


def test_calcium_of_a_solution_that_is_a_tenth_higher_in_pca():
    assert given_calcium(np.array([1.0]), {"pca_shift": 0.1})[0] == pytest.approx(0.7943, abs=1e-4)


def test_length_gain_scales_changes():
    assert given_length(np.array([0.0, 0.1]), {"length_gain": 0.03}).tolist() == [0.0, pytest.approx(0.103)]


def test_run_down_adds_up_over_trials():
    assert recorded_force(TIME, FORCE, {"run_down": 0.1}, 2) == pytest.approx(0.81 * FORCE)


def test_offset_and_drift():
    out = recorded_force(TIME, FORCE, {"force_offset": 0.02, "force_drift": 0.5})
    assert out - FORCE == pytest.approx(0.02 + 0.5 * TIME)


def test_shift_moves_force_later():
    out = recorded_force(TIME, FORCE, {"time_shift": 0.002})
    assert out[2:] == pytest.approx(FORCE[:-2])


def test_lag_is_that_of_a_first_order_transducer():
    def slope(t, y):
        return (np.interp(t, TIME, FORCE) - y) / 0.004

    exact = solve_ivp(slope, (0.0, TIME[-1]), FORCE[:1], t_eval=TIME, max_step=5e-4, rtol=1e-9, atol=1e-12).y[0]
    assert recorded_force(TIME, FORCE, {"transducer_lag": 0.004}) == pytest.approx(exact, abs=1e-7)


def test_short_lag_comes_close_to_none():
    assert recorded_force(TIME, FORCE, {"transducer_lag": 1e-9}) == pytest.approx(FORCE, abs=1e-6)
