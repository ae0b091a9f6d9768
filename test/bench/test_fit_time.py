"""The fit study: both methods find the same point."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.bench.fit_time import collocation, least_squares, made_problem
from xb_muscle_ros.models.fibre_file import changed, load_fibre


@pytest.fixture(scope="module")
def problem():
    truth = load_fibre("18Dec2017a")
    return made_problem(truth, changed(truth, {"f": 100.0, "k21": 20.0}, "test"), (4.5,), ["f", "k21"])


def test_least_squares_find_the_truth(problem) -> None:
    found = least_squares(problem)
    truth = load_fibre("18Dec2017a").values
    values = problem.fibre_at(found.z).values
    assert found.converged
    assert found.rmsd_f0 == pytest.approx(1e-3, rel=0.4)
    assert values["f"] == pytest.approx(truth["f"], rel=0.03)
    assert values["k21"] == pytest.approx(truth["k21"], rel=0.03)


def test_collocation_ends_where_least_squares_do(problem) -> None:
    pytest.importorskip("casadi", reason="CasADi is not installed: pip install casadi")
    ours, theirs = least_squares(problem), collocation(problem)
    assert theirs.converged
    # Trapezoids of 1 ms are not our steps: a difference of 0.1 % in the parameters is theirs.
    np.testing.assert_allclose(theirs.z, ours.z, atol=3e-3)
    assert theirs.rmsd_f0 == pytest.approx(ours.rmsd_f0, rel=0.01)
