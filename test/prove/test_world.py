"""The generator's fibre: accuracy, agreement with the package's own strain grid, rest."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.prove.generator.layout import At
from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import Mesh, Stimulus, World, isometric, simulate


@pytest.mark.parametrize("model", ["3state_coop", "2state_coop", "2state", "3state_coop_rigid"])
def test_force_does_not_depend_on_step_and_bins(model: str, worlds: dict[str, World], study: list[Stimulus]) -> None:
    usual = study_forces(Truth(worlds[model]), study)
    finer = study_forces(Truth(worlds[model]), study, Mesh(steps=8))
    narrower = study_forces(Truth(worlds[model]), study, Mesh(dx=0.05))
    for a, b, c in zip(usual, finer, narrower, strict=True):
        assert np.max(np.abs(a - b)) < 2e-4
        assert np.max(np.abs(a - c)) < 1e-6


def test_step_is_of_second_order(worlds: dict[str, World], study: list[Stimulus]) -> None:
    forces = [simulate(worlds["3state_coop"], study[1], mesh=Mesh(steps=steps)).force for steps in (2, 4, 8)]
    coarse, fine = (np.sqrt(np.mean((a - b) ** 2)) for a, b in itertools.pairwise(forces))
    assert 3.0 < coarse / fine < 5.0


def test_plain_world_is_the_model_that_the_tool_has(worlds: dict[str, World], study: list[Stimulus]) -> None:
    fibre = changed(load_fibre("18Dec2017a", "3state_coop", "characteristics"), {"smoothing": 0.0}, "test")
    muscle = Muscle(fibre)
    for stimulus in study[1:]:
        n = stimulus.length.size
        state = muscle.settle(0.0, stimulus.calcium)
        states = muscle.run(state, np.full(n - 1, 1e-3), stimulus.length, np.full(n, stimulus.calcium), 1)
        theirs = muscle.outputs_of(states)["force_f0"]
        assert np.max(np.abs(simulate(worlds["3state_coop"], stimulus).force - theirs)) < 1e-3


def test_trial_begins_at_rest(worlds: dict[str, World], study: list[Stimulus]) -> None:
    for world in worlds.values():
        for stimulus in study:
            force = simulate(world, stimulus).force
            assert np.ptp(force[:200]) < 1e-5
            assert force[0] == pytest.approx(isometric(world, stimulus.calcium), abs=1e-4)


def test_unequal_half_sarcomeres_stand_still_at_first(worlds: dict[str, World], study: list[Stimulus]) -> None:
    world = Truth(worlds["3state_coop"]).changed({At.UNIT_STIFFNESS: 0.005}, (0.93, 1.0, 1.07)).world
    for stimulus in study:
        assert np.ptp(simulate(world, stimulus).force[:200]) < 1e-4


def test_ties_bear_nothing_of_what_the_whole_fibre_does(worlds: dict[str, World], study: list[Stimulus]) -> None:
    plain = worlds["3state_coop"]
    for stimulus in study:
        alone = simulate(plain, stimulus).force
        alike = Truth(plain).changed({At.UNIT_STIFFNESS: 0.005}, (1.0, 1.0, 1.0)).world
        assert np.max(np.abs(simulate(alike, stimulus).force - alone)) < 1e-9
        unequal = Truth(plain).changed({At.UNIT_STIFFNESS: 0.005}, (0.8, 1.0, 1.2)).world
        if stimulus.calcium > 0.1:
            assert np.max(np.abs(simulate(unequal, stimulus).force - alone)) > 1e-3
        else:
            assert np.max(np.abs(simulate(unequal, stimulus).force - alone)) < 1e-3
