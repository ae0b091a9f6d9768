"""The whole model: with nothing switched on it is the base to the last digits, with one thing the small model."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from written_out import Written, evaluated, some_states, with_ready_heads

from xb_muscle_ros.diagnose.names import MECHANISMS, Name
from xb_muscle_ros.diagnose.search import whole as whole_module
from xb_muscle_ros.diagnose.search.system import System
from xb_muscle_ros.diagnose.search.whole import FRAMES, beside, frame_of, only, together, whole
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import MODELS

FIBRE = "18Dec2017a"
EXACT = 1e-12
# A mechanism of each base, on models that differ in what a mechanism may act on.
BASES = ("2state", "3state_coop", "4state_coop", "2state_coop_rigid", "hill")


def given_fibre(model: str) -> Fibre:
    return changed(load_fibre(FIBRE, model), {"smoothing": 0.0}, "test")


def augmented(given: Fibre, *names: Name) -> Fibre:
    """The whole model's fibre with some mechanisms at the values that a search starts from."""
    problem = System(given, (), np.empty(0), 1e-3).problem(names, {})
    return problem.fibre_at(problem.start)


def assert_same(one: Written, other: Written) -> None:
    """Outputs, and rates of the states that both have."""
    for name in set(one.rates) & set(other.rates):
        assert one.rates[name] == pytest.approx(other.rates[name], rel=EXACT, abs=EXACT), name
    for name, value in one.outputs.items():
        assert value == pytest.approx(other.outputs[name], rel=EXACT, abs=EXACT), name


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_everything_absent_is_the_base(model: str) -> None:
    given = given_fibre(model)
    everything = whole(given, ())
    assert everything.model.startswith(f"{model}+")
    for state in some_states(given, 4):
        assert_same(evaluated(given, state), evaluated(everything, with_ready_heads(state)))


@pytest.mark.parametrize("model", ["2state", "2state_rigid", "2state_coop_rigid"])
def test_heads_of_a_filament_that_nothing_puts_to_rest_stay_awake(model: str) -> None:
    """The thick filament that wakes by force is the one that is always on."""
    everything = whole(given_fibre(model), ())
    assert "thick_filament_cooperativity" in everything.model
    for state in some_states(given_fibre(model), 4):
        ready = with_ready_heads(state)
        found = evaluated(everything, ready)
        assert found.outputs["drx"] == ready["drx"]
        assert found.rates["drx"] == pytest.approx(-found.rates["q0"] - found.rates.get("r", 0.0), rel=1e-9)
    # At rest all are ready.
    assert evaluated(everything, {"q0": 0.1, "q2": 0.1, "calcium": 1.0}).outputs["drx"] == 1.0


def mechanisms_alone() -> list[tuple[str, Name]]:
    return [(model, name) for model in BASES for name in beside(given_fibre(model))]


@pytest.mark.slow
@pytest.mark.parametrize(("model", "name"), mechanisms_alone(), ids=str)
def test_one_mechanism_in_the_whole_is_the_small_model_with_it(model: str, name: Name) -> None:
    given = given_fibre(model)
    big = augmented(given, name)
    small = only(big, given, (name,))
    assert small.model == f"{model}+{name}"
    states = some_states(small, 4)
    bare = [evaluated(given, state) for state in states]
    for state in states:
        assert_same(evaluated(small, state), evaluated(big, with_ready_heads(state)))
    # And it is there.
    changes = [
        abs(one.outputs[o] - evaluated(small, s).outputs[o])
        for one, s in zip(bare, states, strict=True)
        for o in one.outputs
    ]
    rates = [
        abs(one.rates[r] - evaluated(small, s).rates[r])
        for one, s in zip(bare, states, strict=True)
        for r in set(one.rates) & set(evaluated(small, s).rates)
    ]
    assert max([*changes, *rates]) > 1e-6


@pytest.mark.slow
def test_a_frame_with_nothing_else_is_the_small_model_of_that_frame() -> None:
    for model, frame in (("2state", FRAMES[:1]), ("2state_rigid", FRAMES), ("hill", FRAMES[1:2])):
        given = given_fibre(model)
        big = whole(given, frame)
        small = only(big, given, frame)
        for state in some_states(small, 3):
            assert_same(evaluated(small, state), evaluated(big, with_ready_heads(state)))


