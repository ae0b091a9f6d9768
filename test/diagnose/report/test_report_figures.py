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

from xb_muscle_ros.diagnose.report.figures import before_after, contributions, fibres, laws, probabilities, residual_map
from xb_muscle_ros.diagnose.report.figures.common import Figure, trial_labels
from xb_muscle_ros.diagnose.result import Diagnosis

# Fibres, trials of each, phases, components.
SIZES = [(1, 1, 3, 1), (1, 24, 12, 7), (5, 7, 6, 20), (40, 5, 30, 31)]


def draw_all(sample: Sample) -> dict[str, Figure | None]:
    d, traces = sample
    return {
        "before_after": before_after.draw_before_after(d, traces),
        "probabilities": probabilities.draw_probabilities(d),
        "contributions": contributions.draw_contributions(d, traces),
        "fibres": fibres.draw_fibres(d),
        "map": residual_map.draw_map(d),
        "laws": laws.draw_laws(d),
    }


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


@pytest.mark.parametrize("name", ALL)
def test_samples_have_their_figures(drawn: list[Any], name: str) -> None:
    figures = draw_all(ALL[name]())
    assert len(drawn) == sum(figure is not None for figure in figures.values()) >= 4
    assert all(touching_ones == [] and out == [] for touching_ones, out, *_ in drawn)


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


def test_captions_have_no_mathematics(drawn: list[Any]) -> None:
    assert isinstance(one_fibre().diagnosis, Diagnosis)
    for figure in draw_all(five_fibres()).values():
        assert figure is not None
        assert "$" not in figure.caption
        assert figure.alternative
