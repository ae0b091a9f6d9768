"""The next experiment: which sets it has to tell apart, and which protocol does it best."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from made_trials import truth

from xb_muscle_ros.diagnose.component import Component, Kind
from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.diagnose.next_experiment import menu, propose, scaled
from xb_muscle_ros.diagnose.planning import _pairs
from xb_muscle_ros.models.fibre_file import changed
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import simulate_trial

DRAG, TITIN, STIFFNESS, SHIFT = (
    Name.VISCOUS_DRAG, Name.ACTIVE_TITIN, Name.STATIC_CALCIUM_STIFFNESS, Name.PCA_SHIFT,
)  # fmt: skip


def component(probability: float, *names: Name) -> Component:
    kind = Kind.ARTEFACT if names[0] is SHIFT else Kind.MECHANISM
    return Component(names[0].value, kind, FAMILY[names[0]], tuple(n.value for n in names), probability)


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
    assert propose(one, one, (), (9.0,)).difference_f0 == 0.0  # type: ignore[union-attr]


def test_a_protocol_in_a_fibre_s_own_units() -> None:
    trial = menu("a", (6.2,))[0].trial
    mine = scaled(trial, 1.2e-3, 5e-4)
    assert mine.length_change_l0 == pytest.approx(trial.length_change_l0)
    assert mine.length_m[0] == pytest.approx(1.2e-3)
    assert mine.facts.f0_n == 5e-4
