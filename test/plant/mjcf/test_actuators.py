"""What a model says of its muscles is read as MuJoCo reads it, and plain forces act as they are told."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.mjcf.actuators import make_plain, read_muscles
from xb_muscle_ros.plant.mjcf.own_force import OwnForce

mujoco = pytest.importorskip("mujoco")

FIRST = 'lengthrange="0.2 0.35" range="0.6 1.4" force="500" lmin="0.5" lmax="1.6"'


def standing(model: Any) -> Any:
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    return data


def test_force_length_and_slack_are_those_of_mujocos_muscle(leg: Any) -> None:
    """At several postures of the leg, passive and at full activation."""
    muscles = read_muscles(leg)
    own = [OwnForce(mujoco, *row) for row in zip(muscles.fl_min, muscles.fl_max, muscles.fp_max, strict=True)]
    data = standing(leg)
    rng = np.random.default_rng(5)
    for _ in range(5):
        data.qpos[7:] = leg.key_qpos[0][7:] + rng.uniform(-0.3, 0.3, leg.nq - 7)
        for activation in (0.0, 1.0):
            data.act[:] = activation
            mujoco.mj_forward(leg, data)
            length = (data.actuator_length[muscles.index] - muscles.slack_m) / muscles.l0_m
            expected = [
                activation * o.active(np.array([x]))[0] + o.passive_f0(np.array([x]))[0]
                for o, x in zip(own, length, strict=True)
            ]
            np.testing.assert_allclose(-data.actuator_force[muscles.index] / muscles.f0_n, expected, atol=1e-9)


def test_force_of_scale_where_none_is_given(arm: Callable[..., Any]) -> None:
    model = arm(first='lengthrange="0.2 0.35" force="-1" scale="80"')
    assert read_muscles(model).f0_n[0] == pytest.approx(80.0 / model.actuator_acc0[0])


def test_two_halves_are_mujocos_step_to_the_bit(leg: Any) -> None:
    whole, halves = standing(leg), standing(leg)
    rng = np.random.default_rng(0)
    for _ in range(200):
        whole.ctrl[:] = halves.ctrl[:] = rng.uniform(0.0, 1.0, leg.nu)
        mujoco.mj_step(leg, whole)
        mujoco.mj_step1(leg, halves)
        mujoco.mj_step2(leg, halves)
    for name in ("qpos", "qvel", "act", "qacc_warmstart", "actuator_force"):
        assert getattr(whole, name).tobytes() == getattr(halves, name).tobytes()


def test_plain_forces_move_the_body_as_the_muscles_do_to_the_bit(leg: Any) -> None:
    plain = copy.copy(leg)
    make_plain(plain, read_muscles(leg).index)
    own, forced = standing(leg), standing(plain)
    rng = np.random.default_rng(1)
    for _ in range(200):
        own.ctrl[:] = rng.uniform(0.0, 1.0, leg.nu)
        mujoco.mj_step1(leg, own)
        mujoco.mj_step2(leg, own)
        mujoco.mj_step1(plain, forced)
        forced.ctrl[:] = own.actuator_force
        mujoco.mj_step2(plain, forced)
        assert forced.actuator_force.tobytes() == own.actuator_force.tobytes()
        assert forced.qfrc_actuator.tobytes() == own.qfrc_actuator.tobytes()
        assert forced.qpos.tobytes() == own.qpos.tobytes()


def test_control_is_the_force_whatever_stands_in_act(leg: Any) -> None:
    make_plain(leg, read_muscles(leg).index)
    data = standing(leg)
    force = np.random.default_rng(2).uniform(0.0, 5000.0, leg.nu)
    data.act[:] = 0.7
    data.ctrl[:] = -force
    mujoco.mj_forward(leg, data)
    assert data.actuator_force.tobytes() == (-force).tobytes()
    mujoco.mj_step(leg, data)
    assert (data.act == 0.7).all()


def test_other_actuators_stay_as_they_are(arm: Callable[..., Any]) -> None:
    model = arm(before='<motor name="motor" joint="elbow" ctrllimited="true" ctrlrange="-1 1" gear="3"/>')
    muscles = read_muscles(model)
    assert muscles.index.tolist() == [1, 2]
    make_plain(model, muscles.index)
    data = mujoco.MjData(model)
    data.ctrl[:] = (5.0, -7.0, 0.0)
    mujoco.mj_forward(model, data)
    assert data.actuator_force.tolist() == [1.0, -7.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"muscles": '<motor joint="elbow"/>'}, r"no muscles among its 1 actuators; give it one with <muscle"),
        (
            {"first": "", "compiler": '<lengthrange mode="none"/>'},
            r"muscle flexor has length range 0 to 0.*mj_setLengthRange",
        ),
        ({"first": 'lengthrange="0.2 0.3" force="0"'}, r"muscle flexor has peak force 0 N; allowed is above 0"),
        ({"integrator": "RK4"}, r"RK4, which asks for forces four times a step.*INT_IMPLICITFAST"),
    ],
)
def test_refusals_are_one_line_with_the_remedy(arm: Callable[..., Any], changes: dict[str, str], said: str) -> None:
    with pytest.raises(UserError, match=said) as error:
        read_muscles(arm(**changes))
    assert "\n" not in str(error.value)


def test_an_operating_range_that_falls_is_refused(arm: Callable[..., Any]) -> None:
    """MuJoCo's compiler sees to it as well; a model can be changed afterwards."""
    model = arm()
    model.actuator_gainprm[0, :2] = 1.2, 0.8
    with pytest.raises(UserError, match=r"muscle flexor has operating range 1.2 to 0.8 L0; needed is range='low high'"):
        read_muscles(model)


