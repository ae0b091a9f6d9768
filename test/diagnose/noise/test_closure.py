"""The Gaussian form's own error: what it leaves out of the distribution's force, and where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from made_trials import PROTOCOL, fitted_trials, given_fibre, trials_of

from xb_muscle_ros.diagnose.noise.closure import by_distribution, closure_error, has_closure
from xb_muscle_ros.diagnose.search.system import System
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import simulate_trial


def recorded(given: Fibre) -> System:
    trials = fitted_trials(trials_of(given, (4.5, 6.2), ordinary=False))
    return System(given, trials, np.ones(sum(t.measured_f0.size for t in trials)), 1e-3)


def test_it_is_the_difference_of_both_forms_at_the_base_s_point() -> None:
    given = given_fibre()
    system = recorded(given)
    problem = system.problem((), {})
    found = closure_error(problem, given)
    assert set(found) == {t.name for t in system.trials}
    for pca, t in zip((4.5, 6.2), system.trials, strict=True):
        trial = PROTOCOL.trial(given.name, pca)
        forces = [simulate_trial(Muscle(f), trial).force_n / trial.facts.f0_n for f in (by_distribution(given), given)]
        assert found[t.name] == pytest.approx(forces[0] - forces[1], abs=2e-5)
    size = float(np.sqrt(np.mean(np.concatenate(list(found.values())) ** 2)))
    assert 1e-3 < size < 0.02


@pytest.mark.parametrize(
    ("fibre", "has"), [(given_fibre(), True), (given_fibre("hill"), False), (by_distribution(given_fibre()), False)]
)
def test_distributions_and_models_without_heads_have_none(fibre: Fibre, has: bool) -> None:
    assert has_closure(fibre) is has
    if not has:
        assert closure_error(System(fibre, (), np.empty(0), 1e-3).problem((), {}), fibre) == {}
