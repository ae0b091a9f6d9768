"""The stretch reflex: form, delay, thresholds, muscles."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.reflex import Reflex, ReflexArc, ReflexLoop

TICK_S = 1e-3
NAMES = ("soleus_r", "soleus_l", "gasmed_r")


def test_each_gain_multiplies_what_is_beyond_the_start_and_the_threshold() -> None:
    reflex = Reflex(2.0, 0.1, 0.5, 0.02, 0.01, 0.3)
    arc = ReflexArc(reflex, NAMES, TICK_S)
    length, force = np.array([0.1, 0.2, -0.1]), np.array([0.3, 0.1, 0.0])
    assert not arc.observe(length, force).any()
    stretch, rise = np.array([0.004, 0.02, -0.02]), np.array([0.1, -0.1, 0.05])
    found = arc.observe(length + stretch, force + rise)
    velocity = stretch / TICK_S
    wanted = 2.0 * np.array([0.0, 0.01, 0.0]) + 0.1 * np.maximum(velocity - 0.3, 0.0) + 0.5 * np.array([0.1, 0.0, 0.05])
    assert found == pytest.approx(wanted, rel=1e-12)
    # Held, there is no velocity any more.
    held = arc.observe(length + stretch, force)
    assert held == pytest.approx([0.0, 0.02, 0.0], rel=1e-12)


@pytest.mark.parametrize("ticks", [0, 1, 40])
def test_the_delay_is_exact_to_the_tick(ticks: int) -> None:
    loop = ReflexLoop(ReflexArc(Reflex(1.0, delay_s=ticks * TICK_S), NAMES, TICK_S), np.zeros(3), lambda added: added)
    levels = []
    for k in range(100):
        length = np.full(3, 0.01 * (k >= 10))
        levels.append(loop.observe(length, np.zeros(3)))
        assert len(loop.coming) == ticks
    assert not np.any(levels[: 10 + ticks])
    assert np.all(np.array(levels[10 + ticks :]) == 0.01)


def test_eighty_muscles_of_which_some_have_it() -> None:
    names = [f"{name}_{side}" for side in "lr" for name in ("soleus", *(f"m{i}" for i in range(39)))]
    arc = ReflexArc(Reflex(3.0, muscles=("soleus_*", "m7_l")), names, TICK_S)
    arc.observe(np.zeros(80), np.zeros(80))
    found = arc.observe(np.full(80, 0.1), np.zeros(80))
    assert [names[i] for i in np.flatnonzero(found)] == ["soleus_l", "m7_l", "soleus_r"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Reflex(-1.0), r"length_per_l0 is -1; allowed is 0 to 1000"),
        (lambda: Reflex(float("nan")), r"length_per_l0 is nan"),
        (lambda: Reflex(1.0, delay_s=2.0), r"delay_s is 2; allowed is 0 to 1"),
        (lambda: ReflexArc(Reflex(1.0, delay_s=0.0405), NAMES, TICK_S), r"0.0405; allowed are whole ticks of 0.001 s"),
        (lambda: ReflexArc(Reflex(1.0, muscles=("soleus",)), NAMES, TICK_S), r"'soleus'; did you mean 'soleus_r'"),
    ],
)
def test_what_is_no_reflex_is_refused(make: object, message: str) -> None:
    assert callable(make)
    with pytest.raises(UserError, match=message):
        make()
