"""False alarms, power and places of a mismatch."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.noise.cells import Residual, cut, rms
from xb_muscle_ros.diagnose.noise.significance import family_wise, null_residuals, significance, step_down
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.scores.noise.model import NoiseModel
from xb_muscle_ros.scores.noise.windows import Window
from xb_muscle_ros.simulation.made import coloured_noise

Array = npt.NDArray[np.float64]


def nothing_fitted(samples: int) -> LinearFit:
    return LinearFit(np.zeros((samples, 0)), np.ones(samples), np.zeros(0))


@pytest.fixture(scope="module")
def known(study: Any, model_of: Any) -> NoiseModel:
    """Noise from windows so long that it is known."""
    return model_of([Window(w.trial, w.step_s, _long(i)) for i, w in enumerate(study.windows(study.noise(_rng(0))))])


def _rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def _long(i: int) -> Array:
    return coloured_noise(_rng(100 + i), 20_000, float(np.geomspace(3e-4, 1.4e-3, 5)[::-1][i]), 0.95)


def bump(study: Any, trial: int, size_f0: float, at_s: float = 0.3) -> Array:
    """A change of the data for 40 ms in one trial."""
    parts = [np.zeros(n) for n in study.sizes]
    parts[trial] = size_f0 * np.exp(-0.5 * ((study.residuals[trial].time_s - at_s) / 0.01) ** 2)
    return np.concatenate(parts)


def test_false_alarms_on_noise_that_was_fitted(study: Any, known: NoiseModel) -> None:
    """200 studies without any mismatch: p-values below 0.05 in 5 % of them, within what 200 can tell."""
    residuals, random = study.residuals, _rng(0)
    cells = cut(residuals)

    def sizes(values: Array) -> Array:
        return np.vstack([rms(cells, values), np.sqrt(np.mean(values**2, axis=0))])

    null = np.concatenate([sizes(x) for x in null_residuals(residuals, study.fit, known, 200, 1)], axis=1)
    noise = np.column_stack([study.noise(random) for _ in range(200)])
    p = np.array([family_wise(found, null).min() for found in sizes(study.fit.residual(noise)).T])
    # Binomial: 18 and more of 200 at 5 % have a chance of 1 %.
    assert np.count_nonzero(p <= 0.05) <= 18
    assert 50 <= np.count_nonzero(p <= 0.5) <= 130


def test_false_alarms_where_windows_are_short(study: Any, model_of: Any) -> None:
    """Noise known from 85 samples a trial only, and more persistent than most."""
    p = []
    for k in range(16):
        noise = study.noise(_rng(k), memory=0.97)
        found = significance(study.after(noise), study.fit, model_of(study.windows(noise)), draws=60, seed=k)
        assert not found.detected(0.05)
        p.append(found.overall_p)
    # 4 and more of 16 at 5 % have a chance of 1 %.
    assert np.count_nonzero(np.array(p) <= 0.05) <= 3


def test_without_the_refit_the_null_would_be_wrong(study: Any, known: NoiseModel) -> None:
    """The fit takes some of the noise: against unfitted noise what it leaves looks small."""
    residuals = study.after(study.noise(_rng(1)))
    plain = significance(residuals, nothing_fitted(sum(study.sizes)), known, draws=100)
    refitted = significance(residuals, study.fit, known, draws=100)
    assert refitted.overall_null_f0 < 0.95 * plain.overall_null_f0


@pytest.mark.parametrize("sign", [1, -1])
def test_bump_is_found_where_it_is(study: Any, known: NoiseModel, sign: int) -> None:
    found = significance(study.after(study.noise(_rng(2)) + bump(study, 3, sign * 0.012)), study.fit, known)
    rows = found.places("f", 0.05)
    assert found.detected(0.05)
    assert found.overall_p <= 0.01
    assert (rows[0].trial, rows[0].phase, np.sign(rows[0].mean_f0)) == ("pca6.3", "recovery", sign)
    assert rows[0].start_s == pytest.approx(0.28, abs=0.015)
    assert rows[0].end_s == pytest.approx(0.32, abs=0.015)
    assert rows[0].size_f0 == pytest.approx(0.012 * np.sqrt(0.01 * np.sqrt(np.pi) / 0.1), rel=0.3)
    assert [row.size_f0 for row in rows] == sorted((row.size_f0 for row in rows), reverse=True)
    assert all(row.trial == "pca6.3" for row in rows)


def test_bump_below_the_practical_floor_is_significant_but_does_not_count(study: Any, known: NoiseModel) -> None:
    residuals = study.after(study.noise(_rng(3)) + bump(study, 4, 0.006))
    found = significance(residuals, study.fit, known)
    assert found.overall_p <= 0.05
    assert not found.detected(0.05)
    assert found.places("f", 0.05) == []
    assert significance(residuals, study.fit, known, floor_f0=1e-4).detected(0.05)


def test_what_parameters_can_do_is_no_mismatch(study: Any, known: NoiseModel) -> None:
    """2 % F0 along a slope are gone after the refit."""
    change = study.fit.slopes[:, 0] * 0.2
    assert np.sqrt(np.mean(change**2)) > 0.015
    found = significance(study.after(study.noise(_rng(4)) + change), study.fit, known)
    assert found.overall_p > 0.05


def test_map_has_a_place_for_every_trial_and_phase(study: Any, known: NoiseModel) -> None:
    short = study.residuals[0]._replace(phases=study.residuals[0].phases[:-1])
    residuals = (short, *study.after(study.noise(_rng(5)))[1:])
    table = significance(residuals, study.fit, known, draws=50).map()
    assert list(table.trials) == [r.trial for r in residuals]
    for values in (table.rms_f0, table.mean_f0, table.p_value, table.counts):
        assert np.shape(values) == (5, len(table.phases))
    hold = table.phases.index("hold")
    assert [row[hold] is None for row in table.rms_f0] == [True, False, False, False, False]


def test_same_seed_same_answer(study: Any, known: NoiseModel) -> None:
    residuals = study.after(study.noise(_rng(6)))
    once, again = (significance(residuals, study.fit, known, draws=50, seed=3) for _ in range(2))
    assert once.p_value.tolist() == again.p_value.tolist()


def test_prior_may_cost_what_it_costs(study: Any, known: NoiseModel) -> None:
    """A truth where the prior expects it, which the prior pulls the fit away from, is no mismatch."""
    tight = LinearFit(study.fit.slopes, study.fit.weights, study.fit.prior * 100.0)
    truth = _rng(7).normal(size=tight.prior.size) / np.sqrt(tight.prior)
    residuals = study._replace(fit=tight).after(study.noise(_rng(7)) + tight.slopes @ truth)
    assert significance(residuals, tight, known).overall_p > 0.05


@given(st.integers(1, 12), st.integers(20, 60), st.integers(0, 1000))
def test_step_down_orders_p_by_size_and_is_never_zero(n: int, draws: int, seed: int) -> None:
    null = _rng(seed).lognormal(size=(1, draws)) * np.ones((n, 1)) + 0.1 * _rng(seed).random((n, draws))
    found = np.mean(null, axis=1) * _rng(seed + 1).lognormal(size=n)
    p = step_down(found, null)
    assert np.all((p >= 1.0 / (draws + 1)) & (p <= 1.0))
    assert step_down(found + 1e6, null).max() == pytest.approx(1.0 / (draws + 1))


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(1, 60), min_size=1, max_size=4), st.integers(0, 5))
def test_any_sizes_of_trials(model_of: Any, sizes: list[int], coordinates: int) -> None:
    residuals = [
        Residual(str(i), None, 1e-3 * np.arange(n), np.full(n, 0.02), (), np.zeros(n), np.zeros(n))
        for i, n in enumerate(sizes)
    ]
    total = sum(sizes)
    fit = LinearFit(_rng(0).normal(size=(total, coordinates)), np.ones(total), np.zeros(coordinates))
    noise = model_of([Window(r.trial, 1e-3, coloured_noise(_rng(1), 60)) for r in residuals])
    found = significance(residuals, fit, noise, draws=20)
    assert found.rms_f0.shape == found.p_value.shape == (len(sizes),)
    assert np.all((found.p_value > 0.0) & (found.p_value <= 1.0))


def test_errors_are_one_line(study: Any, known: NoiseModel) -> None:
    residuals = study.residuals
    with pytest.raises(UserError, match="residuals have 553 samples, the fit's slopes 2765"):
        significance(residuals[:1], study.fit, known)
    with pytest.raises(UserError, match="3 draws of noise; at least 20"):
        significance(residuals, study.fit, known, draws=3)
    with pytest.raises(UserError, match=r"slopes of shape \(4, 2\) with weights \(3,\)"):
        LinearFit(np.zeros((4, 2)), np.ones(3), np.zeros(2))
    with pytest.raises(UserError, match="slopes of the fit are not finite"):
        LinearFit(np.full((4, 2), np.nan), np.ones(4), np.zeros(2))
