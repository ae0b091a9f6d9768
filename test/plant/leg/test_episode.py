"""Standing, being pushed and falling."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import OwnMuscles
from xb_muscle_ros.plant.leg.episode import Episode, play
from xb_muscle_ros.plant.leg.measures import BAR_M, growth, held
from xb_muscle_ros.plant.leg.report import _samples, beyond_lengths
from xb_muscle_ros.plant.leg.stance import Stance
from xb_muscle_ros.plant.leg.study import NUDGE, ModelRuns, Pair, pushes, run_model, sways
from xb_muscle_ros.plant.leg.sway import Sway
from xb_muscle_ros.plant.translation import RampAndHold


def played(
    body: Body, stance: Stance, platform: RampAndHold | None, seconds: float, sway: Sway | None = None
) -> Episode:
    return play(body, OwnMuscles(body, stance), stance, platform, sway or Sway(), seconds)


def test_stance_holds_without_a_push(body: Body, stance: Stance) -> None:
    found = held(played(body, stance, None, 1.0))
    assert found["largest_com_m"] is not None
    assert found["largest_com_m"] < 0.01 * BAR_M
    assert found["start_acceleration"] is not None
    assert found["start_acceleration"] < 1e-8


def test_the_stance_is_not_stable(body: Body, stance: Stance) -> None:
    """So that holding it is the start's accuracy, and no merit of the muscles."""
    found = growth(played(body, stance, NUDGE, 1.0))
    assert found["e_fold_s"] is not None
    assert 0.05 < found["e_fold_s"] < 0.5


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_the_body_lags_behind_the_platform(body: Body, stance: Stance, direction: float) -> None:
    made = played(body, stance, RampAndHold(direction * 0.075), 0.1)
    # Until muscles and joints answer, the centre of mass stays where it is in the room.
    fallen_behind = -0.5 * direction * 2.0 * made.time_s**2
    assert made.com_m[20] == pytest.approx(fallen_behind[20], rel=0.15)
    # Dorsiflexion where the ground goes backwards, and a torque against it.
    assert np.sign(made.angle_rad[50, 0] - made.angle_rad[0, 0]) == -direction
    assert np.sign(made.torque_nm[50, 0] - made.torque_nm[0, 0]) == -direction
    assert made.end is None


def test_a_fall_ends_the_episode_with_its_reason(body: Body, stance: Stance) -> None:
    made = played(body, stance, RampAndHold(0.075), 5.0)
    assert made.end is not None
    assert made.end.fell
    assert made.end.reason == "the centre of mass is behind the heels"
    assert made.time_s[-1] == made.end.time_s
    assert 0.3 < made.end.time_s < 2.0


def test_muscles_that_give_up_end_the_episode_too(body: Body, stance: Stance) -> None:
    class Torn(OwnMuscles):
        def advance(self) -> None:
            if body.data.time > 0.05:
                raise UserError("soleus_r is torn")

    made = play(body, Torn(body, stance), stance, None, Sway(), 1.0)
    assert made.end is not None
    assert made.end.reason == "soleus_r is torn"
    assert not made.end.fell
    assert made.time_s[-1] == pytest.approx(0.05, abs=2e-3)


def test_repeats_to_the_last_bit_whatever_was_played_before(body: Body, stance: Stance) -> None:
    first = played(body, stance, RampAndHold(), 0.3)
    played(body, stance, RampAndHold(0.075), 0.7, Sway(0.01))
    again = played(body, stance, RampAndHold(), 0.3)
    other = played(Body(), stance, RampAndHold(), 0.3)
    for made in (again, other):
        assert made.com_m.tobytes() == first.com_m.tobytes()
        assert made.force_n.tobytes() == first.force_n.tobytes()


def test_muscle_without_memory_does_not_know_that_the_body_swayed(stance: Stance) -> None:
    done: list[None] = []
    runs = run_model(OwnMuscles, stance, RampAndHold(), sways((0.0, 0.03), (1.0,)), 0.3, lambda: done.append(None))
    plain, swayed = runs.pairs
    assert swayed.still.com_m == pytest.approx(plain.still.com_m, abs=1e-9)
    assert swayed.pushed.torque_nm == pytest.approx(plain.pushed.torque_nm, abs=1e-5)
    assert plain == Pair(plain.still, runs.pushes[1])
    assert len(done) == len(runs.episodes) == 9
    assert runs.model == "mujoco"


def test_a_fibre_beyond_its_lengths_is_told_once_with_the_time(body: Body, stance: Stance) -> None:
    """Counted from elsewhere, soleus stands short of 1.5 L0 and is stretched beyond; every tick can be written."""
    plain = played(body, stance, RampAndHold(), 0.2)
    assert plain.beyond == ""
    at = body.muscles.index("soleus_r")
    stretched = (plain.soleus_m - body.optimal_m[at]) / body.l0_m[at]
    body.optimal_m[at] += body.l0_m[at] * (stretched[100:102].mean() - 0.5)
    told = played(body, stance, RampAndHold(), 0.2).beyond
    assert told == "the fibre of soleus_r comes to 1.500 L0, beyond 0.5 to 1.5 L0, from t = 0.101 s on"
    still, pushed = played(body, stance, None, 0.2), played(body, stance, RampAndHold(), 0.2)
    runs = ModelRuns(still, still, (pushed, pushed), (Pair(still, pushed),))
    (first, *_) = beyond_lengths(runs)
    assert first == f"backwards 7.5 cm, no sway: {told}"
    rows = [*_samples([runs], 1)]
    assert len(rows) == 201 * len(runs.episodes)
    assert [row["time_s"] for row in _samples([runs], 90)][:4] == [0.0, 0.09, 0.18, 0.2]


def test_pushes_go_both_ways_in_two_sizes() -> None:
    made = [(p.displacement_m, p.speed_m_per_s, p.acceleration_m_per_s2) for p in pushes(RampAndHold(0.08, 0.3, 3.0))]
    assert made == [(-0.04, 0.15, 1.5), (-0.08, 0.3, 3.0), (0.04, 0.15, 1.5), (0.08, 0.3, 3.0)]
