"""Fibres in a MuJoCo model: their isometric force, their steps, and what is refused."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.errors import DataWarning, UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.plant.mjcf.muscles import CrossBridgeMuscles

mujoco = pytest.importorskip("mujoco")

MIXED = {"groups": {"soleus_*": {"model": "hill"}, "*_l": {"tendon": "rigid"}}}
Array = np.ndarray[Any, np.dtype[np.float64]]


def at_posture(model: Any, seed: int) -> Any:
    """Somewhere near the standing leg: hips and feet moved, knees (which are coupled) left straight."""
    data = mujoco.MjData(model)
    data.qpos[:] = model.key_qpos[0]
    rng = np.random.default_rng(seed)
    coupled = {*model.eq_obj1id.tolist(), *model.eq_obj2id.tolist()}
    for joint in range(model.njnt):
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE and joint not in coupled:
            data.qpos[model.jnt_qposadr[joint]] += rng.uniform(-0.2, 0.2)
    mujoco.mj_forward(model, data)
    return data


@pytest.mark.slow
@pytest.mark.parametrize(("activation", "share"), [(1.0, 0.05), (0.0, 0.15)])
def test_every_muscle_is_as_strong_as_mujocos_at_several_postures(leg: Any, activation: float, share: float) -> None:
    """To a share of its force, or of a tenth of F0 where it pulls less."""
    own = copy.copy(leg)
    muscles = CrossBridgeMuscles(leg)
    data = mujoco.MjData(own)
    for seed in range(4):
        at = at_posture(leg, seed)
        data.qpos[:] = at.qpos
        data.act[:] = activation
        mujoco.mj_forward(own, data)
        expected = -data.actuator_force[muscles.index]
        found = muscles.isometric_force_n(at, activation)
        assert (np.abs(found - expected) <= share * np.maximum(expected, 0.1 * muscles.f0_n)).all()


@pytest.mark.slow
@pytest.mark.parametrize("table", [{}, {"default": {"tendon": "elastic"}}, MIXED], ids=["rigid", "elastic", "mixed"])
@pytest.mark.filterwarnings("ignore::xb_muscle_ros.errors.DataWarning")
def test_fibres_settle_at_the_isometric_force(leg: Any, table: dict[str, Any]) -> None:
    muscles = CrossBridgeMuscles(leg, table)
    data = at_posture(leg, 1)
    for activation in (0.0, 0.3, 1.0):
        pulls = muscles.reset(data, muscles.calcium_um(activation))
        assert (data.ctrl[muscles.index] == -pulls).all()
        expected = muscles.isometric_force_n(data, activation)
        np.testing.assert_allclose(pulls / muscles.f0_n, expected / muscles.f0_n, atol=1e-6)
        # Hill-type models have a floor of 0.01.
        np.testing.assert_allclose(muscles.activation, activation, atol=0.01)


def test_a_hanging_arm_settles_and_its_ticks_repeat_to_the_bit(arm: Callable[..., Any]) -> None:
    def run() -> bytes:
        model = arm()
        muscles, data = CrossBridgeMuscles(model), mujoco.MjData(model)
        muscles.reset(data, muscles.calcium_um(0.1))
        pulls = [muscles.step(data, (0.3 * (k > 50), 0.05)) for k in range(200)]
        assert (pulls[-1] > 0.0).all()
        return b"".join([*(pull.tobytes() for pull in pulls), data.qpos.tobytes()])

    assert run() == run()


@pytest.mark.slow
def test_muscles_are_fibres_of_a_batch_to_the_bit(leg: Any) -> None:
    """Eighty together, of two models, are what each is alone."""
    muscles = CrossBridgeMuscles(leg, {"groups": {"soleus_*": {"model": "3state_coop_rigid"}}})
    data = at_posture(leg, 2)
    calcium = muscles.calcium_um(np.linspace(0.05, 0.5, len(muscles)))
    muscles.reset(data, calcium)
    alone = [MuscleBatch([fibre]) for fibre in muscles.fibres]
    length = muscles.length_change_l0(data)
    states = [b.settle(length[k : k + 1], calcium[k : k + 1]) for k, b in enumerate(alone)]
    for _ in range(20):
        mujoco.mj_step1(leg, data)
        pulls = muscles.advance(data, calcium)
        mujoco.mj_step2(leg, data)
        length = muscles.length_change_l0(data)
        # The step was to the length before `mj_step2`, which moves the body but leaves lengths.
        states = [
            b.step(s, length[k : k + 1], calcium[k : k + 1], 1e-3)
            for k, (b, s) in enumerate(zip(alone, states, strict=True))
        ]
        each = np.array([b.outputs(s)["force_f0"][0] for b, s in zip(alone, states, strict=True)])
        assert (muscles.f0_n * each).tobytes() == pulls.tobytes()
    shown = muscles.outputs()
    assert (shown["force_f0"] * muscles.f0_n).tobytes() == pulls.tobytes()


def test_activation_is_mujocos_and_acts_from_the_beginning_of_a_step(arm: Callable[..., Any]) -> None:
    model = arm()
    own = copy.copy(model)
    muscles, data, theirs = CrossBridgeMuscles(model), mujoco.MjData(model), mujoco.MjData(own)
    muscles.reset(data)
    assert (muscles.activation == 0.0).all()
    for k in range(100):
        theirs.ctrl[:] = (0.8, 0.1 * (k % 3))
        muscles.step(data, theirs.ctrl)
        mujoco.mj_step(own, theirs)
        assert muscles.activation.tobytes() == theirs.act.tobytes()


def test_a_change_of_length_that_no_fibre_has_leaves_the_states(arm: Callable[..., Any]) -> None:
    model = arm()
    muscles, data = CrossBridgeMuscles(model), mujoco.MjData(model)
    muscles.reset(data, 1.0)
    before = muscles.outputs()["force_f0"]
    mujoco.mj_step1(model, data)
    data.actuator_length[1] = -5.0
    with pytest.raises(UserError, match=r"fibre extensor: length change is .* allowed is -1 to 10"):
        muscles.advance(data, np.ones(2))
    assert muscles.outputs()["force_f0"].tobytes() == before.tobytes()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (np.nan, "excitation of flexor is nan; allowed are finite numbers"),
        ((0.1, np.inf), "excitation of extensor is inf"),
        ((0.1, 0.2, 0.3), r"excitation has shape \(3,\); needed is \(2,\) or one number"),
        ("much", "excitation is no array of numbers"),
    ],
)
def test_excitation_that_is_none_is_refused(arm: Callable[..., Any], given: Any, said: str) -> None:
    model = arm()
    muscles, data = CrossBridgeMuscles(model), mujoco.MjData(model)
    muscles.reset(data)
    with pytest.raises(UserError, match=said):
        muscles.step(data, given)
    assert data.time == 0.0


def test_activation_beyond_its_range_is_refused(arm: Callable[..., Any]) -> None:
    muscles = CrossBridgeMuscles(arm())
    with pytest.raises(UserError, match=r"activation of extensor is 1.2; allowed is 0 to 1"):
        muscles.calcium_um((0.5, 1.2))


def test_a_model_that_is_refused_stays_as_it_is(arm: Callable[..., Any]) -> None:
    model = arm()
    before = model.actuator_gaintype.copy(), model.actuator_actadr.copy()
    with pytest.raises(UserError, match="no muscle 'flexr'; did you mean 'flexor'"):
        CrossBridgeMuscles(model, {"muscles": {"flexr": {}}})
    with pytest.raises(UserError, match=r"muscle flexor: model hill.* has no series element"):
        CrossBridgeMuscles(model, {"default": {"model": "hill", "tendon": "elastic"}})
    assert (model.actuator_gaintype == before[0]).all()
    assert (model.actuator_actadr == before[1]).all()


def test_tendons_that_have_no_length_and_force_ranges_are_told(arm: Callable[..., Any]) -> None:
    model = arm(first='lengthrange="0.2 0.35" range="1.0 1.4" force="500" forcelimited="true" forcerange="-100 0"')
    with pytest.warns(DataWarning) as told:
        CrossBridgeMuscles(model, {"default": {"tendon": "elastic"}})
    lines = sorted(str(line.message) for line in told)
    assert [line.split(":")[0] for line in lines] == ["flexor", "force ranges of flexor are left out"]


def test_the_public_name_is_this_class() -> None:
    assert xb.CrossBridgeMuscles is CrossBridgeMuscles


def test_calcium_of_a_tick_is_a_number_or_one_for_each_muscle(arm: Callable[..., Any]) -> None:
    """More numbers than muscles are not taken in part."""
    model = arm()
    muscles, data = CrossBridgeMuscles(model), mujoco.MjData(model)
    muscles.reset(data, 0.5)
    mujoco.mj_step1(model, data)
    assert muscles.advance(data, 0.5).shape == (2,)
    for calcium in ([0.5] * 3, [[0.5, 0.5]]):
        with pytest.raises(UserError, match=r"calcium has shape .*; needed is \(2,\) or one number"):
            muscles.advance(data, calcium)


def test_a_time_step_beyond_the_time_constants_is_named(arm: Callable[..., Any]) -> None:
    model = arm()
    model.opt.timestep = 0.02
    muscles, data = CrossBridgeMuscles(model), mujoco.MjData(model)
    muscles.reset(data)
    muscles.step(data, 1.0)
    with pytest.raises(
        UserError, match=r"activation of flexor is [0-9.]+; allowed is 0 to 1; the time step is too long"
    ):
        muscles.step(data, 1.0)


def test_data_of_another_model_is_refused(arm: Callable[..., Any]) -> None:
    """MuJoCo would read and write beyond its arrays; data of a copy will do."""
    model = arm()
    muscles = CrossBridgeMuscles(model)
    muscles.reset(mujoco.MjData(copy.copy(model)), 0.1)
    other = mujoco.MjData(arm(before='<motor joint="elbow"/>'))
    for call in (muscles.reset, muscles.step):
        with pytest.raises(UserError, match="data is of a model with 3 actuators, the muscles are of one with 2"):
            call(other, 0.1)
        with pytest.raises(UserError, match="data is of type MjModel; needed is an MjData"):
            call(model, 0.1)


def test_time_that_goes_back_asks_for_a_reset(arm: Callable[..., Any]) -> None:
    """Both by hand and by the engine, which begins anew after a step that became unstable."""
    model = arm()
    muscles, data = CrossBridgeMuscles(model), mujoco.MjData(model)
    muscles.reset(data, 0.1)
    for _ in range(3):
        muscles.step(data, 0.1)
    mujoco.mj_resetData(model, data)
    with pytest.raises(UserError, match=r"time of data went back from 0\.002 to 0 s .* settle them by reset"):
        muscles.step(data, 0.1)
    muscles.reset(data, 0.1)
    muscles.step(data, 0.1)
    muscles.step(data, 0.1)
    data.qvel[0] = np.nan
    with pytest.raises(UserError, match=r"time of data went back from 0\.001 to 0 s"):
        muscles.step(data, 0.1)


def test_an_integrator_that_is_changed_later_is_refused(arm: Callable[..., Any]) -> None:
    model = arm()
    muscles, data = CrossBridgeMuscles(model), mujoco.MjData(model)
    muscles.reset(data, 0.1)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(UserError, match="the model's integrator is RK4"):
        muscles.step(data, 0.1)


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({"parameters": {"Fscale": 3.0}}, "Fscale is set such that the fibre pulls with one F0"),
        ({"fibre": "18Dec2017"}, "fibre '18Dec2017' is not known; did you mean '18Dec2017"),
    ],
)
def test_the_muscle_of_a_wrong_entry_is_named(arm: Callable[..., Any], entry: dict[str, Any], said: str) -> None:
    with pytest.raises(UserError, match=f"extensor.*{said}"):
        CrossBridgeMuscles(arm(), {"muscles": {"extensor": entry}})


@pytest.mark.parametrize("way", ["copy", "deepcopy", "pickle"])
def test_copies_step_on_with_the_same_bits_and_states_of_their_own(arm: Callable[..., Any], way: str) -> None:
    """Of two models side by side; a search that tries several continuations needs it."""
    model = arm()
    muscles, data = CrossBridgeMuscles(model, {"muscles": {"extensor": {"model": "hill"}}}), mujoco.MjData(model)
    muscles.reset(data, muscles.calcium_um(0.1))
    for _ in range(5):
        muscles.step(data, (0.8, 0.1))
    ways = {"copy": copy.copy, "deepcopy": copy.deepcopy, "pickle": lambda m: pickle.loads(pickle.dumps(m))}
    made, again = ways[way](muscles), copy.copy(data)
    assert (made.model is model) == (way == "copy")
    if way != "copy":
        again = mujoco.MjData(made.model)
        mujoco.mj_copyData(again, made.model, data)
    other = np.array([made.step(again, (0.2, 0.5)) for _ in range(5)])
    pulls = np.array([muscles.step(data, (0.2, 0.5)) for _ in range(5)])
    assert pulls.tobytes() == other.tobytes()
    assert made.activation.tobytes() == muscles.activation.tobytes()


def test_a_copied_environment_keeps_model_and_muscles_together(arm: Callable[..., Any]) -> None:
    class Environment:
        def __init__(self) -> None:
            self.model = arm()
            self.muscles = CrossBridgeMuscles(self.model)

    made = copy.deepcopy(Environment())
    assert made.muscles.model is made.model
    # What is set in the model counts, as before.
    made.model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(UserError, match="integrator is RK4"):
        made.muscles.step(mujoco.MjData(made.model), 0.1)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("0.1 10", r"muscle flexor has operating range 0\.1 to 10 L0, and no fibre settles at 10 L0 .*'0\.75 1\.05'"),
        ("0.5 12", r"no fibre settles at 12 L0 .*length change is 11 L0; allowed is -1 to 10"),
    ],
)
def test_an_operating_range_that_no_fibre_has_is_refused_before_anything_changes(
    arm: Callable[..., Any], given: str, said: str
) -> None:
    model = arm(first=f'lengthrange="0.2 0.35" range="{given}" force="500"')
    before = model.actuator_gaintype.copy()
    with pytest.raises(UserError, match=said):
        CrossBridgeMuscles(model)
    assert (model.actuator_gaintype == before).all()


def test_passive_force_that_is_there_twice_is_told_with_the_muscles(arm: Callable[..., Any]) -> None:
    with pytest.warns(DataWarning, match=r"^flexor, extensor: passive force is there twice .*\(kpe 0\.1\)"):
        CrossBridgeMuscles(arm(), {"default": {"parameters": {"kpe": 0.1}}})


def test_fibres_alone_are_shorter_by_the_stretch_of_an_elastic_tendon(arm: Callable[..., Any]) -> None:
    """By what the tendon's curve says at the fibre's pull; on a rigid tendon nothing is taken away, to the bit."""
    muscles = CrossBridgeMuscles(arm(), {"muscles": {"flexor": {"tendon": "elastic"}}})
    change = np.array([0.1, -0.05])
    force = np.array([0.6, 0.3])
    found = muscles.fibre_change_l0(change, force)
    assert found[1] == change[1]
    # De Groote et al. (2016): f = 0.2 exp(35 (l - 0.995)) - 0.25, less the length at which f is 0.
    stretch = np.log((0.6 + 0.25) / 0.2) / 35.0 - np.log(0.25 / 0.2) / 35.0
    assert change[0] - found[0] == pytest.approx(stretch * muscles.slack_m[0] / muscles.l0_m[0], rel=1e-12)
    assert muscles.fibre_change_l0(change, np.array([-1e-3, 0.0])).tolist() == change.tolist()
