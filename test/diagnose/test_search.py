"""A search: which explanations are fitted a second time and from where, and when models are compiled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from xb_muscle_ros.diagnose import search as searching
from xb_muscle_ros.diagnose.catalogue import applicable
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.refit import Fit, compile_task
from xb_muscle_ros.diagnose.search import QUICK, Searcher
from xb_muscle_ros.diagnose.study import Explanation, Study
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.work import Options


def fit(cost: float, *names: Name, **values: float) -> Fit:
    explanation = Explanation()
    for name in names:
        explanation = explanation.plus(name)
    return Fit(explanation, {"f": 900.0, "kon": 10.0, **values}, cost, 0.001, 1)


@pytest.fixture
def searcher() -> Searcher:
    return Searcher(Study(load_fibre("18Dec2017a", "2state_coop"), ()), QUICK, Options(processes=0, quiet=True))


def answering(costs: Mapping[str, float], asked: list[dict[str, Any]]) -> Any:
    def run(function: object, tasks: Sequence[dict[str, Any]], options: Options) -> list[dict[str, Any]]:
        asked.extend(tasks)
        return [
            {
                "names": task["names"],
                "values": {"f": 100.0},
                "cost": costs[task["names"][0]],
                "rmsd_f0": 0.001,
                "evaluations": 1,
            }
            for task in tasks
        ]

    return run


def test_leading_fits_and_swaps_start_anew_from_the_fibre_file(
    searcher: Searcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    fits = [
        fit(100.0, Name.VISCOUS_DRAG, drag=0.01),
        fit(200.0, Name.ACTIVE_TITIN, titin_stiffness=3.0),
        fit(300.0, Name.TIME_SHIFT, time_shift=0.001),
        fit(400.0, Name.LATTICE_SPACING, attachment_per_length=2.0),
        fit(900.0, Name.THICK_FILAMENT_COOPERATIVITY, JF=20.0),
    ]
    asked: list[dict[str, Any]] = []
    costs = {"viscous_drag": 150.0, "active_titin": 50.0, "time_shift": 300.0, "thick_filament_cooperativity": 60.0}
    monkeypatch.setattr(searching, "run", answering(costs, asked))
    found = {f.explanation.label: f for f in searcher._anew(fits)}
    # Three lead; a block put in the place of another may have started in a poor place, however far behind it is.
    assert [task["names"] for task in asked] == [[name] for name in costs]
    for task in asked:
        assert all("f" not in start and "kon" not in start for start in task["starts"][:1])
    assert asked[0]["starts"][0] == {"drag": 0.01}
    assert len(asked[1]["starts"]) > 1
    assert found["viscous_drag"].cost == 100.0
    assert found["active_titin"].cost == 50.0
    assert found["thick_filament_cooperativity"].cost == 60.0
    assert found["lattice_spacing"].cost == 400.0
    assert searcher.fits["active_titin"].values == {"f": 100.0}


@pytest.mark.parametrize(("processes", "compiles"), [(2, True), (0, False)])
def test_models_are_compiled_side_by_side_once(
    processes: int, compiles: bool, searcher: Searcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    searcher.options = Options(processes=processes, quiet=True)
    asked: list[dict[str, Any]] = []

    def run(function: object, tasks: Sequence[dict[str, Any]], options: Options) -> list[bool]:
        assert function is compile_task
        assert options.journal is None
        asked.extend(tasks)
        return [True] * len(tasks)

    monkeypatch.setattr(searching, "run", run)
    monkeypatch.setattr(searching, "screen", lambda study, fit, linear: [])
    for _ in range(2):
        assert searcher._screened(fit(100.0), None) == []  # type: ignore[arg-type]
    names = [task["names"] for task in asked]
    assert names == ([[e.name.value] for e in applicable("2state_coop")] if compiles else [])


def test_an_explanation_without_a_model_is_not_compiled() -> None:
    plain = Study(load_fibre("18Dec2017a", "2state_coop"), ()).to_json()
    assert compile_task({"study": plain, "names": ["viscous_drag", "time_shift"]})
    assert not compile_task({"study": plain, "names": ["thin_filament_cooperativity"]})
