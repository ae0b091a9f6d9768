"""Calcium transients of single pulses and of trains."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols.calcium import PulseTransient, pulse_train, transient_of, transient_options

SLOW_TWITCH = transient_of({option.name: option.default for option in transient_options()})
TIME_S = np.arange(200_001) * 1e-6


def test_the_default_is_the_published_transient_of_a_slow_twitch_fibre() -> None:
    excess = SLOW_TWITCH.at(TIME_S, [0.01]) - SLOW_TWITCH.rest_um
    half = TIME_S[excess > 0.5 * excess.max()]
    assert excess.max() == pytest.approx(9.4, abs=0.1)  # µM
    assert half[-1] - half[0] == pytest.approx(7.7e-3, abs=0.05e-3)
    assert np.all(excess[TIME_S <= 0.01] == 0.0)


def test_pulses_far_apart_do_not_know_of_each_other() -> None:
    found = SLOW_TWITCH.at(TIME_S, [0.01, 0.15])
    alone = SLOW_TWITCH.at(TIME_S[:50_001], [0.01])
    assert found[140_000:190_001] == pytest.approx(alone, abs=1e-8)


@given(st.floats(1.0, 5000.0), st.floats(0.001, 0.1), st.floats(1.01, 20.0), st.floats(0.5, 20.0))
def test_no_train_passes_the_ceiling_or_falls_below_rest(rate: float, decay: float, ratio: float, peak: float) -> None:
    rise = decay / ratio
    lone = PulseTransient(0.1, 0.1 + peak, rise, decay, 1e9)
    ceiling = 0.1 + 1.2 * peak / lone._largest
    train = PulseTransient(0.1, 0.1 + peak, rise, decay, ceiling)
    pulses = pulse_train(0.0, 0.1, rate)
    found = train.at(TIME_S[::100], pulses)
    assert found.max() <= ceiling
    assert found.min() >= 0.1 - 1e-9
    # Less than the plain sum, but for a single pulse.
    total = sum(lone.at(TIME_S[::100], [pulse]) - 0.1 for pulse in pulses)
    assert np.all(found - 0.1 <= total * (1.0 + 1e-9) + 1e-9)


def test_it_solves_its_equations() -> None:
    # Euler steps of the two decaying parts, pulse by pulse.
    pulses, step = [0.0, 0.004, 0.009], 1e-6
    y = z = 0.0
    limit = SLOW_TWITCH._largest * (SLOW_TWITCH.ceiling_um - SLOW_TWITCH.rest_um)
    made = []
    for k in range(20_000):
        if any(round(pulse / step) == k for pulse in pulses):
            added = (SLOW_TWITCH.peak_um - SLOW_TWITCH.rest_um) * (1.0 - y / limit)
            y, z = y + added, z + added
        made.append(SLOW_TWITCH.rest_um + (y - z) / SLOW_TWITCH._largest)
        y, z = y * (1.0 - step / SLOW_TWITCH.decay_s), z * (1.0 - step / SLOW_TWITCH.rise_s)
    assert SLOW_TWITCH.at(TIME_S[:20_000], pulses) == pytest.approx(np.array(made), abs=0.01)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"rise_s": 0.0057}, "rise is 0.0057 s; it has to be below that of the decay, 0.0057 s"),
        ({"peak_um": 0.05}, "the peak is 0.05 µM; it has to be above rest"),
        ({"ceiling_um": 12.0}, "the ceiling is 12 µM; with this peak .* [(]pCa 4.6.. or less[)]"),
        ({"decay_s": float("nan")}, "decay_s is nan; allowed are numbers above 0"),
    ],
)
def test_what_cannot_be_is_refused(changed: dict[str, float], message: str) -> None:
    with pytest.raises(UserError, match=message):
        PulseTransient(**{**vars(SLOW_TWITCH), **changed})


def test_trains_have_at_least_one_pulse_and_none_at_their_end() -> None:
    assert pulse_train(0.2, 0.0, 50.0) == [0.2]
    assert pulse_train(0.0, 0.1, 50.0) == pytest.approx([0.0, 0.02, 0.04, 0.06, 0.08])
