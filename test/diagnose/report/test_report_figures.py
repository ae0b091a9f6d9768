"""Figures of a diagnosis with few and with many of everything: nothing that is written lies on anything else."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from layout_of_figures import boxes, outside, touching
from many_of_everything import many
from sample_diagnoses import ALL, Sample, five_fibres, nothing, one_fibre, unexplained

from xb_muscle_ros.diagnose.report.figures import (
    FIGURES,
    before_after,
    contributions,
    fibres,
    laws,
    probabilities,
    residual_map,
)
from xb_muscle_ros.diagnose.report.figures.common import Figure, trial_labels
from xb_muscle_ros.diagnose.result import Diagnosis

# Fibres, trials of each, phases, components.
SIZES = [(1, 1, 3, 1), (1, 24, 12, 7), (5, 7, 6, 20), (40, 5, 30, 31)]


def draw_all(sample: Sample) -> dict[str, Figure | None]:
    return {name: draw(*sample) for name, draw in FIGURES.items()}


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What touches, what is out of the figure, all that is written and its height in mm, of every figure drawn."""
    seen: list[Any] = []

    def looked_at(made: Any) -> str:
        found = boxes(made)
        seen.append((touching(found), outside(made, found), [text for text, _ in found], 25.4 * made.get_figheight()))
        return ""

    for module in (before_after, contributions, fibres, laws, probabilities, residual_map):
        monkeypatch.setattr(module, "svg", looked_at)
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("long", [False, True])
def test_nothing_written_lies_on_anything_else(drawn: list[Any], size: tuple[int, int, int, int], long: bool) -> None:
    figures = draw_all(many(*size, long=long))
    assert [name for name, figure in figures.items() if figure is None] == (["fibres"] if size[0] == 1 else [])
    for touching_ones, out, _, high_mm in drawn:
        assert touching_ones == []
        assert out == []
        # A page of A4 with its caption.
        assert high_mm < 250.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL)
def test_samples_have_their_figures(drawn: list[Any], name: str) -> None:
    figures = draw_all(ALL[name]())
    assert len(drawn) == sum(figure is not None for figure in figures.values()) >= 4
    assert all(touching_ones == [] and out == [] for touching_ones, out, *_ in drawn)


@pytest.mark.slow
def test_what_is_left_out_is_said(drawn: list[Any]) -> None:
    figures = draw_all(many(40, 5, 30, 31))
    captions = {name: figure.caption for name, figure in figures.items() if figure}
    assert "14 of 31 candidates shown" in captions["probabilities"]
    assert "3 of 200 trials shown" in captions["contributions"]
    assert "12 of 40 fibres shown" in captions["fibres"]
    assert "10 of 31 candidates shown" in captions["fibres"]
    assert "36 of 200 trials shown" in captions["map"]
    assert "8 of 30 phases shown" in captions["map"]
    assert "base against answer; marks are fibres" in captions["before_after"]
    assert " shown" not in "".join(f.caption for f in draw_all(many(1, 3, 4, 3)).values() if f)


def test_without_held_out_trials_fitted_ones_are_shown_and_said(drawn: list[Any]) -> None:
    figure = before_after.draw_before_after(*nothing())
    assert figure is not None
    assert "fitted; nothing was held out" in figure.caption
    assert "Force RMSD (% F$_0$)" in drawn[0][2]
    shown = before_after.draw_before_after(*one_fibre())
    assert shown is not None
    assert "predicted by fits that did not see their condition" in shown.caption
    assert "Held-out force RMSD (% F$_0$)" in drawn[1][2]


@pytest.mark.slow
def test_where_the_answer_is_the_base_one_model_is_shown_and_that_is_said(drawn: list[Any]) -> None:
    figures = draw_all(unexplained())
    written = {text for _, _, texts, _ in drawn for text in texts}
    assert "base model" in written
    assert "answer" not in written
    for name in ("before_after", "contributions"):
        figure = figures[name]
        assert figure is not None
        assert "to which the answer adds nothing" in figure.caption


