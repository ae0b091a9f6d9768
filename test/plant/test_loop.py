"""Muscle and plant together."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.plant.drives import FibreDrive, without_parallel
from xb_muscle_ros.plant.loop import Trace, run_ankle, run_knee
from xb_muscle_ros.plant.plant import Plant
from xb_muscle_ros.plant.reflex import Reflex
from xb_muscle_ros.plant.report import numbers
from xb_muscle_ros.plant.tendon import tendon_at
from xb_muscle_ros.plant.translation import RampAndHold

MODELS = ("3state_coop", "hill_se", "hill", None)
STILL = RampAndHold(0.0)

pytest.importorskip("mujoco", reason="needs the extra mujoco")


def fibre_of(model: str | None) -> Fibre | None:
    return None if model is None else load_fibre("18Dec2017a", model)


@pytest.fixture(scope="module")
def standing() -> dict[str, Trace]:
    """Rigid tendons, the default platform."""
    traces = [run_ankle(fibre_of(model), RampAndHold()) for model in MODELS]
    return {trace.model: trace for trace in traces}


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("elastic", [False, True])
def test_stance_starts_at_rest_and_stays_until_it_falls(model: str | None, elastic: bool) -> None:
    trace = run_ankle(fibre_of(model), STILL, 0.3, elastic)
    assert abs(trace.start_acceleration_rad_per_s2) < 1e-9
    # Nothing pushes, so nothing moves but by rounding, which the unstable body makes e-fold every 0.3 s.
    assert np.max(np.abs(trace.angle_rad - trace.angle_rad[0])) < 1e-8
    assert np.max(np.abs(trace.force_n - trace.force_n[0])) < 1e-3


def test_all_models_start_at_the_torque_of_the_load(standing: dict[str, Trace]) -> None:
    load = Plant("ankle").load_nm()
    for trace in standing.values():
        assert trace.torque_nm[0] == pytest.approx(load, rel=1e-9)


def test_repeats_to_the_last_bit(standing: dict[str, Trace]) -> None:
    again = run_ankle(fibre_of("3state_coop"), RampAndHold())
    first = standing["3state_coop"]
    assert again.angle_rad.tobytes() == first.angle_rad.tobytes()
    assert again.force_n.tobytes() == first.force_n.tobytes()


def test_backwards_platform_makes_the_body_lean_and_the_soleus_pull(standing: dict[str, Trace]) -> None:
    for trace in standing.values():
        assert trace.angle_rad[100] > trace.angle_rad[0]
        assert trace.force_n[100, 0] > trace.force_n[0, 0]
        assert trace.force_n[100, 1] <= trace.force_n[0, 1]


def test_forward_platform_does_the_opposite() -> None:
    trace = run_ankle(fibre_of("3state_coop"), RampAndHold(0.075), 0.1)
    assert trace.angle_rad[-1] < trace.angle_rad[0]
    assert trace.force_n[-1, 0] < trace.force_n[0, 0]


def test_cross_bridges_answer_length_and_viscous_muscles_velocity(standing: dict[str, Trace]) -> None:
    found = {model: numbers(trace) for model, trace in standing.items()}

    def decline(model: str) -> float:
        early, late = found[model]["stiffness_20ms_mgh"], found[model]["stiffness_100ms_mgh"]
        assert early is not None
        assert late is not None
        return early / late

    # A spring's chordal stiffness is the same early and late; a damper's falls with the time since the start.
    assert decline("3state_coop") < 1.3
    assert decline("hill") > 3.0
    assert decline("mujoco") > 3.0


def test_forces_of_the_loop_are_the_fibre_model_s(standing: dict[str, Trace]) -> None:
    """Lengths from the trace, fed to the model on its own, give the trace's forces."""
    from xb_muscle_ros.models.muscle import Muscle

    fibre = load_fibre("18Dec2017a", "3state_coop")
    trace, muscle = standing["3state_coop"], Muscle(fibre)
    calcium = trace.driven_by["calcium_um"]["soleus"]
    state = muscle.settle(0.0, calcium)
    lengths = np.ascontiguousarray(trace.length_change_l0[:, 0])
    states = muscle.run(state, np.full(lengths.size - 1, 0.001), lengths, np.full(lengths.size, calcium))
    force = muscle.outputs_of(states)["force_f0"] * 7098.0 * np.cos(0.4363)
    assert force == pytest.approx(trace.force_n[:, 0], rel=1e-12)


def test_elastic_tendon_is_softer_and_pulls_as_its_fibre() -> None:
    fibre = fibre_of("3state_coop")
    soft = run_ankle(fibre, RampAndHold(), 0.1, elastic=True)
    stiff = run_ankle(fibre, RampAndHold(), 0.1)
    found, rigid = numbers(soft)["stiffness_100ms_mgh"], numbers(stiff)["stiffness_100ms_mgh"]
    assert found is not None
    assert rigid is not None
    assert found < 0.6 * rigid
    # What the fibre does not take up is the tendon's, and its curve then gives the same force.
    plant = Plant("ankle")
    soleus, cos = plant.muscles[0], float(np.cos(plant.muscles[0].pennation_rad))
    plant.reset(float(soft.angle_rad[-1]))
    stretch = (plant.length_change_l0()[0] - soft.length_change_l0[-1, 0]) * soleus.l0_m / cos
    tendon = tendon_at(float(soft.force_n[0, 0]) / soleus.f0_n, soleus.tendon_slack_m)
    assert stretch > 0.0
    assert tendon.force_f0(stretch) * soleus.f0_n == pytest.approx(float(soft.force_n[-1, 0]), rel=1e-6)


