"""Figures of fits: axes that show the profile, ticks that can be read, ends that differ in look."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.fit.figures import pages, profiles
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json
from xb_muscle_ros.fit.run import Fitted, Settings, fit
from xb_muscle_ros.plotting import trial_pages
from xb_muscle_ros.work import Options

Drawn = Callable[..., Any]


def row(name: str, middle: float, ratio: float, start: float, ended_by: tuple[str, str] = ("data", "data")) -> Any:
    """A profile whose interval goes from the middle by a factor both ways; open ends do not reach the limit."""
    points = [[middle / ratio, 1.96 if ended_by[0] == "data" else 1.2], [middle, 0.0]]
    points += [[middle * ratio, 1.96 if ended_by[1] == "data" else 0.7]]
    return {
        "name": name,
        "group": None,
        "unit": "1/power stroke",
        "start": start,
        "value": middle,
        "log_scale": True,
        "profile": points,
        "interval": [middle / ratio, middle * ratio],
        "interval_ended_by": list(ended_by),
    }


ROWS = [
    row("f", 94.84, 1.003, 30.0),
    row("kse", 0.33035, 1.0017, 60.0),
    row("koop", 2.4, 30.0, 2.5, ("prior", "bound")),
    row("JF", 208.0, 900.0, 1e7, ("bound of k21", "data")),
    row("k11", 6.9e-5, 1.4, 7e-5),
    row("k22", 123456.0, 1.02, 1e-3),
    row("weak_detachment", 1500.0, 3.0, 1400.0, ("search", "data")),
    row("hs_stiffness", 0.0005, 7.9, 0.0005),
]


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Drawn:
    """Draws profiles; gives the figure as it was saved, laid out."""
    kept: list[Any] = []

    def keep(made: Any, path: Path) -> None:
        made.canvas.draw()
        kept.append(made)

    for module in (profiles, pages, trial_pages):
        monkeypatch.setattr(module, "save", keep)

    def draw(rows: list[Any]) -> Any:
        profiles.draw_profiles(tmp_path / "p.png", {"parameters": rows, "level": 0.95})
        return kept[-1]

    draw.kept = kept
    return draw


def boxes(axes: Any) -> list[Any]:
    """Boxes of the tick labels within an axis, on the canvas."""
    low, high = sorted(axes.get_xlim())
    labels = [t.label1 for t in axes.xaxis.get_major_ticks() if low <= t.get_loc() <= high]
    return [label.get_window_extent() for label in labels if label.get_text()]


@pytest.mark.parametrize("count", [1, 3, 8])
def test_profiles_fill_their_axes_and_ticks_do_not_overlap(drawn: Drawn, count: int) -> None:
    made = drawn(ROWS[:count])
    assert len(made.axes) == count
    for axes, each in zip(made.axes, ROWS[:count], strict=True):
        line = next(line for line in axes.lines if line.get_marker() == "o")
        ends = axes.transAxes.inverted().transform(axes.transData.transform([(x, 0.0) for x in line.get_xdata()]))
        # Wherever the fit started: the profile covers most of the axis, and all of it is seen.
        assert 0.8 < np.ptp(ends[:, 0]) <= 1.0, each["name"]
        found = boxes(axes)
        assert 2 <= len(found) <= 5, each["name"]
        for a, b in itertools.combinations(found, 2):
            assert not a.overlaps(b), each["name"]
    canvas = made.bbox
    below = [axes.xaxis.label.get_window_extent() for axes in made.axes]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(below, 2))
    for text in (*made.legends[0].get_texts(), *(axes.xaxis.label for axes in made.axes)):
        box = text.get_window_extent()
        assert canvas.x0 <= box.x0
        assert box.x1 <= canvas.x1


def test_ends_are_told_apart_without_colour(drawn: Drawn) -> None:
    made = drawn([ROWS[2], ROWS[3]])
    styles = [[line.get_linestyle() for line in axes.lines if len(line.get_xdata()) == 2][1:] for axes in made.axes]
    assert styles == [["-.", "--"], ["--", "-"]]
    labels = [text.get_text() for text in made.legends[0].get_texts()]
    assert {"end by the data", "end by the prior", "open: a bound or none"} < set(labels)


def test_a_start_beyond_the_axis_is_an_arrow_with_its_value(drawn: Drawn) -> None:
    made = drawn(ROWS[:2])
    assert [[text.get_text() for text in axes.texts] for axes in made.axes] == [["30"], ["60"]]
    markers = [{line.get_marker() for line in axes.lines if len(line.get_xdata()) == 1} for axes in made.axes]
    assert markers == [{"<"}, {">"}]


@pytest.mark.parametrize(("low", "high"), [(1.0, 8.0), (0.02, 3e5), (7e-6, 9e-5), (3.1, 28.0)])
def test_log_ticks_are_few_round_and_inside(low: float, high: float) -> None:
    ticks = profiles.log_ticks(low, high)
    assert 2 <= len(ticks) <= 4
    assert all(low <= tick <= high for tick in ticks)
    assert all(f"{tick:e}"[0] in "1235" for tick in ticks)


def test_residuals_of_the_fit_fill_their_axis_however_far_off_the_start(
    problem: Problem, drawn: Drawn, tmp_path: Path
) -> None:
    far = [replace(c, start=c.start * 3.0) if c.name == "f" else c for c in problem.coordinates]
    fitted: Fitted = fit(
        replace(problem, coordinates=tuple(far)), Settings(1, level=None), Options(processes=0, quiet=True)
    )
    pages.draw(tmp_path, fitted, as_json(fitted, {}))
    made = drawn.kept[0]
    for axes in made.axes[1::2]:
        lines = [line for line in axes.lines if line.get_linestyle() == "-" and len(line.get_xdata()) > 2]
        assert np.max(np.abs(lines[0].get_ydata())) > 0.3 * axes.get_ylim()[1]
    titles = [axes.get_window_extent() for axes in made.axes]
    assert all(box.x1 <= made.bbox.x1 for box in titles)
    for axes in made.axes[::2]:
        assert axes._left_title.get_window_extent().x1 <= made.bbox.x1 + 1.0


def test_correlations_close_to_one_are_not_rounded_to_it() -> None:
    assert [pages._number(v) for v in (0.996, -0.42, 1.0)] == [".99", "−.42", "1.00"]
