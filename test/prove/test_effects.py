"""Effects: none at scale 0, and where they should be otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.diagnose.names import MECHANISMS, Name
from xb_muscle_ros.prove.generator.effects import EFFECTS, OUTSIDE
from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import Mesh, Stimulus, World

# What its tests share takes long to make.
pytestmark = pytest.mark.slow

Array = np.ndarray
RELAXED, HALF, FULL = range(3)
STRETCH, HOLD = slice(201, 285), slice(-250, None)


@pytest.fixture(scope="module")
def changes(worlds: dict[str, World], study: list[Stimulus]) -> dict[str, tuple[list[Array], list[Array]]]:
    """By effect: what scale 0 changes, and what the usual scale changes, in each of the three trials."""
    mesh = Mesh(steps=2)
    plain = {model: study_forces(Truth(world), study, mesh) for model, world in worlds.items()}
    found = {}
    for label, effect in EFFECTS.items():
        model = effect.models[0]
        shape = effect.draw(np.random.default_rng(1))
        both = [
            [a - b for a, b in zip(study_forces(truth, study, mesh), plain[model], strict=True)]
            for truth in (effect.apply(Truth(worlds[model]), scale, shape) for scale in (0.0, effect.start))
        ]
        found[label] = (both[0], both[1])
    return found


def test_every_mechanism_has_an_effect_and_some_have_no_name() -> None:
    assert set(MECHANISMS) == set(EFFECTS) - set(OUTSIDE)
    assert len(OUTSIDE) >= 4
    assert all(label.startswith("outside:") for label in OUTSIDE)


@pytest.mark.parametrize("label", EFFECTS)
def test_no_effect_at_scale_zero(label: str, changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    assert max(np.max(np.abs(change)) for change in changes[label][0]) < 1e-8


@pytest.mark.parametrize("label", EFFECTS)
def test_effect_changes_force(label: str, changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    assert max(np.sqrt(np.mean(change**2)) for change in changes[label][1]) > 2e-4
    assert all(np.all(np.isfinite(change)) for change in changes[label][1])


def test_drag_is_there_while_length_changes_only(changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    for change in changes[Name.VISCOUS_DRAG][1]:
        assert np.all(change[STRETCH] > 1e-3)
        assert np.all(change[:201] == 0.0)
        assert np.all(change[HOLD] == 0.0)


def test_relaxation_goes_on_in_the_hold(changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    change = changes[Name.PASSIVE_VISCOELASTICITY][1][RELAXED]
    assert change[284] > 2.0 * change[-1] > 0.0


@pytest.mark.parametrize("name", [Name.ACTIVE_TITIN, Name.STATIC_CALCIUM_STIFFNESS])
def test_calcium_stiffens_titin(name: Name, changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    change = changes[name][1]
    assert np.max(np.abs(change[RELAXED])) < 1e-6
    assert 0.0 < change[HALF][-1] < change[FULL][-1]


@pytest.mark.parametrize("name", [Name.LENGTH_DEPENDENT_ACTIVATION, Name.STRAIN_RECRUITED_HEADS])
def test_submaximal_only(name: Name, changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    change = changes[name][1]
    assert change[HALF][-1] > 3.0 * abs(change[FULL][-1])
    assert change[HALF][-1] > 10.0 * abs(change[RELAXED][-1])


def test_tearing_caps_the_end_of_a_stretch(changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    change = changes[Name.FORCIBLE_DETACHMENT][1][FULL]
    assert change[284] < -1e-3
    assert abs(change[100]) < 1e-3 * abs(change[284]) + 1e-4


def test_weak_heads_bear_force_where_sites_are_active(changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    change = changes[Name.WEAKLY_BOUND_HEADS][1]
    assert change[FULL][220] > change[HALF][220] > 10.0 * abs(change[RELAXED][220])


def test_damage_stays(changes: dict[str, tuple[list[Array], list[Array]]]) -> None:
    # Harm done in the first trials is there at the beginning of the last.
    assert changes["outside:damage_by_stretch"][1][FULL][0] < -1e-3


def test_inactivation_wears_off(worlds: dict[str, World]) -> None:
    effect = EFFECTS["outside:inactivation_after_stretch"]
    length = np.interp(np.arange(8000), [0, 200, 300, 8000], [0.0, 0.0, 0.04, 0.04])
    study = [Stimulus(length, 1.0)]
    plain = Truth(worlds["3state_coop"])
    force = study_forces(effect.apply(plain, 2.0, {"decay_s": 1.0}), study)[0] - study_forces(plain, study)[0]
    assert force[800] < -5e-3
    assert abs(force[-1]) < 0.05 * abs(force[800])