def test_only_keeps_the_values_that_were_fitted_and_no_other() -> None:
    given = given_fibre("3state_coop")
    names = (Name.VISCOUS_DRAG, Name.FORCIBLE_DETACHMENT)
    big = augmented(given, *names)
    moved = replace(big, values=MappingProxyType({**big.values, "drag": 0.033, "k": 321.0, "f": 77.0}))
    small = only(moved, given, names)
    assert (small.values["drag"], small.values["k"], small.values["f"]) == (0.033, 321.0, 77.0)
    assert "weak_stiffness" not in small.values
    # Back in the whole model it is what it was.
    back = System(given, (), np.empty(0), 1e-3).problem(names, dict(small.values))
    again = back.fibre_at(back.start)
    assert dict(again.values) == pytest.approx({**moved.values})
    assert dict(only(big, given, ()).values) == pytest.approx(dict(given.values))


def test_what_is_absent_is_the_null_of_the_catalogue() -> None:
    for name in MECHANISMS:
        entry = CATALOGUE[name]
        if entry.effect is None and name is not Name.THICK_FILAMENT_COOPERATIVITY:
            assert name in FRAMES
            assert entry.absent == {}
        elif name is Name.THICK_FILAMENT_COOPERATIVITY:
            assert entry.absent == {"J2": 0.0}
        elif name is Name.FILAMENT_FRICTION:
            # Links that never slip: absent friction has no steps halved.
            assert entry.absent == {"friction_force": 0.0, "friction_way": 1.0}
        else:
            assert entry.absent == {entry.effect: 0.0}


def test_frames_and_mechanisms_that_a_model_has_are_not_beside_it() -> None:
    assert frame_of([Name.VISCOUS_DRAG, Name.SERIES_COMPLIANCE]) == (Name.SERIES_COMPLIANCE,)
    assert frame_of([Name.VISCOUS_DRAG]) == ()
    coop = beside(given_fibre("3state_coop"))
    assert not {Name.THIN_FILAMENT_COOPERATIVITY, Name.THICK_FILAMENT_COOPERATIVITY, Name.SERIES_COMPLIANCE} & set(coop)
    assert Name.SERIES_COMPLIANCE in beside(given_fibre("2state_rigid"))
    assert Name.FORCIBLE_DETACHMENT not in beside(given_fibre("4state_coop"))
    assert Name.WEAKLY_BOUND_HEADS not in beside(given_fibre("hill"))
    with pytest.raises(UserError, match="part of this model already"):
        whole(given_fibre("3state_coop"), FRAMES[:1])


def test_mechanisms_that_take_one_place_do_not_go_together(monkeypatch: pytest.MonkeyPatch) -> None:
    assert together(MECHANISMS)
    taken = {"phosphate": "detachment", "forcible_detachment": "detachment"}
    monkeypatch.setattr(whole_module, "place_of", lambda name: taken.get(name, ""))
    assert not together(MECHANISMS)
    assert together([Name.PHOSPHATE, Name.PCA_SHIFT])


def test_a_mechanism_of_the_fibre_s_own_stays() -> None:
    given = changed(load_fibre(FIBRE, "3state_coop+viscous_drag"), {"smoothing": 0.0, "drag": 0.02}, "test")
    everything = whole(given, ())
    assert everything.model.count("viscous_drag") == 1
    assert everything.values["drag"] == 0.02
    assert Name.VISCOUS_DRAG not in beside(given)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["3state_coop"])
def test_compiled_forces_of_a_stretch_are_the_base_s(model: str, gaussian_whole: Fibre) -> None:
    """Steps of 1 ms, as recordings have them: more states than the base's bear on the step's error estimate alone."""
    given = given_fibre(model)
    length = np.interp(np.arange(300), [0, 50, 134, 218, 299], [0.0, 0.0, 0.0383, 0.0, 0.0])
    forces = []
    for fibre in (given, gaussian_whole):
        muscle = Muscle(fibre)
        state = muscle.settle(0.0, 1.0)
        states = muscle.run(state, np.full(299, 1e-3), length, np.full(300, 1.0))
        forces.append(muscle.outputs_of(states)["force_f0"])
    assert np.ptp(forces[0]) > 0.3
    assert forces[1] == pytest.approx(forces[0], abs=1e-8)
