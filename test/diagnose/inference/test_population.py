"""One distribution over fibres, held against sums over fine grids of everything that is not known."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.inference.population import Estimate, adjustment, distribution

Array = npt.NDArray[np.float64]
SCALES, SPREADS = (0.06, 0.25, 1.0), (0.1, 0.3, 1.0)


def estimate(
    likeliest: float, own_sd: float, prior_sd: float = 1.0, effect: bool = True, mean: float = 0.0
) -> Estimate:
    """What a fit says of data that alone would have it at a value, give or take: prior and data together."""
    information = own_sd**-2.0 + prior_sd**-2.0
    value = (likeliest * own_sd**-2.0 + mean * prior_sd**-2.0) / information
    return Estimate(value, information**-0.5, mean, prior_sd, effect)


def normal(x: Array | float, mean: Array | float, sd: float) -> Array:
    return np.exp(-0.5 * ((np.asarray(x) - mean) / sd) ** 2) / (sd * math.sqrt(2.0 * math.pi))


def likelihood(x: Array, e: Estimate) -> Array:
    """Of one fibre's data, 1 at its best."""
    return np.exp(-0.5 * e.information * (x - e.likeliest) ** 2)


def widths(es: Sequence[Estimate]) -> list[tuple[float, float]]:
    scales = SCALES if es[0].effect else (1.0,)
    spreads = SPREADS if len(es) > 1 else (0.0,)
    return [(s * es[0].prior_sd, r * s * es[0].prior_sd) for s, r in itertools.product(scales, spreads)]


def marginal(es: Sequence[Estimate], sd: float, spread: float, moment: int = 0) -> float:
    """Likelihood of all fibres, summed over their own values and over the centre; or the centre's moment of it."""
    mean = es[0].prior_mean
    centres = mean + np.linspace(-8.0, 8.0, 2401) * sd
    total = normal(centres, mean, sd)
    for e in es:
        if spread == 0.0:
            total = total * likelihood(centres, e)
            continue
        # As fine as the narrower of both.
        width = min(spread, e.information**-0.5 if e.information else spread)
        values = np.arange(mean - 8.0 * (sd + spread), mean + 8.0 * (sd + spread), width / 3.0)
        step = values[1] - values[0]
        own = likelihood(values, e)
        total = total * np.array([np.sum(own * normal(values, c, spread)) * step for c in centres])
    return float(np.sum(total * centres**moment) * (centres[1] - centres[0]))


CASES = {
    "one large": [estimate(1.5, 0.2)],
    "one small": [estimate(0.05, 0.05)],
    "one of a shape": [estimate(0.7, 0.3, 0.5, False, 0.4)],
    "three alike": [estimate(0.8, 0.2), estimate(0.9, 0.3), estimate(0.75, 0.25)],
    "two apart": [estimate(1.2, 0.2), estimate(-0.9, 0.2)],
    "shapes": [estimate(1.2, 0.3, 1.5, False, 1.0), estimate(0.6, 0.4, 1.5, False, 1.0)],
}


@pytest.mark.parametrize("case", CASES)
def test_evidence_is_that_of_sums_over_everything_unknown(case: str) -> None:
    es = CASES[case]
    together = np.mean([marginal(es, sd, spread) for sd, spread in widths(es)])
    alone = [marginal([e], e.prior_sd, 0.0) for e in es]
    assert adjustment(es) == pytest.approx(math.log(together) - sum(math.log(a) for a in alone), abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_centre_and_its_error_are_those_of_the_sums(case: str) -> None:
    es = CASES[case]
    moments = np.array([[marginal(es, sd, spread, k) for k in range(3)] for sd, spread in widths(es)])
    total, first, second = moments.sum(axis=0)
    found = distribution(es)
    assert found.mean == pytest.approx(first / total, abs=2e-3)
    assert found.se == pytest.approx(math.sqrt(second / total - (first / total) ** 2), rel=2e-2)
    spreads = np.array([spread for _, spread in widths(es)])
    assert found.spread == pytest.approx(float(spreads @ moments[:, 0]) / total, rel=2e-2)


def test_data_alone_are_what_the_posterior_has_beyond_the_prior() -> None:
    e = estimate(1.5, 0.2, 0.7, mean=0.3)
    assert e.likeliest == pytest.approx(1.5)
    assert e.information == pytest.approx(25.0)
    blind = Estimate(0.4, 1.0, 0.4, 1.0, True)
    assert (blind.information, blind.likeliest) == (0.0, 0.4)
    assert distribution([blind]).mean == pytest.approx(0.4)


def test_one_fibre_with_nothing_to_tell_changes_nothing() -> None:
    known = [estimate(0.8, 0.2), estimate(0.9, 0.3)]
    silent = Estimate(0.0, 1.0, 0.0, 1.0, True)
    assert adjustment([*known, silent]) == pytest.approx(adjustment(known), abs=1e-9)
    assert distribution([*known, silent]).mean == pytest.approx(distribution(known).mean, abs=1e-9)


def test_a_small_effect_is_likelier_than_a_wide_prior_has_it_and_a_large_one_less() -> None:
    assert adjustment([estimate(0.02, 0.02)]) > 0.5
    assert -1.2 < adjustment([estimate(1.5, 0.1)]) < 0.0


@pytest.mark.parametrize("size", [0.3, 0.8])
def test_replication_raises_the_evidence_and_contradiction_lowers_it(size: float) -> None:
    """Against fibres whose effects have nothing to do with each other."""
    one = estimate(size, 0.1)
    apart = sum(adjustment([e]) for e in (one, one, one))
    assert adjustment([one, one, one]) > apart + 0.5
    other = estimate(-size, 0.1)
    assert adjustment([one, other, one, other]) < adjustment([one, one, one, one]) - 1.0
    assert distribution([one, other]).spread > distribution([one, one]).spread


@settings(max_examples=40)
@given(st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(0.05, 0.9)), min_size=1, max_size=5))
def test_centre_lies_between_prior_and_fibres(rows: list[tuple[float, float]]) -> None:
    es = [estimate(value, sd) for value, sd in rows]
    found = distribution(es)
    values = [0.0, *(value for value, _ in rows)]
    assert min(values) - 1e-9 <= found.mean <= max(values) + 1e-9
    assert 0.0 < found.se <= 3.0
    assert math.isfinite(adjustment(es))
    turned = [estimate(-value, sd) for value, sd in rows]
    assert adjustment(turned) == pytest.approx(adjustment(es), abs=1e-9)
    assert distribution(turned).mean == pytest.approx(-found.mean, abs=1e-9)
