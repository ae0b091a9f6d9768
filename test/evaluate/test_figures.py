"""What figures of replay and evaluate show: names, widths of lines, error bars, and no empty figure."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.evaluate.figures import force as force_figure
from xb_muscle_ros.evaluate.figures import srs, surfaces
from xb_muscle_ros.evaluate.force_scores import ForceScores, PairedTests, Spread
from xb_muscle_ros.evaluate.sections import srs_section
from xb_muscle_ros.evaluate.sets import gather
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable
from xb_muscle_ros.models.titles import title_of
from xb_muscle_ros.plotting import trial_pages
from xb_muscle_ros.replay import figure as replay_figure
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated

MODELS = ("2state", "3state_coop", "3state_coop_v3")
Look = Callable[[Any], None]


def table(name: str, recoveries_s: tuple[float, ...], amplitudes_l0: tuple[float, ...], se: float | None) -> SrsTable:
    """SRS of one fibre at two pCa: 20 F0/L0 without conditioning, 15 after."""
    shape = (2, len(recoveries_s), len(amplitudes_l0))
    test = np.where(np.array(amplitudes_l0) > 0.0, 15.0, 20.0) * np.ones(shape)
    isometric = np.array([0.5, 0.2])[:, None, None] * np.ones(shape)
    error = None if se is None else np.full(shape, se)
    fibre = FibreSrs(test, np.full(shape, 20.0), isometric, error, error)
    axes = np.array([6.1, 6.3]), np.array(recoveries_s), np.array(amplitudes_l0)
    return SrsTable(name, *axes, {"18Dec2017a": fibre})


def made(recoveries_s: tuple[float, ...], amplitudes_l0: tuple[float, ...]) -> tuple[Any, Any, Any]:
    data = table("measured", recoveries_s, amplitudes_l0, 2.0)
    tables = {name: table(name, recoveries_s, amplitudes_l0, None) for name in MODELS}
    return data, tables, srs_section(tables, data, gather(["18Dec2017a"], MODELS, None))


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Content of the figures that were drawn: read while they are open."""
    found: list[Any] = []

    def look(figure: Any, path: Path) -> None:
        figure.canvas.draw()
        ticks = {t.get_text() for axis in figure.axes for t in axis.get_xticklabels()}
        words = {t.get_text() for legend in figure.legends for t in legend.get_texts()}
        titles = {axis.get_title() for axis in figure.axes}
        widths = [line.get_linewidth() for axis in figure.axes for line in axis.get_lines()]
        bars = [bar for axis in figure.axes for bar in axis.containers if hasattr(bar, "has_yerr")]
        found.append({"ticks": ticks, "legend": words, "titles": titles, "widths": widths, "bars": bars,
                      "heights": [axis.get_ylim() for axis in figure.axes]})  # fmt: skip

    for module in (srs, force_figure, surfaces, trial_pages):
        monkeypatch.setattr(module, "save", look)
    return found


def test_a_model_has_one_name_in_all_figures(seen: list[Any], tmp_path: Path) -> None:
    names = {"2-state XB", "3-state XB coop", "3-state XB coop v3"}
    assert {title_of(name) for name in MODELS} == names
    data, tables, section = made((0.001, 0.1), (0.0, 0.0383))
    assert srs.draw_srs(tmp_path / "srs.png", data, tables, section)
    assert names <= seen[0]["legend"]
    assert names <= seen[0]["ticks"]
    held = Spread(0.1, None, {"a": 0.1}, 1)
    overall = {name: {"whole": held, "conditioning": None, "test": held} for name in MODELS}
    force = ForceScores(overall, {}, {}, PairedTests(0.05, []))
    force_figure.draw_force(tmp_path / "force.png", force)
    assert names <= seen[1]["ticks"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert surfaces.draw_surfaces(tmp_path / "one.png", data, {"2state": tables["2state"]}) == ["2state"]
    assert "2-state XB" in seen[2]["titles"]


def test_measured_fibres_have_their_errors(seen: list[Any], tmp_path: Path) -> None:
    data, tables, section = made((0.001, 0.1), (0.0, 0.0383))
    srs.draw_srs(tmp_path / "srs.png", data, tables, section)
    # Segments of the error bars of the dots: 15/20 with 10 % and 13 % errors.
    segments = [part for bar in seen[0]["bars"] for lines in bar[2] for part in lines.get_segments() if len(part)]
    reach = [float(np.ptp(np.asarray(part)[:, 1])) for part in segments]
    one = 2.0 * 0.75 * np.hypot(2.0 / 15.0, 2.0 / np.sqrt(2.0) / 20.0)
    assert max(reach) == pytest.approx(one, rel=0.01)


def test_nothing_to_draw_is_not_drawn(seen: list[Any], tmp_path: Path) -> None:
    data, tables, section = made((0.07,), (0.01, 0.03))
    assert not srs.draw_srs(tmp_path / "srs.png", data, tables, section)
    assert seen == []


@pytest.mark.parametrize("count", [1, 12])
def test_measured_force_is_a_thin_line(seen: list[Any], tmp_path: Path, count: int) -> None:
    trial = StretchShortenStretch(0.0383, 0.1).trial("f", 6.1)
    trial = replace(trial, force_time_s=trial.time_s, force_n=np.ones(trial.time_s.size))
    simulated = Simulated(*[trial.time_s] * 4, dict.fromkeys(MOMENTS, trial.time_s))
    replay_figure.draw_replay(tmp_path / "replay.png", [trial] * count, [simulated] * count, title_of("2state"))
    assert len(seen) == (count + 8) // 9
    assert max(width for page in seen for width in page["widths"]) <= 1.0


def test_a_held_length_does_not_fill_its_panel_with_noise(seen: list[Any], tmp_path: Path) -> None:
    trial = StretchShortenStretch(0.0383, 0.1).trial("f", 6.1)
    held = replace(trial, length_m=1.0 + 1e-4 * np.sin(1e3 * trial.time_s))
    simulated = Simulated(*[held.time_s] * 4, dict.fromkeys(MOMENTS, held.time_s))
    replay_figure.draw_replay(tmp_path / "replay.png", [held], [simulated], "model")
    low, high = seen[0]["heights"][0]
    assert high - low == pytest.approx(2.0)
