"""Fibres that hold the stance of MuJoCo's muscles."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import FibreMuscles, make_drive
from xb_muscle_ros.plant.leg.episode import Episode, play
from xb_muscle_ros.plant.leg.measures import BAR_M, held, stiffness_nm_per_rad
from xb_muscle_ros.plant.leg.stance import Stance
from xb_muscle_ros.plant.leg.study import Pair
from xb_muscle_ros.plant.leg.sway import Sway
from xb_muscle_ros.plant.translation import RampAndHold

FIBRE = "18Dec2017a"


def played(
    stance: Stance, model: str, platform: RampAndHold | None, seconds: float, sway: Sway | None = None
) -> Episode:
    body = Body()
    drive = make_drive(load_fibre(FIBRE, model), FIBRE, elastic=False)(body, stance)
    return play(body, drive, stance, platform, sway or Sway(), seconds)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["3state_coop_slack", "hill_se_slack", "hill"])
def test_stance_holds_for_a_second_and_starts_with_the_same_forces(stance: Stance, model: str) -> None:
    made = played(stance, model, None, 1.0)
    found = held(made)
    assert made.end is None
    assert made.time_s[-1] == pytest.approx(1.0)
    assert found["largest_com_m"] is not None
    assert found["largest_com_m"] < 0.01 * BAR_M
    assert made.force_n[0] == pytest.approx(stance.force_n, abs=1e-6)
    assert set(made.driven_by) == {"calcium_um"}


@pytest.mark.slow
def test_cross_bridges_repeat_to_the_last_bit(stance: Stance) -> None:
    first, again = (played(stance, "3state_coop_slack", RampAndHold(), 0.1, Sway(0.01)) for _ in range(2))
    assert first.force_n.tobytes() == again.force_n.tobytes()
    assert first.angle_rad.tobytes() == again.angle_rad.tobytes()


@pytest.mark.slow
def test_only_cross_bridges_lose_stiffness_by_sway(stance: Stance) -> None:
    def stiffness(model: str, sway: Sway) -> float:
        pair = Pair(
            played(stance, model, None, 0.05, sway),
            played(stance, model, RampAndHold(), 0.05, sway),
        )
        found = stiffness_nm_per_rad(pair, 0.05)
        assert found is not None
        return found

    swayed = Sway(0.03, 1.0)
    assert stiffness("3state_coop_slack", swayed) < 0.98 * stiffness("3state_coop_slack", Sway())
    # Without memory there is nothing to lose.
    assert stiffness("hill", swayed) == pytest.approx(stiffness("hill", Sway()), rel=1e-3)


def test_a_force_that_no_calcium_gives(stance: Stance) -> None:
    body = Body()
    at = body.muscles.index("soleus_r")
    force = stance.force_n.copy()
    force[at] = 9e4
    asked = dataclasses.replace(stance, force_n=force)
    table = {"default": {"fibre": FIBRE, "model": "hill"}}
    with pytest.raises(
        UserError, match=r"hill: the stance asks 9e\+04 N of soleus_r, which at this length gives"
    ) as error:
        FibreMuscles(body, asked, table, "hill")
    assert "\n" not in str(error.value)
    assert not np.isnan(stance.force_n).any()
