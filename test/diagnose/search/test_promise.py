"""What a candidate promises to first order, held against its own fit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_trials import fitted_trials, given_fibre, trials_of, truth

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.search.descent import Descent, Fit, Point, fitted
from xb_muscle_ros.diagnose.search.promise import BLIND, Linear, promise
from xb_muscle_ros.diagnose.search.system import System

DRAG = Name.VISCOUS_DRAG


@pytest.fixture(scope="module")
def linear(system: System, base_fit: Fit) -> Linear:
    return Linear(system, base_fit)


def test_the_gain_of_a_drag_is_that_of_its_fit(system: System, linear: Linear, base_fit: Fit, drag_fit: Fit) -> None:
    found = promise(linear, DRAG)
    gained = base_fit.cost(system) - drag_fit.cost(system)
    assert found.gain == pytest.approx(gained, rel=0.4)
    (start,) = found.starts
    assert start["drag"] == pytest.approx(drag_fit.values["drag"], rel=0.3)
    assert found.mean_square_f0 < 0.3 * base_fit.mean_square_f0
    # And it is what promises most of all that is not nearly the same.
    for other in (Name.ACTIVE_TITIN, Name.LATTICE_SPACING, Name.TEMPERATURE):
        assert promise(linear, other).gain < found.gain


def test_a_fit_that_has_everything_is_promised_little(system: System, drag_fit: Fit) -> None:
    complete = Linear(system, drag_fit)
    for name in (Name.ACTIVE_TITIN, Name.LATTICE_SPACING, Name.TIME_SHIFT, Name.FORCE_DRIFT):
        assert promise(complete, name).gain < 5.0


def test_what_only_a_fit_can_tell_has_every_start_of_the_catalogue(base_fit: Fit) -> None:
    system = System(given_fibre("2state"), (), np.empty(0), 1e-3)
    bare: Any = SimpleNamespace(system=system, fit=base_fit)
    assert Name.THIN_FILAMENT_COOPERATIVITY in BLIND
    found = promise(bare, Name.THIN_FILAMENT_COOPERATIVITY)
    assert np.isnan(found.gain)
    assert np.isnan(found.mean_square_f0)
    assert {start["koop"] for start in found.starts} == {1.0, 3.0, 10.0}
    assert all(start["f"] == base_fit.values["f"] for start in found.starts)


def test_no_effect_is_no_promise() -> None:
    """A drag that would have to be negative is none."""
    trials = trials_of(truth(), (4.5, 6.2), noise_f0=1e-5, ordinary=False)
    system = System.of(given_fibre(), fitted_trials(trials), 1e-3)
    fit = fitted(system, (), [{}], 6, 0.05)
    assert fit is not None
    assert promise(Linear(system, fit), DRAG).gain < 1.0


@pytest.mark.parametrize(
    ("name", "faults"),
    [(Name.PCA_SHIFT, {6.2: 0.3}), (Name.PCA_SHIFT, {6.2: -0.25})],
)
def test_an_artefact_s_promise_goes_the_way_of_its_fit(name: Name, faults: dict[float, float]) -> None:
    trials = trials_of(given_fibre(), (4.5, 6.0, 6.2, 6.4), noise_f0=3e-4, ordinary=False, shifts=faults)
    system = System.of(given_fibre(), fitted_trials(trials), 1e-3)
    base, wide = (fitted(system, names, [{}], 8, 0.02) for names in ((), (name,)))
    assert base is not None
    assert wide is not None
    found = promise(Linear(system, base), name)
    # The base has the shift already, and pays for it.
    assert abs(base.values["pca_shift[pCa 6.2]"]) > 0.1
    assert found.gain == pytest.approx(base.cost(system) - wide.cost(system), rel=0.3)
    assert found.gain > 5.0
    (start,) = found.starts
    # Calcium of all solutions together is the thin filament's; that of one against the others is not.
    for values in (start, wide.values):
        others = 0.5 * (values["pca_shift[pCa 6]"] + values["pca_shift[pCa 6.4]"])
        assert values["pca_shift[pCa 6.2]"] - others == pytest.approx(faults[6.2], abs=0.06)


def test_a_fault_that_no_set_has_by_itself_is_promised_too(system: System, linear: Linear) -> None:
    found = promise(linear, Name.TRANSDUCER_LAG)
    assert np.isfinite(found.gain)
    assert "transducer_lag" in found.starts[0]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_joint_step_is_that_of_least_squares(seed: int) -> None:
    """A straight model: moves are those of stacked least squares, and the gain is the cost before less that after."""
    random = np.random.default_rng(seed)
    n, own, more = 60, 3, 2
    weights, slopes, columns = random.uniform(0.2, 1.0, n), random.normal(size=(n, own)), random.normal(size=(n, more))
    system = System(given_fibre(), (), weights, 1e-3)
    z, means, information = random.normal(size=own), random.normal(size=own), random.uniform(0.5, 2.0, own)
    residual, of_more = random.normal(size=n), random.uniform(0.5, 2.0, more)
    descent, linear = Descent.__new__(Descent), Linear.__new__(Linear)
    descent.system, descent.total, descent.information = system, float(weights.sum()), information
    descent.problem = SimpleNamespace(coordinates=[SimpleNamespace(prior_mean=m) for m in means])
    descent.of_features = np.zeros((0, own))
    mean_square = float(weights @ residual**2) / descent.total
    linear.system, linear.descent, linear.slopes = system, descent, slopes
    linear.point = Point(z, residual, mean_square, np.sqrt(information) * (z - means), np.empty(0))
    linear.free = np.array([True, True, False])

    moves, found, gain, after = linear.solve(columns, of_more, np.zeros(more))

    samples = np.sqrt(system.effective_samples * weights / descent.total / (system.noise_f0**2 + mean_square))
    roots = np.sqrt(np.concatenate([information[:2], of_more]))
    stacked = np.vstack([np.hstack([slopes[:, :2], columns]) * samples[:, None], np.diag(roots)])
    target = -np.concatenate([residual * samples, roots * np.concatenate([(z - means)[:2], np.zeros(more)])])
    step = np.linalg.lstsq(stacked, target, rcond=None)[0]
    assert moves == pytest.approx([*step[:2], 0.0], rel=1e-6)
    assert found == pytest.approx(step[2:], rel=1e-6)

    def cost(left: np.ndarray, at: np.ndarray, of_columns: np.ndarray) -> float:
        square = float(weights @ left**2) / descent.total
        priors = 0.5 * float(information @ (at - means) ** 2 + of_more @ of_columns**2)
        return priors + 0.5 * system.effective_samples * float(np.log(system.noise_f0**2 + square))

    left = residual + slopes @ moves + columns @ found
    assert after == pytest.approx(float(weights @ left**2) / descent.total, rel=1e-9)
    assert gain == pytest.approx(cost(residual, z, np.zeros(more)) - cost(left, z + moves, found), rel=1e-6)
    assert gain > 0.0
