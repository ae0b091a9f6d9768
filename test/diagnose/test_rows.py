"""Rows of the record: places of a mismatch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.diagnose.noise.cells import Residual, cut, mean, rms
from xb_muscle_ros.diagnose.noise.significance import Significance
from xb_muscle_ros.diagnose.rows import places
from xb_muscle_ros.trials.trial import Phase

PHASES = (Phase("isometric", 0.0, 0.2), Phase("test_stretch", 0.2, 0.3), Phase("hold", 0.3, 0.4))


def significance(*sizes: float, p: tuple[float, ...] = (), overall_p: float = 0.001) -> Significance:
    """One trial of three phases with residuals of these sizes."""
    time_s = np.arange(400) / 1e3
    value = np.select([time_s < 0.2, time_s < 0.3], [sizes[0], sizes[1]], sizes[2])
    r = Residual("a", 6.2, time_s, value, PHASES, 0.0 * time_s, 1.0 + 0.0 * time_s)
    cells = cut([r])
    found = rms(cells, value[:, None])[:, 0]
    whole = float(np.sqrt(np.mean(value**2)))
    chances = np.array(p or (0.001,) * len(cells))
    return Significance(
        (r,), cells, found, mean(cells, value[:, None])[:, 0], chances, np.full(len(cells), 0.003), whole, 1e-3,
        overall_p, 0.003,
    )  # fmt: skip


def test_the_largest_place_comes_first_with_its_sign_and_solution() -> None:
    first, second = places(["f"], [significance(0.001, 0.02, -0.05)])
    assert (first.phase, second.phase) == ("hold", "test_stretch")
    assert first.mean_f0 == pytest.approx(-0.05)
    assert (first.fibre, first.trial, first.pca) == ("f", "a", 6.2)
    assert second.start_s >= 0.2
    assert second.end_s <= 0.3


def test_where_only_the_whole_stands_out_its_largest_cell_is_told() -> None:
    spread = significance(0.004, 0.005, 0.004, p=(0.2, 0.3, 0.2))
    (only,) = places(["f"], [spread])
    assert only.phase == "test_stretch"
    assert places(["f"], [replace(spread, overall_p=0.5)]) == ()


def test_of_several_fibres_the_largest_come_first_and_not_all() -> None:
    found = places(["f", "g"], [significance(0.001, 0.02, 0.03), significance(0.001, 0.05, 0.001)])
    assert [(p.fibre, p.phase) for p in found] == [("g", "test_stretch"), ("f", "hold"), ("f", "test_stretch")]
    many = places([str(k) for k in range(9)], [significance(0.001, 0.02, 0.03)] * 9)
    assert len(many) == 12