def test_telling_trials_are_the_best_the_median_and_the_worst() -> None:
    d = one_fibre().diagnosis
    chosen = before_after.telling(d, d.trials)
    falls = [(t.heldout_before_f0 or 0.0) ** 2 - (t.heldout_after_f0 or 0.0) ** 2 for t in d.trials]
    order = np.argsort(falls)[::-1]
    assert chosen == [d.trials[order[k]] for k in (0, 3, 6)]


def test_no_error_no_figure() -> None:
    d = one_fibre().diagnosis
    bare = replace(d, trials=(), map_before={}, map_after={}, components=(), base_law=None,
                   residual=replace(d.residual, law=None))  # fmt: skip
    assert set(draw_all(Sample(bare, ())).values()) == {None}


@pytest.mark.slow
def test_every_number_may_be_unknown(drawn: list[Any]) -> None:
    nan = float("nan")
    d, traces = five_fibres()
    holes = replace(
        d,
        trials=tuple(replace(t, noise_sd_f0=nan, heldout_before_f0=nan, heldout_after_f0=nan) for t in d.trials[:4])
        + d.trials[4:],
        components=tuple(
            replace(c, heldout_gain=c.heldout_gain and replace(c.heldout_gain, se=nan), by_fibre=c.by_fibre[1:])
            for c in d.components
        ),
        by_fibre=tuple(replace(f, left_out_rmsd_f0=(nan, nan)) for f in d.by_fibre),
        base_law=d.base_law and replace(d.base_law, time_constant_s=nan, weight_f0=(nan,) * 11, other_scalings={}),
        benchmark_rmsd_f0=nan,
    )
    traces = tuple(replace(t, before_f0=np.full_like(t.before_f0, nan), without_f0={}) for t in traces)
    draw_all(Sample(holes, traces))
    assert len(drawn) == 6
    assert not any("nan" in text for _, _, texts, _ in drawn for text in texts)


@pytest.mark.slow
def test_labels_of_one_thing_are_one_label(drawn: list[Any]) -> None:
    sample = one_fibre()
    draw_all(sample)
    labels = set(trial_labels(sample.diagnosis).values())
    for _, _, texts, _ in drawn:
        shown = {text.split("\n")[0].replace("  ", " ") for text in texts if re.search(r"pCa \d", text)}
        assert shown <= {text.replace("  ", " ") for text in labels}


def labelled(names: list[str], fibres_: list[str] | None = None) -> list[str]:
    d = one_fibre().diagnosis
    of = fibres_ or ["a"] * len(names)
    rows = tuple(replace(d.trials[0], fibre=f, trial=n, pca=6.1) for f, n in zip(of, names, strict=True))
    return list(trial_labels(replace(d, fibres=tuple(dict.fromkeys(of)), trials=rows)).values())


def test_every_trial_has_a_label_of_its_own() -> None:
    names = [f"simulated_18Dec2017a_amp383_rt{k}ms_pca61" for k in (1, 10, 100, 1000)]
    assert labelled(names) == [f"rt{k}ms_pca61  pCa 6.1" for k in (1, 10, 100, 1000)]
    # Alike at both ends, and the same from the start.
    assert len(set(labelled(["x" * 40 + middle + "y" * 40 for middle in "abc"]))) == 3
    assert labelled(["t_1", "t_2", "t_1"], ["A", "A", "B"]) == ["A 1  pCa 6.1", "A 2  pCa 6.1", "B t_1  pCa 6.1"]
    assert labelled(["a" * 90])[0].count("a") < 30


