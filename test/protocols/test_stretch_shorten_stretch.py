"""Stretch-shorten-stretch: what its figure says of recovery times and pCa."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

import xb_muscle_ros as xb
from xb_muscle_ros.protocols.base import MEASURED, Found
from xb_muscle_ros.protocols.registry import PROTOCOLS
from xb_muscle_ros.scores.readout import SRS_TEST


def drawn(rows: list[tuple[float | None, float | None]]) -> tuple[list[str], list[str]]:
    """Labels of the axis of recovery times, and the words beside points."""
    cells = tuple({"pca": pca, "recovery_s": recovery, SRS_TEST: 10.0 + k} for k, (pca, recovery) in enumerate(rows))
    figure = Figure()
    PROTOCOLS["stretch-shorten-stretch"].draw(figure, [Found("made", MEASURED, cells)])
    figure.draw_without_rendering()
    points = figure.axes[1]
    return [each.get_text() for each in points.get_xticklabels()], [each.get_text() for each in points.texts]


def test_each_recovery_time_is_a_tick_even_where_a_decade_holds_them_all() -> None:
    ticks, names = drawn([(4.5, 0.1), (6.1, None), (6.1, 0.1), (6.3, 0.1), (6.1, 0.5)])
    assert ticks == ["100", "500"]
    assert names == ["pCa 4.5", "pCa 6.1", "pCa 6.3"]


@pytest.mark.parametrize("rows", [[(6.1, 0.0), (6.1, 0.1)], [(None, 0.1)], [(6.1, None)]])
def test_one_pca_or_none_needs_no_name(rows: list[tuple[float | None, float | None]]) -> None:
    assert drawn(rows)[1] == []


def test_an_srs_of_too_few_samples_is_told() -> None:
    made = xb.run_protocol("stretch-shorten-stretch", "18Dec2017a", as_measured=True, rate=250, tell=lambda line: None)
    told: list[str] = []
    xb.analyse_protocol("stretch-shorten-stretch", made, tell=told.append)
    for text in ("SRS, conditioning", "SRS, test"):
        assert any(text in line and "in the first 10 ms of the stretch; 3 are needed" in line for line in told)
