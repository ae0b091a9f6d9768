"""The search: each set once, sets without solution apart, and the way from the base to the best set and around it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from by_hand import COUNT, DRAG, LATTICE, NOISE_F0, SHIFT, TITIN, explorer, fit, with_odds
from made_trials import given_fibre

from xb_muscle_ros.diagnose.effort import Effort
from xb_muscle_ros.diagnose.inference.population import adjustment
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.search import compiling, explore
from xb_muscle_ros.diagnose.search.descent import Fit, fit_task
from xb_muscle_ros.diagnose.search.explore import FORM, Explorer
from xb_muscle_ros.diagnose.search.promise import Promise
from xb_muscle_ros.diagnose.search.system import Names, System, ordered
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.work import Options

QUIET = Options(processes=0, quiet=True)


class Stub(Explorer):
    """A search over sets whose evidence is written down; what is fitted is kept in order."""

    def __init__(self, evidence: Mapping[Names, float], effort: Effort | None = None) -> None:
        system = System(given_fibre(), (), np.ones(COUNT), NOISE_F0)
        super().__init__([system], effort or Effort(), QUIET)
        self.values = {ordered(names): value for names, value in evidence.items()}
        self.asked: list[Names] = []

    def evidence(self, names: Names, fibre: int | None = None) -> float:
        return self.values[names]

    def fit(self, wanted: Any, why: str) -> list[Names]:
        for names, starts in wanted:
            assert len(starts) == 1
            if ordered(names) in self.values and ordered(names) not in self.fits:
                self.asked.append(ordered(names))
                self.fits[ordered(names)] = (fit(names, 0.0),)
        return [ordered(names) for names, _ in wanted if ordered(names) in self.fits]

    def promises(self, names: Names) -> dict[Name, list[Promise]]:
        rest = [n for n in (DRAG, TITIN, LATTICE, SHIFT) if n not in names]
        return {n: [Promise(n, 10.0 - k, ({},), 1e-6)] for k, n in enumerate(rest)}


def test_the_search_goes_from_one_name_to_the_next_while_it_is_worth_it() -> None:
    stub = Stub({
        (): 0.0, (DRAG,): 5.0, (TITIN,): 3.0, (LATTICE,): 1.0, (SHIFT,): -1.0, (DRAG, TITIN): 9.0,
        (DRAG, LATTICE): 4.0, (DRAG, SHIFT): 3.0, (DRAG, TITIN, LATTICE): 9.3, (DRAG, TITIN, SHIFT): 8.0,
        (TITIN, LATTICE): 2.0, (TITIN, SHIFT): 2.0, (DRAG, LATTICE, SHIFT): 1.0, (TITIN, LATTICE, SHIFT): 1.0,
        (LATTICE, SHIFT): 0.0, (DRAG, TITIN, LATTICE, SHIFT): 8.0,
    })  # fmt: skip
    best = stub.explore()
    # One more name is not worth going on for, but what is around the best set is looked at and may be it.
    assert best == (DRAG, TITIN, LATTICE)
    assert stub.asked[0] == ()
    assert stub.asked.index((DRAG,)) < stub.asked.index((DRAG, TITIN))
    assert (TITIN,) in stub.fits
    assert {(TITIN, LATTICE), (DRAG, LATTICE)} <= set(stub.fits)
    assert len(stub.asked) == len(set(stub.asked))


def test_a_name_that_has_become_superfluous_goes() -> None:
    """Drag was the best of one, lattice and titin together do what it did."""
    stub = Stub({
        (): 0.0, (DRAG,): 5.0, (TITIN,): 3.0, (LATTICE,): 3.0, (SHIFT,): 0.0, (DRAG, TITIN): 7.0,
        (DRAG, LATTICE): 6.0, (DRAG, TITIN, LATTICE): 11.0, (TITIN, LATTICE): 13.0,
    })  # fmt: skip
    assert stub.explore() == (TITIN, LATTICE)


def test_no_more_is_fitted_than_the_effort_allows() -> None:
    stub = Stub({(): 0.0, (DRAG,): 5.0, (TITIN,): 3.0, (LATTICE,): 9.0}, Effort(steps=1, candidates=2, rivals=0))
    stub.explore()
    assert stub.asked[:3] == [(), (DRAG,), (TITIN,)]
    assert (LATTICE,) not in stub.fits


def test_what_forms_get_wrong_counts_as_noise() -> None:
    e = explorer({(): [fit((), 0.0, mean_square_f0=1e-4)], (DRAG,): [fit((DRAG,), 300.0, mean_square_f0=1e-5)]})
    e.refloor()
    assert e.floors_f0[0] == pytest.approx(np.sqrt(NOISE_F0**2 + FORM**2 * 9e-5))
    # Evidence is of residuals beyond that; a fit's own cost is not.
    own = e.fits[(DRAG,)][0]
    assert e.evidence((DRAG,)) == pytest.approx(Explorer.odds((DRAG,)) - own.cost(e.systems[0], e.floors_f0[0]))
    e.fits = {(): e.fits[()]}
    e.refloor()
    assert e.floors_f0[0] == NOISE_F0


def test_candidates_go_with_every_fibre_s_model_and_are_not_there_yet() -> None:
    e = with_odds(((), 0.0))
    found = e.candidates((DRAG,))
    assert set(MEASUREMENT) <= set(found)
    assert DRAG not in found
    assert Name.THIN_FILAMENT_COOPERATIVITY not in found
    hill = System(given_fibre("hill"), (), np.ones(COUNT), NOISE_F0)
    both = Explorer([*e.systems, hill], Effort(), QUIET)
    assert not {Name.WEAKLY_BOUND_HEADS, Name.LATTICE_SPACING} & set(both.candidates(()))


def test_each_set_is_fitted_once_and_what_has_no_solution_is_told(
    system: System, drag_fit: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[list[str]] = []

    def run(function: Any, tasks: Any, options: Options) -> list[Any]:
        assert function is fit_task
        asked.extend(task["names"] for task in tasks)
        return [None if "active_titin" in task["names"] else drag_fit.to_json() for task in tasks]

    monkeypatch.setattr(explore, "run", run)
    e = Explorer([system, system], Effort(), QUIET)
    starts: Any = [[{}], [{}]]
    assert e.fit([((DRAG,), starts), ((TITIN,), starts)], "test") == [(DRAG,)]
    assert e.unsolved == [(TITIN,)]
    assert e.fit([((DRAG,), starts)], "test") == [(DRAG,)]
    assert asked == [["viscous_drag"], ["viscous_drag"], ["active_titin"], ["active_titin"]]
    assert e.fits[(DRAG,)] == (drag_fit, drag_fit)


def test_a_base_without_solution_is_the_user_s_to_know(monkeypatch: pytest.MonkeyPatch, system: System) -> None:
    monkeypatch.setattr(explore, "run", lambda function, tasks, options: [None] * len(tasks))
    with pytest.raises(UserError, match=r"fibre 18Dec2017a, model 3state_coop: no solution .*; start from another one"):
        Explorer([system], Effort(), QUIET).base()


def test_effects_that_are_alike_in_fibres_are_worth_more(system: System, drag_fit: Fit) -> None:
    e = Explorer([system, system], Effort(), QUIET)
    e.fits[(DRAG,)] = (drag_fit, drag_fit)
    rows = e.estimates((DRAG,))
    assert set(rows) == {"drag"}
    assert [row.value for row in rows["drag"]] == [drag_fit.values["drag"]] * 2
    assert all(row.effect and row.prior_mean == 0.0 and row.prior_sd == 0.02 for row in rows["drag"])
    assert e.adjusted((DRAG,), [0, 1]) == pytest.approx(adjustment(rows["drag"]))
    assert e.adjusted((DRAG,), [0]) == pytest.approx(adjustment(rows["drag"][:1]))
    assert e.adjusted((DRAG,), [0, 1]) > 2.0 * e.adjusted((DRAG,), [0])


def test_other_systems_start_where_the_former_fits_ended(
    system: System, drag_fit: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    def run(function: Any, tasks: Any, options: Options) -> list[Any]:
        asked.extend(tasks)
        return [replace(drag_fit, names=()).to_json() for _ in tasks]

    monkeypatch.setattr(explore, "run", run)
    e = Explorer([system], Effort(), QUIET)
    e.fits = {(): (drag_fit,), (DRAG,): (drag_fit,)}
    e.anew([replace(system, noise_f0=2e-3)])
    assert list(e.fits) == [()]
    (task,) = asked
    assert task["starts"] == [dict(drag_fit.values)]
    assert task["system"]["noise_f0"] == 2e-3


@pytest.mark.parametrize(("processes", "compiles"), [(2, True), (0, False)])
def test_models_are_compiled_side_by_side_where_there_are_several(
    processes: int, compiles: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    def run(function: Any, tasks: Any, options: Options) -> list[bool]:
        assert function is compiling.compile_task
        assert options.journal is None
        asked.extend(tasks)
        return [True] * len(tasks)

    monkeypatch.setattr(compiling, "run", run)
    monkeypatch.setattr(compiling, "is_compiled", lambda *_: False)
    fibre = given_fibre("2state")
    compiling.compile_first([fibre, changed(load_fibre("14Dec2017b", "2state"), {"smoothing": 0.0}, "test")],
                            Options(processes=processes, quiet=True))  # fmt: skip
    models = [(task["problem"]["fibre"]["model"], task["problem"]["fibre"]["method"]) for task in asked]
    # Two frames and the whole, which take longest, the base by its distribution and as it is; for both fibres once.
    assert len(models) == len(set(models)) == (5 if compiles else 0)
    assert not compiles or models[-2:] == [("2state", "characteristics"), ("2state", "gaussian")]
    monkeypatch.setattr(compiling, "is_compiled", lambda *_: True)
    asked.clear()
    compiling.compile_first([fibre], Options(processes=processes, quiet=True))
    assert asked == []
