"""Stimulation to calcium."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.activation import CalciumTransient, force_drop, stimulated_intervals

TRANSIENT = CalciumTransient(rest_um=0.05, tetanus_um=8.0, rise_s=0.055, decay_s=0.027)
TIME_S = np.arange(1000) / 1000


def test_without_stimulation_calcium_rests() -> None:
    assert TRANSIENT.at(TIME_S, ()).tolist() == [0.05] * 1000
    times, calcium = TRANSIENT.samples(TIME_S, ())
    assert (times.tolist(), calcium.tolist()) == ([0.0], [0.05])


def test_rise_and_decay_have_their_time_constants() -> None:
    calcium = TRANSIENT.at(TIME_S, ((0.1, 0.7),))
    assert calcium[:101] == pytest.approx(np.full(101, 0.05))
    assert calcium[155] == pytest.approx(8.0 - 7.95 / np.e)  # one rise_s after the begin
    assert calcium[700] == pytest.approx(8.0, rel=1e-4)
    assert calcium[727] - 0.05 == pytest.approx((calcium[700] - 0.05) / np.e)  # one decay_s after the end


@given(
    edges=st.lists(st.floats(0.0, 0.9), min_size=2, max_size=8, unique=True).map(sorted),
    rise_s=st.floats(0.01, 0.2),
    decay_s=st.floats(0.01, 0.2),
)
def test_it_solves_its_equation(edges: list[float], rise_s: float, decay_s: float) -> None:
    transient = CalciumTransient(0.05, 8.0, rise_s, decay_s)
    on = list(zip(edges[::2], edges[1::2], strict=False))
    level, start_s, expected = 0.05, 0.0, {}
    for goal, tau, end_s in [each for begin, end in on for each in ((0.05, decay_s, begin), (8.0, rise_s, end))] + [
        (0.05, decay_s, 1.0)
    ]:
        solved = solve_ivp(lambda _, c, g=goal, k=tau: (g - c) / k, (start_s, end_s), [level], rtol=1e-9, atol=1e-12)
        level, start_s = float(solved.y[0, -1]), end_s
        expected[end_s] = level
    times = np.array(sorted(expected))
    assert transient.at(times, on) == pytest.approx([expected[t] for t in times], rel=1e-6)


def test_samples_hold_calcium_to_a_thousandth() -> None:
    on = ((0.1, 0.3), (0.35, 0.5))
    times, kept = TRANSIENT.samples(TIME_S, on)
    held = kept[np.searchsorted(times, TIME_S, side="right") - 1]
    assert held == pytest.approx(TRANSIENT.at(TIME_S, on), rel=1.1e-3)
    assert times.size < 700


@pytest.mark.parametrize(
    ("values", "words"),
    [((0.0, 8, 1, 1), "rest_um is 0"), ((0.05, 8, np.nan, 1), "rise_s is nan"), ((9, 8, 1, 1), "rest is 9 µM")],
)
def test_values_that_make_no_sense_are_refused(values: tuple[float, ...], words: str) -> None:
    with pytest.raises(UserError, match=words):
        CalciumTransient(*values)


def test_pulses_become_tetani() -> None:
    signal = np.zeros(1000)
    for begin in (100, 110, 120, 500, 510):
        signal[begin : begin + 5] = 8.0
    assert stimulated_intervals(TIME_S, signal, 1.0, 0.015) == ((0.1, 0.125), (0.5, 0.515))
    assert len(stimulated_intervals(TIME_S, signal, 1.0, 0.004)) == 5
    assert stimulated_intervals(TIME_S, signal, 9.0, 0.015) == ()
    assert stimulated_intervals(TIME_S, np.ones(1000), 0.5, 0.0) == ((0.0, 0.999),)


def _tetanus(noise: float, end_s: float, decay_s: float) -> tuple[np.ndarray, np.ndarray]:
    """A tetanus from 1 s, stretched at 3 s (force jumps, then relaxes), that ends; 100 Hz."""
    time_s = np.arange(1200) / 100
    force = np.where(time_s < 1.0, 0.0, 20.0 * (1 - np.exp(-np.maximum(time_s - 1.0, 0) / 0.1)))
    force += np.where(time_s >= 3.0, 6.0 * np.exp(-np.maximum(time_s - 3.0, 0) / 0.3), 0.0)
    force = np.where(time_s < end_s, force, force * np.exp(-np.maximum(time_s - end_s, 0) / decay_s))
    return time_s, force + noise * np.random.default_rng(4).standard_normal(time_s.size)


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize("decay_s", [0.1, 0.4])
def test_the_end_of_a_tetanus_is_where_force_drops(noise: float, decay_s: float) -> None:
    time_s, force = _tetanus(noise, 9.0, decay_s)
    assert force_drop(time_s, force, 1.0) == pytest.approx(9.0, abs=0.08)


def test_a_force_that_does_not_drop_has_no_end() -> None:
    time_s = np.arange(1200) / 100
    passive = np.interp(time_s, [0, 2, 5, 12], [0.5, 0.5, 7.5, 6.5])
    assert force_drop(time_s, passive, 1.0) is None
    assert force_drop(time_s[:10], passive[:10], 0.0) is None


# Read off plots of the records: where force starts to fall at the end of stimulation, s.
CAT = {"fig5_trial31": 9.95, "fig6and7A_trial50": 9.95, "fig7C_trial65": 7.55, "fig7C_trial59": 7.65}


@pytest.mark.parametrize("name", list(CAT))
def test_the_end_is_found_in_the_cat(shared_data: object, name: str) -> None:
    file = f"{shared_data}/recordings/cat_soleus_herzog_leonard_2002/{name}.csv"
    time_s, _, force = np.loadtxt(file, delimiter=",", skiprows=1).T
    assert force_drop(time_s, force, 1.0) == pytest.approx(CAT[name], abs=0.1)
