"""Static equilibrium of the standing leg."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.stance import RESIDUAL, Aim, Stance, find_stance
from xb_muscle_ros.plant.leg.statics import demand


def test_nothing_accelerates_in_the_engine(body: Body, stance: Stance) -> None:
    """The solver of MuJoCo, which the search goes without, agrees with it."""
    assert stance.residual < RESIDUAL
    body.place(stance.qpos)
    body.data.act[:] = stance.activation
    body.mj.mj_forward(body.model, body.data)
    assert np.max(np.abs(body.data.qacc)) < 1e-8
    assert -body.data.actuator_force == pytest.approx(stance.force_n, rel=1e-9)


def test_contacts_carry_the_weight_and_nothing_sideways(body: Body, stance: Stance) -> None:
    body.place(stance.qpos)
    body.data.act[:] = stance.activation
    body.mj.mj_forward(body.model, body.data)
    forces = body.contact_forces_n()
    assert forces[:, 0].sum() == pytest.approx(body.mass_kg * 9.81, rel=1e-9)
    assert np.all(forces[:, 0] > 0.0)
    assert np.max(np.abs(forces[:, 1:])) < 1e-6
    touching = {body.model.geom(int(geom)).name[-1] for geom in body.data.contact.geom1}
    assert touching | {body.model.geom(int(geom)).name[-1] for geom in body.data.contact.geom2} >= {"r", "l"}


def test_posture_is_what_was_asked_for(body: Body, stance: Stance) -> None:
    body.place(stance.qpos)
    assert float((body.com_m - body.ankle_m) @ body.FORWARD) == pytest.approx(0.05, abs=1e-4)
    sole = body.sole_points() @ body.FORWARD
    assert sole.min() < float(body.com_m @ body.FORWARD) < sole.max()
    model = body.model
    joints = range(1, model.njnt)
    at = stance.qpos[model.jnt_qposadr[1:]]
    outside = [model.joint(i).name for i in joints if not model.jnt_range[i, 0] < at[i - 1] < model.jnt_range[i, 1]]
    # A joint on its limit would be held by it, and not by muscle.
    assert outside == []
    # Joint equalities are stiff springs: the patella's track gives by 0.4 mm under the pull of the vasti.
    assert np.max(np.abs(stance.qpos - body.coupled(stance.qpos))) < 1e-3


def test_legs_are_alike(body: Body, stance: Stance) -> None:
    half = len(body.muscles) // 2
    assert [name[:-2] for name in body.muscles[:half]] == [name[:-2] for name in body.muscles[half:]]
    assert stance.activation[:half] == pytest.approx(stance.activation[half:], abs=1e-3)
    assert stance.qpos[7:21] == pytest.approx(stance.qpos[21:], abs=1e-5)


def test_no_less_muscle_holds_this_posture(body: Body, stance: Stance) -> None:
    """Another solver, at the same posture, with all degrees of freedom and muscles apart."""
    asked = demand(body, stance.qpos)
    rows, weight = asked.arms * asked.active_n, 1e5
    count = stance.activation.size
    found = lsq_linear(
        np.vstack((weight * rows, np.eye(count))),
        np.concatenate((weight * (asked.load - asked.arms @ asked.passive_n), np.zeros(count))),
        (np.full(count, stance.aim.tone - 1e-9), np.ones(count)),
        method="bvls",
        tol=1e-14,
    ).x
    assert np.max(np.abs(asked.residual(found))) < 1e-3
    assert np.sum(stance.activation**2) < 1.001 * np.sum(found**2)
    assert np.all(stance.activation > stance.aim.tone - 1e-6)
    assert stance.activation.max() < 0.5


def test_tone_is_co_contraction(body: Body, stance: Stance) -> None:
    toned = find_stance(body, Aim(tone=0.05))
    at = body.muscles.index("tibant_r"), body.muscles.index("soleus_r")
    assert np.all(toned.force_n[list(at)] > stance.force_n[list(at)] + 20.0)
    assert toned.residual < RESIDUAL


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"lead_m": 0.3}, r"centre of mass before the ankles is 0.3; allowed is 0 to 0.1 \(m\)"),
        ({"lead_m": float("nan")}, "is nan; allowed"),
        ({"knee_rad": 0.0}, r"knee flexion is 0; allowed is 0.03 to 0.4 \(rad\)"),
        ({"tone": 0.0}, "least activation is 0; allowed is 0.005 to 0.2"),
    ],
)
def test_stances_that_nobody_takes(values: dict[str, float], message: str) -> None:
    with pytest.raises(UserError, match=message) as error:
        Aim(**values)
    assert "\n" not in str(error.value)


def test_no_muscle_is_strong_enough(body: Body) -> None:
    """Gravity ten times as strong: the remedy is named, in one line."""
    body.model.opt.gravity[2] *= 10.0
    with pytest.raises(UserError, match=r"no stance found with the centre of mass 0\.05 m") as error:
        find_stance(body, Aim())
    assert "\n" not in str(error.value)
