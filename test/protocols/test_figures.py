"""Figures of protocols: several pCa are told apart, and words and ticks do not lie on each other."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.plotting.style import figure
from xb_muscle_ros.protocols.registry import PROTOCOLS

FIBRE = "18Dec2017a"


def drawn(name: str, **given: list[float]) -> Any:
    (found,) = xb.run_protocol(name, FIBRE, tell=lambda line: None, **given).results
    protocol = PROTOCOLS[name]
    with figure(*protocol.size_mm([found])) as made:
        protocol.draw(made, [found])
        made.draw_without_rendering()
        return made


def apart(made: Any, words: list[Any]) -> bool:
    boxes = [each.get_window_extent(made.canvas.get_renderer()) for each in words if each.get_text()]
    return not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("force-clamp", {"load": [0.1, 0.4, 0.7]}),
        ("force-velocity", {"velocity": [0.1, 0.4, 0.8]}),
        ("ktr", {}),
        ("ramp-hold", {}),
    ],
)
def test_several_pca_have_a_lightness_each(name: str, given: dict[str, list[float]]) -> None:
    made = drawn(name, pca=[4.5, 6.1, 6.3], **given)
    (legend,) = (
        each.get_legend() for each in made.axes if each.get_legend() and each.get_legend().get_title().get_text()
    )
    assert legend.get_title().get_text() == "pCa"
    assert [each.get_text() for each in legend.get_texts()] == ["4.5", "6.1", "6.3"]
    lightness = [float(np.mean(each.get_color())) for each in legend.get_lines()]
    assert np.all(np.diff(lightness) > 0.1)  # in grey as well
    colours = {
        tuple(np.round(line.get_color(), 6))
        for axis in made.axes
        for line in axis.lines
        if line.get_label() == "3-state XB coop"
    }
    assert len(colours) == 3


def test_one_pca_needs_no_legend_of_its_own() -> None:
    made = drawn("force-clamp", pca=[4.5], load=[0.1, 0.4, 0.7])
    assert made.axes[0].get_legend() is None


def test_work_loops_that_differ_by_several_things_have_numbers() -> None:
    made = drawn("work-loop", frequency=[2.0], amplitude=[0.03, 0.05, 0.08], phase=[-0.2, -0.1, 0.0, 0.1])
    (key,) = (each for each in made.legends if len(each.get_texts()) > 1)
    assert [each.get_text() for each in key.get_texts()][::11] == [
        "1: 3 % L$_0$, -0.2 phase",
        "12: 8 % L$_0$, 0.1 phase",
    ]
    for axis in made.axes:
        said = [each for each in axis.texts if each.get_text()]
        assert sorted(int(each.get_text()) for each in said) == list(range(1, 13))
        assert apart(made, said)


def test_work_loops_that_differ_by_one_thing_are_named_by_it() -> None:
    made = drawn("work-loop", frequency=[1.0, 2.0, 3.0])
    loops, power, cycles = made.axes
    for axis in (loops, cycles):
        assert sorted(each.get_text() for each in axis.texts if each.get_text()) == ["1 Hz", "2 Hz", "3 Hz"]
    assert not power.texts


def test_ticks_of_a_tetanus_are_apart_and_its_markers_whole() -> None:
    made = drawn("tetanus")
    for axis in made.axes[1:]:
        ticks = axis.get_xticklabels()
        low, high = axis.get_xlim()
        assert "10" in {each.get_text() for each in ticks}
        assert apart(made, [each for each in ticks if low <= each.get_position()[0] <= high])
        assert not any(line.get_clip_on() for line in axis.lines if line.get_marker() == "s")
