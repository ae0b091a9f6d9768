"""Parts of a study that want other parameters, and what the report makes of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from xb_muscle_ros.diagnose.conflict import Conflict, conflicts
from xb_muscle_ros.diagnose.report.conflicts import contradiction

Array = npt.NDArray[np.float64]


@pytest.fixture
def parted(study: Any) -> Any:
    """Two solutions: of three trials and of two."""
    levels = (4.5, 4.5, 4.5, 6.3, 6.3)
    return study._replace(residuals=tuple(r._replace(pca=p) for r, p in zip(study.residuals, levels, strict=True)))


def found(study: Any, change: Array, model_of: Any, seed: int = 0) -> dict[str, Conflict]:
    noise = study.noise(np.random.default_rng(seed))
    rows = conflicts(study.after(noise + change), study.fit, model_of(study.windows(noise)))
    return {row.between: row for row in rows}


def along(study: Any, sizes: tuple[float, ...]) -> Array:
    """One parameter's doing, of a size for each trial."""
    return np.repeat(sizes, study.sizes) * study.fit.slopes[:, 0]


def test_parameter_that_differs_between_solutions(parted: Any, model_of: Any) -> None:
    rows = found(parted, along(parted, (0.1, 0.1, 0.1, -0.1, -0.1)), model_of)
    assert set(rows) == {"solutions", "trials"}
    assert (rows["solutions"].parts, rows["trials"].parts) == (2, 5)
    assert rows["solutions"].gone > 0.95
    assert 0.1 < rows["solutions"].furthest < 0.3


def test_parameter_that_differs_between_trials(parted: Any, model_of: Any) -> None:
    rows = found(parted, along(parted, (0.1, -0.1, 0.1, -0.1, 0.1)), model_of)
    assert rows["solutions"].gone < 0.5
    assert rows["trials"].gone > 0.95


def test_mismatch_that_no_parameter_can_do_stays_in_every_part(parted: Any, model_of: Any) -> None:
    times = np.concatenate([r.time_s for r in parted.residuals])
    rows = found(parted, 0.02 * np.sin(2.0 * np.pi * 40.0 * times), model_of)
    assert all(row.gone < 0.3 for row in rows.values())


def test_kinds_of_protocol(study: Any, model_of: Any) -> None:
    short = [r._replace(pca=6.0, phases=r.phases[: 3 if i % 2 else 6]) for i, r in enumerate(study.residuals)]
    rows = found(study._replace(residuals=tuple(short)), along(study, (0.1, -0.1, 0.1, -0.1, 0.1)), model_of)
    assert list(rows) == ["protocols", "trials"]
    assert rows["protocols"].parts == 2
    assert rows["protocols"].gone > 0.95


def test_solutions_of_one_trial_each_are_trials(study: Any, model_of: Any) -> None:
    assert list(found(study, along(study, (0.1, -0.1, 0.1, -0.1, 0.1)), model_of)) == ["trials"]


def test_noise_is_no_conflict(study: Any, model_of: Any) -> None:
    noise = study.noise(np.random.default_rng(3))
    loud = model_of([w._replace(force_f0=2.0 * w.force_f0) for w in study.windows(noise)])
    assert conflicts(study.after(noise), study.fit, loud) == []


@pytest.mark.parametrize(
    ("shares", "says"),
    [
        ({"solutions": (0.97, 1.0), "protocols": (0.4, 1.0), "trials": (0.99, 1.0)}, "The solutions contradict"),
        (
            {"solutions": (0.4, 1.0), "protocols": (0.95, 1.0), "trials": (0.99, 1.0)},
            "The kinds of protocol contradict",
        ),
        ({"trials": (0.97, 1.0)}, ""),
        ({"solutions": (0.5, 1.0), "protocols": (0.4, 1.0), "trials": (0.6, 9.0)}, "lies within the trials"),
        ({"solutions": (0.97, 5.0), "protocols": (0.4, 1.0), "trials": (0.99, 1.0)}, ""),
        ({"solutions": (0.97, 1.0), "protocols": (0.95, 1.0), "trials": (0.99, 1.0)}, ""),
        ({"protocols": (0.85, 1.0), "trials": (0.9, 1.0)}, ""),
        ({}, ""),
    ],
)
def test_words_only_where_it_is_clear(shares: dict[str, tuple[float, float]], says: str) -> None:
    rows = [{"between": key, "gone": gone, "furthest": far} for key, (gone, far) in shares.items()]
    told = contradiction(rows)
    assert says in told if says else told == ""