def test_kinds_are_told_apart_without_colour(drawn: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Base and answer differ in dash and filling, mechanisms and artefacts in hatching."""
    made: list[Any] = []
    monkeypatch.setattr(before_after, "svg", lambda figure: made.append(figure) or "")
    monkeypatch.setattr(probabilities, "svg", lambda figure: made.append(figure) or "")
    sample = one_fibre()
    before_after.draw_before_after(*sample)
    probabilities.draw_probabilities(sample.diagnosis)
    looks = {
        (line.get_label(), line.get_linestyle(), line.get_markerfacecolor())
        for axis in made[0].get_axes()
        for line in axis.get_lines()
    }
    base, answer = ({look[1:] for look in looks if look[0] == name} for name in ("base model", "answer"))
    assert base
    assert answer
    assert base.isdisjoint(answer)
    hatches = {bar.get_hatch() for bar in itertools.chain(*(axis.patches for axis in made[1].get_axes()))}
    assert {None, "/////"} <= hatches


@pytest.mark.slow
def test_captions_have_no_mathematics(drawn: list[Any]) -> None:
    assert isinstance(one_fibre().diagnosis, Diagnosis)
    for figure in draw_all(five_fibres()).values():
        assert figure is not None
        assert "$" not in figure.caption
        assert figure.alternative


# What every figure of `one_fibre` has: labels of its axes, and lines, bars or cells by axis.
AXES = {
    "before_after": {"Force (F$_0$)", "Residual\n(% F$_0$)", "Time (s)", "Held-out force RMSD (% F$_0$)"},
    "probabilities": {"Inclusion probability", "Held-out gain (log RMSD ratio)"},
    "contributions": {"Length\n(% L$_0$)", "Force (F$_0$)", "forcible detachment\n(% F$_0$)", "viscous drag\n(% F$_0$)",
                      "force drift\n(% F$_0$)", "Residual\n(% F$_0$)", "Time (s)"},
    "map": {"Mean of measured less model (% F$_0$)"},
    "laws": {"Time constant of the exponential (s)", "Weight (% F$_0$)", "Explained fraction of the residual"},
}  # fmt: skip


@pytest.fixture
def structure(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[dict[str, Any]]]:
    """Labels and numbers of artists of every axis of the figures of one fibre, by figure."""
    seen: list[Any] = []

    def looked_at(made: Any) -> str:
        seen.append(
            [
                {
                    "labels": {axis.get_xlabel(), axis.get_ylabel()} - {""}, "lines": len(axis.get_lines()),
                    "patches": len(axis.patches), "texts": len(axis.texts), "images": len(axis.get_images()),
                    "collections": len(axis.collections),
                }
                for axis in made.get_axes()
            ]
        )  # fmt: skip
        return ""

    for module in (before_after, contributions, fibres, laws, probabilities, residual_map):
        monkeypatch.setattr(module, "svg", looked_at)
    names = [name for name, figure in draw_all(one_fibre()).items() if figure is not None]
    return dict(zip(names, seen, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("name", AXES)
def test_axes_say_what_they_show_and_in_which_unit(name: str, structure: dict[str, list[dict[str, Any]]]) -> None:
    assert set().union(*(axis["labels"] for axis in structure[name])) == AXES[name]


@pytest.mark.slow
def test_figures_have_one_artist_for_each_thing_shown(structure: dict[str, list[dict[str, Any]]]) -> None:
    d = one_fibre().diagnosis
    # Three trials: measured, base and answer above; zero, base and answer below. Then one row for each trial and all.
    forces, pairs = structure["before_after"][:6], structure["before_after"][6]
    assert [axis["lines"] for axis in forces] == [3] * 6
    rows = len(d.trials)
    assert pairs["lines"] == 3 * (rows + 1) + rows + 1  # A bar with two dots in each row, noise, and the benchmark.
    bars, gains = structure["probabilities"][:2]
    assert (bars["patches"], bars["texts"]) == (len(d.components), len(d.components))
    tried = sum(c.heldout_gain is not None for c in d.components)
    assert gains["lines"] == 2 * tried + 1
    parts = sum(1 for c in d.named)
    columns = structure["contributions"]
    assert len(columns) == 3 * (3 + parts)
    assert [axis["lines"] for axis in columns[::3]] == [1, 3, 2, 2, 2, 3]
    assert sum(axis["collections"] for axis in columns) == 3 * parts
    (table,) = d.map_before.values()
    maps = structure["map"][:2]
    assert [axis["images"] for axis in maps] == [1, 1]
    assert [axis["texts"] for axis in maps] == [len(list(table.cells()))] * 2
    weights, shares = structure["laws"]
    assert weights["collections"] == 2
    # Both laws: as what they scale with, and as whatever else is known.
    known = [law for law in (d.base_law, d.residual.law) if law is not None]
    assert shares["lines"] == 2 * sum(1 + len(law.other_scalings) for law in known)
