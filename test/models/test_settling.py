"""Coming to rest: the quick way ends where the slow one does, and where it does not end at rest it is not taken."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle

# Every released set of one fibre, with exact functions and with those that it was released with.
RELEASED = load_fibre("18Dec2017a").available_models
CALCIUM_UM = (1e-3, 0.3, 0.8, 30.0)


def released(name: str, smoothing: float = 0.0) -> Fibre:
    return changed(load_fibre("18Dec2017a", name), {"smoothing": smoothing}, "test")


def slowly(muscle: Muscle, length: float, calcium: float, monkeypatch: pytest.MonkeyPatch) -> np.ndarray:
    with monkeypatch.context() as patch:
        patch.setattr(Muscle, "_settled_quickly", lambda *_: None)
        return muscle.settle(length, calcium)


@pytest.mark.parametrize("name", RELEASED)
def test_the_quick_way_ends_where_the_slow_one_does(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    muscle = Muscle(released(name))
    for calcium in CALCIUM_UM:
        for length in (0.0, 0.05):
            state = muscle.rest(length)
            quick = muscle._settled_quickly(state, calcium, np.zeros(state.size - 3))
            assert quick is not None
            slow = slowly(muscle, length, calcium, monkeypatch)
            # The slow way ends where nothing changes by more than 1e-9 1/s.
            assert quick == pytest.approx(slow, abs=4e-9)
            assert muscle.outputs(quick).force_f0 == pytest.approx(muscle.outputs(slow).force_f0, abs=1e-9)
            assert np.array_equal(muscle.settle(length, calcium), quick)


@pytest.mark.slow
@pytest.mark.parametrize("name", RELEASED)
def test_smooth_functions_take_the_slow_way(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """They have further states of rest: of 2state at pCa 9, mean strains of -17000 power strokes."""
    muscle = Muscle(released(name, 100.0))
    for calcium in (1e-3, 0.8, 30.0):
        assert np.array_equal(muscle.settle(0.0, calcium), slowly(muscle, 0.0, calcium, monkeypatch))


def test_where_it_does_not_come_to_rest_the_slow_way_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    muscle = Muscle(released("3state_coop"))
    usual = muscle.settle(0.0, 0.8)
    advance = Muscle._advance

    def on_the_way(self: Muscle, state: Any, length: float, calcium: float, *_: float) -> Any:
        """Quick steps that end far from rest; the slow way's are its own."""
        return advance(self, state, length, calcium, 1e-2, 1e-3, 1e-4)

    taken: list[float] = []
    hold = Muscle.hold

    def watched(self: Muscle, state: Any, calcium: float, duration_s: float) -> Any:
        taken.append(duration_s)
        with monkeypatch.context() as patch:
            patch.setattr(Muscle, "_advance", advance)
            return hold(self, state, calcium, duration_s)

    monkeypatch.setattr(Muscle, "_advance", on_the_way)
    monkeypatch.setattr(Muscle, "hold", watched)
    found = muscle.settle(0.0, 0.8)
    assert len(taken) > 1
    assert found == pytest.approx(usual, abs=1e-7)


def test_a_quick_step_without_solution_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    muscle = Muscle(released("3state_coop"))

    def fails(*_: Any) -> Any:
        raise UserError("no")

    monkeypatch.setattr(Muscle, "_advance", fails)
    state = muscle.rest()
    assert muscle._settled_quickly(state, 0.8, np.zeros(state.size - 3)) is None


def test_a_strain_grid_has_no_quick_way() -> None:
    muscle = Muscle(load_fibre("18Dec2017a", "3state_coop", "characteristics"))
    state = muscle.rest()
    assert muscle._settled_quickly(state, 0.8, np.zeros(state.size - 3)) is None
