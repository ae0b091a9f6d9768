"""Sway before the push."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import OwnMuscles
from xb_muscle_ros.plant.leg.stance import Stance
from xb_muscle_ros.plant.leg.sway import SWAY_S, Sway, com_way_m, foremost_rad, lead


@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 1.75])
def test_begins_and_ends_at_the_stance_at_rest(frequency_hz: float) -> None:
    sway = Sway(0.03, frequency_hz)
    assert sway.angle(0.0) == (0.0, 0.0)
    assert sway.angle(SWAY_S) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert sway.angle(0.5 / frequency_hz) == pytest.approx((1.0, 0.0), abs=1e-12)
    # The rate is the slope of the angle.
    at, step = 0.37, 1e-6
    slope = (sway.angle(at + step)[0] - sway.angle(at - step)[0]) / (2.0 * step)
    assert sway.angle(at)[1] == pytest.approx(slope, rel=1e-6)


def test_foremost_posture_stretches_soleus_by_what_was_asked(body: Body, stance: Stance) -> None:
    at = body.muscles.index("soleus_r")
    body.place(stance.qpos)
    start = float(body.data.actuator_length[at])
    angle = foremost_rad(body, stance, 0.03)
    qpos = stance.qpos.copy()
    qpos[body.coordinates("ankle_angle")] += angle
    body.place(qpos)
    assert float(body.data.actuator_length[at]) - start == pytest.approx(0.03 * body.l0_m[at], rel=1e-9)
    assert 0.0 < angle < 0.1
    # As an inverted pendulum: the way of the centre of mass is height times angle.
    assert com_way_m(body, stance, angle) == pytest.approx(0.845 * angle, rel=0.02)


def test_every_tick_is_handed_to_the_muscles_with_its_velocity(body: Body, stance: Stance) -> None:
    lengths, rates = [], []

    class Recorder(OwnMuscles):
        def advance(self) -> None:
            lengths.append(float(body.data.actuator_length[33]))
            rates.append(float(body.data.actuator_velocity[33]))

    assert body.muscles[33] == "soleus_r"
    lead(body, Recorder(body, stance), stance, Sway(0.03, 1.0), foremost_rad(body, stance, 0.03))
    assert len(lengths) == round(SWAY_S / body.tick_s)
    assert max(lengths) - min(lengths) == pytest.approx(0.03 * body.l0_m[33], rel=1e-6)
    assert min(lengths) == lengths[0]
    slopes = (np.array(lengths[2:]) - np.array(lengths[:-2])) / (2.0 * body.tick_s)
    assert np.array(rates[1:-1]) == pytest.approx(slopes, abs=1e-4 * max(rates))
    assert np.array_equal(body.data.qpos, stance.qpos)
    assert not body.data.qvel.any()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((0.2, 1.0), "sway is 20 % of soleus fibre length; allowed is 0 to 10"),
        ((-0.01, 1.0), "sway is -1 %"),
        ((0.01, 0.3), "sway frequency is 0.3 Hz; allowed are multiples of 0.25 up to 5"),
        ((0.01, 0.0), "sway frequency is 0 Hz"),
        ((0.01, float("nan")), "sway frequency is nan Hz"),
    ],
)
def test_sway_that_does_not_end_where_it_began(values: tuple[float, float], message: str) -> None:
    with pytest.raises(UserError, match=message):
        Sway(*values)