def test_a_muscle_weakened_by_its_gain_alone_keeps_its_passive_force(arm: Callable[..., Any]) -> None:
    model = arm()
    model.actuator_gainprm[0, 2] *= 0.5
    muscles = read_muscles(model)
    assert muscles.f0_n[0] == 250.0
    own = OwnForce(mujoco, muscles.fl_min[0], muscles.fl_max[0], muscles.fp_max[0])
    data = mujoco.MjData(model)
    compared = 0
    for angle in np.linspace(0.0, 2.0, 21):
        data.qpos[0] = angle
        mujoco.mj_forward(model, data)
        length = (data.actuator_length[:1] - muscles.slack_m[:1]) / muscles.l0_m[:1]
        assert own.passive_f0(length)[0] * 250.0 == pytest.approx(-data.actuator_force[0], abs=1e-9)
        compared += data.actuator_force[0] < -1.0
    assert compared


def test_active_and_passive_force_of_other_lengths_are_refused(arm: Callable[..., Any]) -> None:
    for place, said in ((1, "operating range 0.6 to 1.4 in gainprm and 0.6 to 1.3 in biasprm"), (5, "lmax 1.6 in")):
        model = arm()
        model.actuator_biasprm[0, place] -= 0.1
        with pytest.raises(UserError, match=said):
            read_muscles(model)


@pytest.mark.parametrize("last", [np.inf, np.nan])
def test_a_length_range_without_end_is_refused(arm: Callable[..., Any], last: float) -> None:
    model = arm()
    model.actuator_lengthrange[0, 1] = last
    with pytest.raises(UserError, match=r"muscle flexor has length range 0.2 to"):
        read_muscles(model)


def test_a_delay_is_refused(arm: Callable[..., Any]) -> None:
    """It would hold back the fibre's force."""
    if not hasattr(arm(), "actuator_delay"):
        pytest.skip("this version of MuJoCo has no delays")
    with pytest.raises(UserError, match=r"muscle flexor has a delay of 0.003 s.*delay the excitation"):
        read_muscles(arm(first=FIRST + ' nsample="4" delay="0.003"'))


def test_a_muscle_that_is_disabled_is_named(arm: Callable[..., Any]) -> None:
    model = arm(first=FIRST + ' group="3"')
    assert read_muscles(model).warnings == ()
    model.opt.disableactuator = 1 << 3
    (line,) = read_muscles(model).warnings
    assert line.startswith("flexor: disabled by the model's options")
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    (line,) = read_muscles(model).warnings
    assert line.startswith("flexor, extensor: disabled")


def test_a_model_that_was_bridged_before_is_told_of(arm: Callable[..., Any]) -> None:
    model = arm()
    make_plain(model, read_muscles(model).index)
    with pytest.raises(UserError, match="was given this model before: load it again"):
        read_muscles(model)


def test_half_a_muscle_is_refused(arm: Callable[..., Any]) -> None:
    model = arm()
    model.actuator_dyntype[1] = mujoco.mjtDyn.mjDYN_FILTER
    with pytest.raises(UserError, match="actuator extensor has gaintype muscle but another dyntype"):
        read_muscles(model)


def test_what_is_no_model_is_named(arm: Callable[..., Any]) -> None:
    with pytest.raises(UserError, match="model is of type MjData; needed is an MjModel"):
        read_muscles(mujoco.MjData(arm()))
