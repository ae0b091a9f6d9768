"""The next experiment: which sets it has to tell apart, and which protocol does it best."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_trials import truth

from xb_muscle_ros.diagnose import next_experiment
from xb_muscle_ros.diagnose.component import Component, Kind
from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.diagnose.next_experiment import _pairs, menu, propose, scaled
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import changed
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import simulate_trial

DRAG, TITIN, STIFFNESS, SHIFT = (
    Name.VISCOUS_DRAG, Name.ACTIVE_TITIN, Name.STATIC_CALCIUM_STIFFNESS, Name.PCA_SHIFT,
)  # fmt: skip


def component(probability: float, *names: Name) -> Component:
    kind = Kind.ARTEFACT if names[0] is SHIFT else Kind.MECHANISM
    return Component(names[0], kind, FAMILY[names[0]], names, probability)


SETS: dict[Any, float] = {(): 0.0, (DRAG,): 3.0, (TITIN,): 2.5, (DRAG, TITIN): 2.8, (DRAG, SHIFT): 2.9}


def test_the_least_sure_mechanism_is_told_from_its_absence() -> None:
    pairs = _pairs(SETS, [component(0.9, DRAG), component(0.55, TITIN)])
    assert pairs[0][0] == ((DRAG, TITIN), (DRAG,))
    assert pairs[0][1] == ("active_titin",)
    # Where another takes its place, the two are named.
    assert pairs[1][0] == ((DRAG,), (TITIN,))
    assert pairs[1][1] == ("viscous_drag", "active_titin")


def test_members_of_one_component_are_told_from_each_other() -> None:
    sets: dict[Any, float] = {(): 0.0, (TITIN,): 3.0, (STIFFNESS,): 2.9, (DRAG, STIFFNESS): 2.0}
    ((best, names),) = _pairs(sets, [component(0.97, TITIN, STIFFNESS)])
    assert best == ((TITIN,), (STIFFNESS,))
    assert names == ("active_titin", "static_calcium_stiffness")


def test_what_is_sure_or_no_physics_needs_no_experiment() -> None:
    assert _pairs(SETS, [component(0.005, DRAG), component(0.5, SHIFT)]) == []
    # Nor what all sets have, or none.
    assert _pairs({(DRAG,): 0.0}, [component(0.99, DRAG)]) == []


def test_the_menu_has_every_direction_speed_length_and_solution() -> None:
    found = menu("a", (4.5, 9.0))
    assert len({p.words for p in found}) == len(found) == 2 * 2 * 2 * 3
    for protocol in found:
        t = protocol.trial
        assert t.facts.phases[0].end_s == pytest.approx(0.2)
        assert t.time_s[-1] == pytest.approx(t.facts.phases[-1].end_s, abs=1.1e-3)
        assert abs(float(t.length_m[-1] - t.length_m[0])) == pytest.approx(0.04, abs=1e-3)
        assert not t.force_n.size


def test_the_protocol_where_two_fibres_differ_most_is_proposed() -> None:
    """A drag is seen best in the fastest ramp."""
    one, other = changed(truth("3state_coop+viscous_drag"), {"drag": 0.05}, "test"), truth()
    found = propose(one, other, ("viscous_drag",), (9.0,))
    assert found is not None
    assert found.separates == ("viscous_drag",)
    assert "at 2 L0/s" in found.protocol.words
    forces = [simulate_trial(Muscle(f), found.protocol.trial).force_n for f in (one, other)]
    assert found.difference_f0 == pytest.approx(float(np.sqrt(np.mean((forces[0] - forces[1]) ** 2))))
    assert propose(one, one, (), (9.0,)).difference_f0 == 0.0


def test_a_protocol_in_a_fibre_s_own_units() -> None:
    trial = menu("a", (6.2,))[0].trial
    mine = scaled(trial, 1.2e-3, 5e-4)
    assert mine.length_change_l0 == pytest.approx(trial.length_change_l0)
    assert mine.length_m[0] == pytest.approx(1.2e-3)
    assert mine.facts.f0_n == 5e-4


def linear_fibre(stiffness: float, drag: float) -> Any:
    """A stand-in for a model whose force is known: a spring and a dashpot, F0 = stiffness length + drag velocity."""

    def force(trial: Any) -> Any:
        velocity = np.gradient(trial.length_change_l0, trial.time_s)
        return SimpleNamespace(force_n=stiffness * trial.length_change_l0 + drag * velocity)

    return force


@pytest.mark.parametrize(
    ("one", "other", "words", "difference"),
    [
        # Two springs differ most where length is longest: after the stretch from the longer length, whatever the speed;
        # the fastest ramp leaves the most of the record there.
        ((1.0, 0.0), (3.0, 0.0), "a stretch by 4 % L0 at 2 L0/s from 5 % L0 beyond rest length", 0.166),
        # Two dashpots differ in the ramp alone, most in the fastest: 0.02 F0·s/L0 at 2 L0/s for 20 ms of 1.22 s.
        ((0.0, 0.0), (0.0, 0.02), "at 2 L0/s", 0.04 * np.sqrt(0.02 / 1.22)),
    ],
)  # fmt: skip
def test_the_protocol_is_the_one_of_the_largest_difference(
    one: tuple[float, float], other: tuple[float, float], words: str, difference: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer is known by hand: models whose force is a formula."""
    monkeypatch.setattr(next_experiment, "Muscle", lambda fibre: linear_fibre(*fibre.pair))
    monkeypatch.setattr(next_experiment, "simulate_trial", lambda muscle, trial: muscle(trial))
    pairs = [SimpleNamespace(name="f", pair=pair) for pair in (one, other)]
    found = propose(*pairs, ("a", "b"), (6.2,))
    assert found is not None
    assert words in found.protocol.words
    assert found.separates == ("a", "b")
    assert found.difference_f0 == pytest.approx(difference, rel=0.03)
    # No other protocol of the menu does better.
    for protocol in menu("f", (6.2,)):
        forces = [linear_fibre(*pair)(protocol.trial).force_n for pair in (one, other)]
        assert float(np.sqrt(np.mean((forces[0] - forces[1]) ** 2))) <= found.difference_f0 + 1e-12


def test_protocols_without_a_solution_are_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    def simulate(muscle: Any, trial: Any) -> Any:
        if "stretch" in trial.facts.trial:
            raise UserError("no solution")
        return muscle(trial)

    monkeypatch.setattr(next_experiment, "Muscle", lambda fibre: linear_fibre(*fibre.pair))
    monkeypatch.setattr(next_experiment, "simulate_trial", simulate)
    pairs = [SimpleNamespace(name="f", pair=pair) for pair in ((1.0, 0.0), (3.0, 0.0))]
    found = propose(*pairs, (), (6.2,))
    assert found is not None
    assert "a shortening by 4 % L0" in found.protocol.words
    monkeypatch.setattr(next_experiment, "simulate_trial", lambda *_: simulate(None, menu("f", (6.2,))[0].trial))
    assert propose(*pairs, (), (6.2,)) is None