def test_leg_swings_and_comes_to_hang() -> None:
    trace = run_knee(fibre_of("3state_coop"))
    found = numbers(trace)
    assert trace.torque_nm[0] == pytest.approx(4.0, rel=1e-9)
    first, last = found["first_swing_excursion_deg"], found["last_angle_deg"]
    assert first is not None
    assert last is not None
    assert 45.0 < last < 90.0 < first < 120.0


def test_only_cross_bridges_remember_that_the_leg_was_moved() -> None:
    def gain(model: str | None) -> float:
        still, moved = (numbers(run_knee(fibre_of(model), before, 0.35))["angle_300ms_deg"] for before in (False, True))
        assert still is not None
        assert moved is not None
        return moved / still - 1.0

    assert gain("3state_coop") > 0.1
    assert abs(gain("hill")) < 0.005
    assert abs(gain(None)) < 1e-9


def test_run_too_short_for_a_score() -> None:
    found = numbers(run_ankle(None, RampAndHold(), 0.05))
    assert found["stiffness_50ms_mgh"] is not None
    assert found["stiffness_100ms_mgh"] is None
    assert found["sway_300ms_deg"] is None
    assert numbers(run_knee(None, False, 0.05))["first_swing_excursion_deg"] is None


def test_a_body_that_falls_out_of_reach_ends_the_run_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Muscle, time and angle are named; a muscle of no length is no reason for a bare bound."""
    plant = Plant("ankle", own_muscles=False)
    drive = FibreDrive(plant, load_fibre("18Dec2017a"), plant.load_nm(), False)
    drive.pull()
    monkeypatch.setattr(plant, "length_change_l0", lambda: np.array([-1.01, 0.0]))
    with pytest.raises(UserError, match=r"3state_coop, soleus at t = 0.000 s, angle .*-1.01 L0.*shorter --duration"):
        drive.pull()


def test_muscle_too_weak_to_stand() -> None:
    weak = changed(load_fibre("18Dec2017a", "hill_se"), {"act_max": 0.01}, "test")
    plant = Plant("ankle")
    with pytest.raises(UserError, match=r"hill_se: the start of scene ankle needs 0\.1\d+ F0"):
        FibreDrive(plant, weak, plant.load_nm())


def test_knee_muscle_has_no_parallel_element() -> None:
    fibre = without_parallel(load_fibre("18Dec2017a", "3state_coop"))
    assert fibre.values["kpe"] == 0.0
    assert fibre.values["Fpe0"] == 0.0


@pytest.mark.parametrize("model", ["3state_coop", None])
def test_a_reflex_acts_after_its_delay_and_not_a_tick_earlier(model: str | None) -> None:
    """Lengths begin to change at the second sample; calcium then differs `delay` later, force one tick after that."""
    fibre, delay = fibre_of(model), 30
    traces = [run_ankle(fibre, RampAndHold(), 0.3, reflex=reflex) for reflex in (Reflex(), Reflex(2.0, delay_s=0.03))]
    without, having = traces
    first = int(np.flatnonzero(np.any(without.length_change_l0 > without.length_change_l0[0], axis=1))[0])
    assert first == 1
    assert np.flatnonzero(np.any(having.level != without.level, axis=1))[0] == first + delay
    assert np.flatnonzero(np.any(having.force_n != without.force_n, axis=1))[0] == first + delay + 1
    assert np.all(without.level == without.level[0])
    # It holds the body up.
    assert having.angle_rad[-1] < without.angle_rad[-1] - 1e-4
    assert having.level[-1, 0] > having.level[0, 0]


@pytest.mark.parametrize("elastic", [False, True])
def test_a_reflex_with_gains_of_nothing_changes_no_bit(elastic: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even where its whole way is gone: delay, activation stage, table of calcium."""
    fibre = fibre_of("3state_coop")
    plain = run_ankle(fibre, RampAndHold(), 0.1, elastic)
    monkeypatch.setattr(Reflex, "works", True)
    idle = run_ankle(fibre, RampAndHold(), 0.1, elastic, reflex=Reflex())
    assert idle.reflex
    assert idle.force_n.tobytes() == plain.force_n.tobytes()
    assert idle.level.tobytes() == plain.level.tobytes()


def test_a_reflex_repeats_to_the_last_bit() -> None:
    reflex = Reflex(2.0, 0.1, 0.5)
    one, two = (run_ankle(fibre_of("3state_coop"), RampAndHold(), 0.2, reflex=reflex) for _ in range(2))
    assert one.force_n.tobytes() == two.force_n.tobytes()
    assert one.level.tobytes() == two.level.tobytes()


def test_a_run_that_leaves_its_muscles_behind_keeps_what_went_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows up to the last that a muscle answered; why it ended is told."""
    whole = run_ankle(fibre_of("3state_coop"), RampAndHold(), 0.1)
    at = 0.05
    real = Plant.length_change_l0

    def torn(plant: Plant) -> np.ndarray:
        return np.array([-1.01, 0.0]) if plant.time_s >= at - 1e-9 else real(plant)

    monkeypatch.setattr(Plant, "length_change_l0", torn)
    ended = run_ankle(fibre_of("3state_coop"), RampAndHold(), 0.1)
    assert ended.time_s.size == 50
    assert ended.force_n.tobytes() == whole.force_n[:50].tobytes()
    assert "soleus at t = 0.050 s" in ended.ended
    assert ended.remark.startswith("3state_coop: 3state_coop, soleus")
    assert not whole.ended
