"""Conditions left out: which go together, what a set gains over another, and trials that have no solution."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from by_hand import DRAG, explorer, fit
from made_trials import given_fibre

from xb_muscle_ros.diagnose.inference.heldout import LEAST_F0, UNIT, HeldOut, folds_of, predict_task
from xb_muscle_ros.diagnose.search.descent import Fit
from xb_muscle_ros.diagnose.search.system import System
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.work import Options

OPTIONS = Options(processes=0, quiet=True)


def trial(name: str, solution: str, pca: float, samples: int = 50) -> FitTrial:
    time_s = np.arange(samples) / 1e3
    calcium = np.full(samples, 10.0 ** (6.0 - pca))
    return FitTrial(
        name, solution, 0, False, 1.0, None, False, time_s, 0.0 * time_s, calcium, time_s, np.full(samples, 0.5)
    )


def test_whole_solutions_are_left_out_where_each_has_trials_enough() -> None:
    trials = [trial(f"{pca}_{k}", f"pCa {pca}", pca) for pca in (4.5, 6.0, 6.4) for k in range(2)]
    # The solution that defines F0 stays.
    assert folds_of(trials, 8) == [frozenset({f"{pca}_0", f"{pca}_1"}) for pca in (6.0, 6.4)]
    # More solutions than may be left out: spread over them.
    more = [*trials, *(trial(f"6.6_{k}", "pCa 6.6", 6.6) for k in range(2))]
    assert [len(fold) for fold in folds_of(more, 2)] == [4, 4]


def test_single_trials_are_left_out_one_by_one() -> None:
    trials = [trial(str(pca), f"pCa {pca}", pca) for pca in (6.4, 4.5, 9.0, 6.0)]
    assert sorted(folds_of(trials, 8), key=min) == [frozenset({n}) for n in ("4.5", "6.0", "6.4", "9.0")]


def test_no_more_groups_than_asked_for_and_each_spread_over_calcium() -> None:
    trials = [trial(f"{pca:g}", f"pCa {pca:g}", pca) for pca in np.linspace(4.5, 6.6, 10)]
    folds = folds_of(trials, 5)
    assert len(folds) == 5
    assert sorted(n for fold in folds for n in fold) == sorted(t.name for t in trials)
    for fold in folds:
        low, high = sorted(float(n) for n in fold)
        assert high - low > 1.0


def test_fewer_than_three_trials_leave_nothing_out() -> None:
    assert folds_of([trial("a", "x", 6.0), trial("b", "y", 6.2)], 8) == []
    assert not HeldOut(explorer({(): [fit((), 0.0)]}), [System(given_fibre(), (), np.empty(0), 1e-3)])


def by_hand(errors: Mapping[str, tuple[float, float]], fibres: int = 1, samples: tuple[int, ...] = ()) -> HeldOut:
    """Predictions whose errors, base and with drag, are those given of each trial; NaN: no solution."""
    sizes = samples or (50,) * len(errors)
    trials = tuple(trial(n, n, 6.0 + k / 10, size) for k, (n, size) in enumerate(zip(errors, sizes, strict=True)))
    recorded = [System(given_fibre(), trials, np.empty(0), 1e-3)] * fibres
    made = explorer({(): [fit((), 0.0)] * fibres, (DRAG,): [fit((DRAG,), 0.0)] * fibres}, fibres)
    held = HeldOut(made, recorded)
    for place, names in enumerate(((), (DRAG,))):
        found = {(i, t.name): t.measured_f0 + errors[t.name][place] for i in range(fibres) for t in trials}
        held._found[names] = {key: force for key, force in found.items() if np.all(np.isfinite(force))}
    return held


def test_gain_by_hand() -> None:
    held = by_hand({"a": (0.02, 0.01), "b": (0.03, 0.02), "c": (0.01, 0.01)})
    assert held
    logs = np.array([math.log(2.0), math.log(1.5), 0.0])
    found = held.gain((DRAG,), ())
    assert found is not None
    assert found.mean == pytest.approx(np.mean(logs))
    assert found.se == pytest.approx(np.std(logs, ddof=1) / math.sqrt(3.0))
    assert (found.unit, found.conditions) == (UNIT, 3)
    assert found.without_f0 == pytest.approx(math.sqrt((4 + 9 + 1) / 3.0) / 100.0)
    assert found.with_f0 == pytest.approx(math.sqrt((1 + 4 + 1) / 3.0) / 100.0)
    assert found.beyond_error
    back = held.gain((), (DRAG,))
    assert back is not None
    assert back.mean == pytest.approx(-found.mean)
    assert not back.beyond_error


def test_differences_that_no_recording_tells_are_none() -> None:
    held = by_hand(dict.fromkeys("abc", (0.5 * LEAST_F0, 0.1 * LEAST_F0)))
    found = held.gain((DRAG,), ())
    assert found is not None
    assert found.mean == 0.0


def test_longer_trials_weigh_more_in_the_whole_and_not_in_the_gain() -> None:
    held = by_hand({"a": (0.03, 0.01), "b": (0.01, 0.01), "c": (0.01, 0.01)}, samples=(200, 50, 50))
    assert held.rmsd(()) == pytest.approx(0.01 * math.sqrt((200 * 9 + 100) / 300.0))
    found = held.gain((DRAG,), ())
    assert found is not None
    assert found.mean == pytest.approx(math.log(3.0) / 3.0)


def test_of_several_fibres_each_has_its_own() -> None:
    held = by_hand({"a": (0.02, 0.01), "b": (0.02, 0.01), "c": (0.02, 0.01)}, fibres=2)
    both, one = held.gain((DRAG,), ()), held.gain((DRAG,), (), 1)
    assert both is not None
    assert one is not None
    assert (both.conditions, one.conditions) == (6, 3)


def test_a_trial_without_solution_leaves_no_gain() -> None:
    held = by_hand({"a": (0.02, 0.01), "b": (0.02, float("nan")), "c": (0.02, 0.01)})
    assert held.rmsd_by_trial((DRAG,))[0, "b"] == np.inf
    assert held.rmsd((DRAG,)) is None
    assert held.rmsd(()) == pytest.approx(0.02)
    assert held.gain((DRAG,), ()) is None
    # Nor has a set that was not asked for.
    assert held.rmsd((DRAG, DRAG)) is None


def test_a_task_predicts_what_it_did_not_see(system: System, base_fit: Fit) -> None:
    """The trial at full calcium alone is fitted; the other one is predicted, its own errors by its first moments."""
    task = {
        "system": system.to_json(),
        "trials": [system.trials[1].to_json()],
        "closure_f0": {},
        "names": [],
        "values": dict(base_fit.values),
        "most": 2,
        "tolerance": 0.1,
    }
    found = predict_task(task)
    assert found is not None
    (force,) = found
    measured = system.trials[1].measured_f0
    assert np.sqrt(np.mean((np.array(force) - measured) ** 2)) < 0.1
    beyond = replace(system.trials[1], length_l0=system.trials[1].length_l0 + 20.0)
    assert predict_task({**task, "trials": [beyond.to_json()]}) is None
    lost = replace(
        system, trials=(replace(system.trials[0], length_l0=system.trials[0].length_l0 + 20.0), system.trials[1])
    )
    assert predict_task({**task, "system": lost.to_json()}) is None
