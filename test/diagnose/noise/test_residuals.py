"""What a fit left, at all samples that were recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_trials import fitted_trials, given_fibre, trials_of, truth

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.noise.residuals import Around, Recordings
from xb_muscle_ros.diagnose.search.descent import Fit
from xb_muscle_ros.diagnose.search.system import System
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.scores.noise.trials import noise_of
from xb_muscle_ros.trials.trial import Trial

PCAS = (4.5, 6.2)


@pytest.fixture(scope="module")
def trials() -> list[Trial]:
    """Those of the fixture `system`."""
    return trials_of(truth("3state_coop+viscous_drag", drag=0.03), PCAS, noise_f0=3e-4, ordinary=False)


@pytest.fixture(scope="module")
def every(trials: list[Trial]) -> System:
    """All samples."""
    fitted = fitted_trials(trials)
    return System(given_fibre(), fitted, np.ones(sum(t.measured_f0.size for t in fitted)), 1e-3)


@pytest.fixture(scope="module")
def recordings(trials: list[Trial]) -> Recordings:
    return Recordings(tuple(trials), noise_of(trials), 100, 1)


def around(every: System, system: System, fit: Fit) -> Around:
    return Around.of(every, fit, system.effective_samples)


def test_the_residual_is_measured_less_simulated_and_about_that_of_the_thinned_fit(
    every: System, system: System, drag_fit: Fit, base_fit: Fit, recordings: Recordings
) -> None:
    for fit, most in ((drag_fit, 1e-3), (base_fit, 0.02)):
        found = around(every, system, fit)
        assert found.residual_f0.size == sum(t.measured_f0.size for t in every.trials)
        assert float(np.sqrt(np.mean(found.residual_f0**2))) < most
        simulated = np.concatenate(found.problem.predicted(found.problem.start))
        assert found.residual_f0 == pytest.approx(every.measured - simulated, abs=1e-12)
        rows = recordings.residuals(found)
        assert [r.pca for r in rows] == list(PCAS)
        assert np.concatenate([r.value_f0 for r in rows]) == pytest.approx(found.residual_f0)
        for part, row in zip(found.by_trial(), rows, strict=True):
            assert part == pytest.approx(row.value_f0)


def test_weights_tell_how_many_independent_residuals_there_are(every: System, system: System, base_fit: Fit) -> None:
    found = around(every, system, base_fit)
    scale = float(np.sqrt(np.mean(found.residual_f0**2)))
    assert float(np.sum(found.fit.weights**2)) * scale**2 == pytest.approx(system.effective_samples)
    # Coordinates at a bound do not move.
    moved = replace(base_fit, values={**base_fit.values, "f": 1e12})
    assert around(every, system, moved).fit.slopes.shape[1] < found.fit.slopes.shape[1]


def test_a_drag_stands_out_and_is_gone_with_it(
    every: System, system: System, base_fit: Fit, drag_fit: Fit, recordings: Recordings
) -> None:
    before, after = (recordings.significance(around(every, system, fit)) for fit in (base_fit, drag_fit))
    assert before.detected(0.05)
    assert not after.detected(0.01)
    assert 1e-4 < recordings.usual_noise_f0() < 1e-3


def test_the_law_of_a_drag_is_a_short_memory(
    every: System, system: System, base_fit: Fit, recordings: Recordings
) -> None:
    found = recordings.law(around(every, system, base_fit))
    assert found is not None
    assert found.time_constant_s < 0.03
    assert len(found.weight_f0) == len(found.tau_s)
    assert set(found.other_scalings) | {found.scales_with} == {"constant", "activation", "calcium", "force"}


def test_what_no_physics_tells_of_held_out_trials(
    every: System, system: System, base_fit: Fit, recordings: Recordings
) -> None:
    found = around(every, system, base_fit)
    names = [t.name for t in every.trials]
    both = recordings.benchmark(found, [{names[0]}, {names[1]}])
    assert both is not None
    learnt, samples = both
    assert samples == found.residual_f0.size
    # Not much worse than the same fits without anything learnt.
    plain = 0.0
    first = np.arange(samples) < found.by_trial()[0].size
    for out in (first, ~first):
        fit = LinearFit(found.fit.slopes, np.where(out, 0.0, found.fit.weights), found.fit.prior)
        plain += float(np.sum(fit.residual(found.residual_f0[:, None])[out, 0] ** 2))
    assert 0.0 < learnt <= plain * 1.5
    # Nothing left to learn from.
    assert recordings.benchmark(found, [set(names)]) is None


def test_names_of_the_fit_are_in_its_problem(every: System, system: System, drag_fit: Fit) -> None:
    assert "drag" in {c.name for c in around(every, system, drag_fit).problem.coordinates}
    assert drag_fit.names == (Name.VISCOUS_DRAG,)
