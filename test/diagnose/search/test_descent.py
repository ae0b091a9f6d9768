"""The way down: it never goes up, stays within bounds, and ends where the recording was made."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.search.descent import Descent, Fit, fitted
from xb_muscle_ros.diagnose.search.system import INDEPENDENT, System
from xb_muscle_ros.errors import UserError

DRAG = Name.VISCOUS_DRAG


def test_the_drag_and_the_parameters_that_made_the_trials_are_found(system: System, drag_fit: Fit) -> None:
    given = system.fibre.values
    assert drag_fit.values["drag"] == pytest.approx(0.03, rel=0.05)
    # The trials' unit of force is that of the made fibre, for which attachment makes up.
    assert drag_fit.values["kse"] == pytest.approx(1.15 * given["kse"], rel=0.1)
    assert drag_fit.rmsd_f0 < 1e-3
    # The posterior holds the truth, and is narrower than the prior.
    assert abs(drag_fit.values["drag"] - 0.03) < 4.0 * drag_fit.sds["drag"]
    assert drag_fit.sds["drag"] < 0.2 * 0.02


def test_drag_lowers_the_cost_by_far_more_than_it_is_worth_by_chance(
    system: System, base_fit: Fit, drag_fit: Fit
) -> None:
    assert base_fit.rmsd_f0 > 3.0 * drag_fit.rmsd_f0
    assert base_fit.cost(system) - drag_fit.cost(system) > 10.0
    effective = INDEPENDENT * float(np.sum(system.weights))
    by_hand = 0.5 * effective * np.log(system.noise_f0**2 + base_fit.mean_square_f0) + base_fit.prior
    assert base_fit.cost(system) == pytest.approx(by_hand)
    assert base_fit.cost(system, 0.02) > base_fit.cost(system)


@pytest.mark.parametrize("seed", [0, 1])
def test_no_step_goes_up_and_none_leaves_the_bounds(seed: int, system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = system.problem((DRAG,), {})
    descent = Descent(system, problem)
    costs: list[float] = []
    points: list[Any] = []
    plain = Descent._step

    def watched(self: Descent, point: Any, jacobian: Any, cost: float, damping: float) -> Any:
        found = plain(self, point, jacobian, cost, damping)
        if found is not None:
            assert found[1] < cost
            costs.append(found[1])
            points.append(found[0].z)
        return found

    monkeypatch.setattr(Descent, "_step", watched)
    random = np.random.default_rng(seed)
    start = problem.start + random.normal(0.0, 0.2, problem.start.size) * np.minimum(descent.longest, 1.0)
    begun = descent.cost(descent.at(np.clip(start, descent.lower, descent.upper)))
    point, slopes = descent.walk(start, 4, 1e-3)
    assert len(costs) >= 2
    assert np.all(np.diff([begun, *costs]) < 0.0)
    assert descent.cost(point) == costs[-1]
    assert slopes.shape == (system.measured.size, problem.start.size)
    for z in points:
        assert np.all((z >= descent.lower) & (z <= descent.upper))
    moves = np.abs(np.diff([np.clip(start, descent.lower, descent.upper), *points], axis=0))
    assert np.all(moves <= descent.longest * (1.0 + 1e-9))


def test_an_effect_beyond_its_bound_ends_there(system: System) -> None:
    problem = system.problem((DRAG,), {})
    bound = [replace(c, upper=0.012) if c.name == "drag" else c for c in problem.coordinates]
    tight = replace(problem, coordinates=tuple(bound))
    descent = Descent(system, tight)
    point, _ = descent.walk(tight.start, 5, 0.02)
    (place,) = [j for j, c in enumerate(tight.coordinates) if c.name == "drag"]
    assert point.z[place] == pytest.approx(0.012, rel=1e-9)


def test_fewer_jacobians_are_taken_where_asked(system: System) -> None:
    problem = system.problem((), {})
    counts = []
    for most in (1, 3):
        descent = Descent(system, problem)
        descent.walk(problem.start, most, 0.0)
        counts.append(descent.simulated)
    moved = sum(c.group is None for c in problem.coordinates)
    assert moved <= counts[0] < 2 * moved + 10
    assert counts[1] > counts[0]


def test_no_solution_at_the_start_is_the_user_s_to_know(system: System) -> None:
    long = replace(system.trials[0], length_l0=system.trials[0].length_l0 + 20.0)
    lost = replace(system, trials=(long, *system.trials[1:]))
    problem = lost.problem((), {})
    with pytest.raises(UserError, match=f"trial {long.name}: .*length"):
        Descent(lost, problem).walk(problem.start, 2, 0.1)
    assert fitted(lost, (), [{}], 2, 0.1) is None
    assert fitted(lost, (), [{}, {"f": 100.0}], 2, 0.1) is None


def test_of_several_starts_the_best_is_walked_on(system: System, base_fit: Fit) -> None:
    found = fitted(system, (), [{"kse": 5.0, "f": 900.0}, dict(base_fit.values)], 2, 0.1)
    assert found is not None
    assert found.cost(system) <= base_fit.cost(system) + 1e-9


def test_a_fit_and_a_system_come_back_from_plain_data(system: System, drag_fit: Fit) -> None:
    assert Fit.from_json(json.loads(json.dumps(drag_fit.to_json()))) == drag_fit
    closed = replace(system, closure_f0={t.name: 1e-3 * t.length_l0 for t in system.trials})
    again = System.from_json(json.loads(json.dumps(closed.to_json())))
    assert np.array_equal(again.weights, closed.weights)
    assert again.noise_f0 == closed.noise_f0
    assert dict(again.fibre.values) == dict(closed.fibre.values)
    assert (again.fibre.model, again.fibre.method) == (closed.fibre.model, closed.fibre.method)
    for name, values in closed.closure_f0.items():
        assert np.array_equal(again.closure_f0[name], values)
    one, other = (s.problem((DRAG,), drag_fit.values) for s in (closed, again))
    assert np.array_equal(one.start, other.start)
    for a, b in zip(one.predicted(one.start), other.predicted(other.start), strict=True):
        assert np.array_equal(a, b)
