"""The law of a residual, and what a discrepancy without physics foretells."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.noise.cells import Residual
from xb_muscle_ros.diagnose.noise.discrepancy import discrepancy
from xb_muscle_ros.diagnose.noise.law import exponential_basis, law
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.linear_fit import LinearFit

Array = npt.NDArray[np.float64]
Change = Callable[[Any, Array], Array]


def nothing_fitted(samples: int) -> LinearFit:
    return LinearFit(np.zeros((samples, 0)), np.ones(samples), np.zeros(0))


def _rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.fixture(scope="module")
def scalings(long_study: Any) -> dict[str, list[Array]]:
    """Activation and calcium as they saturate at different pCa."""
    return {
        name: [np.full(r.time_s.size, 1.0 / (1.0 + 10.0 ** (slope * (r.pca - half)))) for r in long_study.residuals]
        for name, slope, half in (("activation", 2.5, 6.0), ("calcium", 1.0, 5.5))
    }


def drag(r: Any, activation: Array) -> Array:
    return 0.01 * np.gradient(r.length_l0, r.time_s)


def maxwell(r: Any, activation: Array) -> Array:
    return 1.5 * activation * exponential_basis(r.time_s, np.diff(r.length_l0), np.array([0.1]))[:, 0]


def yielding(r: Any, activation: Array) -> Array:
    return -1.5 * activation * exponential_basis(r.time_s, np.diff(r.length_l0), np.array([0.02]))[:, 0]


def spring(r: Any, activation: Array) -> Array:
    return 1.5 * activation * r.length_l0


def of_all(study: Any, change: Change, scalings: dict[str, list[Array]]) -> Array:
    return np.concatenate([change(r, a) for r, a in zip(study.residuals, scalings["activation"], strict=True)])


def test_memory_is_exact_for_straight_lengths() -> None:
    """A ramp at speed v: v tau (1 - exp(-t/tau)), whatever the sampling."""
    for step_s in (0.001, 0.037):
        time_s = np.arange(0.0, 0.5, step_s)
        tau_s = np.array([0.002, 0.1, 5.0])
        expected = 0.4 * tau_s * -np.expm1(-time_s[:, None] / tau_s)
        assert np.allclose(exponential_basis(time_s, np.diff(0.4 * time_s), tau_s), expected, rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize(
    ("change", "shortest_s", "longest_s", "scale", "sign"),
    [
        (drag, 0.0, 0.004, "constant", 1),
        (maxwell, 0.07, 0.14, "activation", 1),
        (yielding, 0.012, 0.03, "activation", -1),
        (spring, 2.0, 5.0, "activation", 1),
    ],
)
def test_known_laws_are_recovered(
    long_study: Any,
    scalings: dict[str, list[Array]],
    change: Change,
    shortest_s: float,
    longest_s: float,
    scale: str,
    sign: int,
) -> None:
    data = of_all(long_study, change, scalings) + long_study.noise(_rng(0))
    found = law("f", long_study.after(data), long_study.fit, scalings)
    assert found is not None
    assert shortest_s <= found.time_constant_s <= longest_s * (1.0 + 1e-9)
    assert (found.scales_with, np.sign(found.gain_f0_per_l0)) == (scale, sign)
    assert found.explained_fraction > 0.8
    assert max(found.other_scalings.values()) < found.explained_fraction - 0.15


def test_sizes_of_a_law(long_study: Any, scalings: dict[str, list[Array]]) -> None:
    """Drag comes out in F0 s/L0, an arm in F0/L0, its force in F0, though the fit took part of it."""
    noise = long_study.noise(_rng(1))
    found = law("f", long_study.after(of_all(long_study, drag, scalings) + noise), long_study.fit, scalings)
    assert found is not None
    assert found.gain_f0_per_l0 * found.time_constant_s == pytest.approx(0.01, rel=0.1)
    arm = of_all(long_study, maxwell, scalings)
    found = law("f", long_study.after(arm + noise), long_study.fit, scalings)
    assert found is not None
    assert found.gain_f0_per_l0 == pytest.approx(1.5, rel=0.15)
    assert np.sum(found.weight_f0) == pytest.approx(np.sqrt(np.mean(arm**2)), rel=0.15)


def test_noise_follows_no_law(long_study: Any, scalings: dict[str, list[Array]]) -> None:
    for seed in range(5):
        found = law("f", long_study.after(long_study.noise(_rng(seed))), long_study.fit, scalings)
        assert found is None or found.explained_fraction < 0.1


def test_nothing_left_has_no_law(long_study: Any, scalings: dict[str, list[Array]]) -> None:
    assert law("f", long_study.residuals, long_study.fit, scalings) is None


def test_one_trial_without_scalings(long_study: Any) -> None:
    first = long_study.residuals[0]
    alone = first._replace(value_f0=drag(first, np.empty(0)))
    found = law("f", [alone], nothing_fitted(first.time_s.size), {})
    assert found is not None
    assert found.scales_with == "constant"
    assert found.time_constant_s < 0.004


def held_out_fit(study: Any, held: list[bool]) -> LinearFit:
    weights = np.concatenate([np.full(n, 0.0 if out else 150.0) for n, out in zip(study.sizes, held, strict=True)])
    return LinearFit(study.fit.slopes, weights, study.fit.prior)


@pytest.mark.parametrize("change", [drag, maxwell, yielding, spring])
def test_held_out_trial_is_foretold(long_study: Any, scalings: dict[str, list[Array]], change: Change) -> None:
    """Down to what noise alone would leave, within a quarter."""
    held = [False, False, True, False, False]
    study = long_study._replace(fit=held_out_fit(long_study, held))
    noise = study.noise(_rng(2))
    residuals = study.after(of_all(study, change, scalings) + noise)
    found = discrepancy(residuals, held, study.fit, scalings)
    before, alone = residuals[2].value_f0, study.after(noise)[2].value_f0
    (told,) = found.predicted_f0
    assert np.std(before) > 2.0 * np.std(alone)
    assert np.std(before - told) < 1.25 * np.std(alone) + 0.05 * np.std(before)
    assert found.explained > 0.7


def test_nothing_is_invented_for_noise(long_study: Any, scalings: dict[str, list[Array]]) -> None:
    ratios = []
    for seed in range(5):
        held = [i == seed % 5 for i in range(5)]
        study = long_study._replace(fit=held_out_fit(long_study, held))
        residuals = study.after(study.noise(_rng(seed)))
        (told,) = discrepancy(residuals, held, study.fit, scalings).predicted_f0
        value = residuals[seed % 5].value_f0
        ratios.append(np.sqrt(np.mean((value - told) ** 2) / np.mean(value**2)))
    assert np.median(ratios) < 1.02
    assert max(ratios) < 1.2


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(2, 40), min_size=1, max_size=4), st.integers(0, 100))
def test_any_sizes_of_trials(sizes: list[int], seed: int) -> None:
    random = _rng(seed)
    residuals = [
        Residual(
            str(i),
            None,
            1e-3 * np.arange(n),
            0.01 * random.normal(size=n),
            (),
            0.01 * random.normal(size=n),
            np.ones(n),
        )
        for i, n in enumerate(sizes)
    ]
    scale = {"activation": [np.ones(n) for n in sizes]}
    fit = LinearFit(np.ones((sum(sizes), 1)), np.ones(sum(sizes)), np.ones(1))
    found = law("f", residuals, fit, scale)
    assert found is None or (0.0 < found.explained_fraction <= 1.0 and 0.00199 < found.time_constant_s < 5.01)
    held = [False] * len(sizes)
    assert discrepancy(residuals, held, fit, scale).predicted_f0 == ()


def test_errors_are_one_line(long_study: Any) -> None:
    residuals, fit = long_study.residuals, long_study.fit
    with pytest.raises(UserError, match="scaling 'activation' has"):
        law("f", residuals, fit, {"activation": [np.ones(3)] * 5})
    with pytest.raises(UserError, match="scaling 'force' is not finite"):
        law("f", residuals, fit, {"force": [np.full(n, np.nan) for n in long_study.sizes]})
    with pytest.raises(UserError, match="all 5 trials are held out"):
        discrepancy(residuals, [True] * 5, fit, {})
    with pytest.raises(UserError, match="weight on held-out samples"):
        discrepancy(residuals, [True] + [False] * 4, fit, {})
