"""Figures of a diagnosis with few and with many phases and trials: nothing that is written lies on anything else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.diagnose.report.markup import Markup
from xb_muscle_ros.diagnose.report.sections import traces as traces_section
from xb_muscle_ros.diagnose.report.sections import where
from xb_muscle_ros.diagnose.written import Trace, Written, filled
from xb_muscle_ros.figures import diagnose_map, diagnose_ranking, diagnose_traces, diagnose_trials
from xb_muscle_ros.figures.diagnose_common import BASE, trial_labels

PHASES = ("isometric", "conditioning_stretch", "hold_early", "hold_late", "shortening", "recovery_early")
SIZES = [(3, 2), (10, 7), (30, 7), (3, 30)]


def written(phases: int, trials: int, share: float, seed: int = 0) -> Written:
    """A diagnosis in which mismatch was located in a share of all cells."""
    random = np.random.default_rng(seed)
    names = [f"simulated_18Dec2017a_amp383_trial_{i:02d}" for i in range(trials)]
    kinds = [PHASES[k % 6] + ("" if k < 6 else f"_{k // 6 + 1}") for k in range(phases)]
    mean = random.normal(0.0, 0.05, (trials, phases))
    rms = np.abs(mean) * random.uniform(1.0, 3.0, mean.shape) + 0.004
    counts = random.uniform(size=mean.shape) < share
    table = {
        "trials": names, "phases": kinds, "rms_f0": rms.tolist(), "mean_f0": mean.tolist(),
        "p_value": np.where(counts, 0.002, 0.4).tolist(), "counts": counts.tolist(),
    }  # fmt: skip
    after = {**table, "rms_f0": (0.3 * rms).tolist(), "mean_f0": (0.3 * mean).tolist()}
    mismatch = [
        {
            "trial": names[i], "phase": kinds[j], "start_s": 0.1 * j, "end_s": 0.1 * (j + 1), "size_f0": rms[i, j],
            "mean_f0": mean[i, j], "sign": int(np.sign(mean[i, j])), "p_value": 0.002,
        }
        for i, j in zip(*np.nonzero(counts), strict=True)
    ]  # fmt: skip
    rows = [
        {
            "trial": name, "pca": 4.5 + 0.25 * (i % 12), "noise_sd_f0": 0.001, "before_rmsd_f0": 0.03,
            "after_rmsd_f0": 0.01, "heldout_before_f0": 0.04, "heldout_after_f0": 0.012,
        }
        for i, name in enumerate(names)
    ]  # fmt: skip
    time_s = np.arange(0.0, 0.1 * phases, 0.004)
    made = []
    for i in range(trials):
        force = 0.6 + 0.2 * np.sin(7.0 * time_s + i)
        off = np.interp(time_s, 0.05 + 0.1 * np.arange(phases), mean[i])
        made.append(Trace(time_s, 0.04 * np.sin(7.0 * time_s), force + off, force, force + 0.7 * off))
    ranked = [
        {"name": n, "kind": k, "train_rmsd_f0": r, "heldout_rmsd_f0": r, "delta_elpd": 100.0 * (0.03 - r), "se": 0.2}
        for n, k, r in (
            ("viscous_drag", "mechanism", 0.01),
            ("static_calcium_stiffness + thick_filament_cooperativity", "pair", 0.02),
            ("length_gain", "measurement", 0.025), ("base", "base", 0.03),
        )
    ]  # fmt: skip
    facts = {
        "verdict": "physics", "answer": ["viscous_drag"], "trials": rows, "mismatch": mismatch, "map": table,
        "map_after": after, "flexible_bound_rmsd_f0": 0.011, "candidates": ranked,
        "before": {"train_rmsd_f0": 0.03, "heldout_rmsd_f0": 0.04},
        "after": {"train_rmsd_f0": 0.01, "heldout_rmsd_f0": 0.012},
    }  # fmt: skip
    return Written(filled(facts), tuple(made))


def boxes(made: Any) -> list[tuple[str, np.ndarray]]:
    """Everything written in a figure, with the corners of the rectangle that it fills, rotated as it is."""
    from matplotlib.text import Text

    drawn: list[Text] = []
    plain = Text.draw
    with pytest.MonkeyPatch.context() as patch:
        # Of the texts that there are, those that the renderer is asked to draw.
        patch.setattr(Text, "draw", lambda self, renderer: (drawn.append(self), plain(self, renderer))[1])
        made.canvas.draw()
    found = []
    for text in dict.fromkeys(drawn):
        if not text.get_visible() or not text.get_text().strip() or not text.get_window_extent().width:
            continue
        outer, angle = text.get_window_extent(), text.get_rotation()
        text.set_rotation(0.0)
        inner = text.get_window_extent()
        text.set_rotation(angle)
        turn = np.deg2rad(angle)
        along, up = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
        middle = np.array([0.5 * (outer.x0 + outer.x1), 0.5 * (outer.y0 + outer.y1)])
        half = [(0.5 * inner.width, 0.5 * inner.height * 0.8)]
        corners = [middle + a * w * along + b * h * up for w, h in half for a in (-1, 1) for b in (-1, 1)]
        found.append((text.get_text(), np.array(corners)))
    return found


def overlap(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two rectangles overlap: no side of either parts them."""
    for corners in (a, b):
        for side in (corners[1] - corners[0], corners[2] - corners[0]):
            axis = side / (np.linalg.norm(side) or 1.0)
            first, second = a @ axis, b @ axis
            if first.max() <= second.min() + 0.3 or second.max() <= first.min() + 0.3:
                return False
    return True


def touching(found: list[tuple[str, np.ndarray]]) -> list[tuple[str, str]]:
    low = np.array([corners.min(axis=0) for _, corners in found])
    high = np.array([corners.max(axis=0) for _, corners in found])
    near = [
        (i, j)
        for i in range(len(found))
        for j in i + 1 + np.flatnonzero(np.all((low[i + 1 :] < high[i]) & (high[i + 1 :] > low[i]), axis=1))
    ]
    return [(found[i][0], found[j][0]) for i, j in near if overlap(found[i][1], found[j][1])]


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What touches and what is out of the figure, of every figure that is drawn."""
    seen: list[Any] = []

    def looked_at(made: Any) -> str:
        found, size = boxes(made), np.array(made.canvas.get_width_height())
        out = [text for text, c in found if c.min() < -1.0 or np.any(c.max(axis=0) > size + 1.0)]
        seen.append((touching(found), out, [text for text, _ in found]))
        return ""

    for module in (diagnose_map, diagnose_ranking, diagnose_traces, diagnose_trials):
        monkeypatch.setattr(module, "svg", looked_at)
    return seen


@pytest.mark.parametrize(("phases", "trials"), SIZES)
@pytest.mark.parametrize("share", [0.2, 1.0])
def test_nothing_written_lies_on_anything_else(drawn: list[Any], phases: int, trials: int, share: float) -> None:
    made = written(phases, trials, share)
    diagnose_map.draw_map(made.facts)
    diagnose_trials.draw_trials(made.facts)
    diagnose_ranking.draw_ranking(made.facts)
    diagnose_traces.draw_traces(made.facts, made.traces)
    assert len(drawn) >= 4
    for touching_ones, out, _ in drawn:
        assert touching_ones == []
        assert out == []


def test_marks_of_short_spans_do_not_touch(drawn: list[Any]) -> None:
    made = written(30, 3, 0.5)
    diagnose_traces.draw_traces(made.facts, made.traces)
    (seen,) = drawn
    assert seen[0] == []
    assert "+" in seen[2] or "−" in seen[2]


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_what_counts_everywhere_is_neither_shaded_nor_framed_and_the_page_says_so(share: float) -> None:
    made, everywhere = written(10, 4, share), share == 1.0
    assert diagnose_traces.shaded(made.facts, made.traces) is not everywhere
    assert diagnose_map.framed(made.facts) is not everywhere
    assert ("Nothing is shaded" in traces_section(Markup(), made)) == everywhere
    assert ("so none is framed" in where(Markup(), made)) == everywhere
    (picture,) = diagnose_traces.draw_traces(made.facts, made.traces)
    assert ("dfe5ee" in picture) is not everywhere


def test_frames_are_what_was_located() -> None:
    """No cell is framed that the text beside it says is none: chance of 0.03, and a size that is none."""
    made = written(4, 3, 0.0)
    table = made.facts["map"]
    table["p_value"][0][0], table["p_value"][0][1], table["rms_f0"][0][1] = 0.03, 0.002, 0.001
    assert "No place counts" in where(Markup(), made)
    assert not np.any(diagnose_map.counted({**table, "counts": None}))
    assert not np.any(diagnose_map.counted(table))


def test_labels_of_one_thing_are_one_label(drawn: list[Any]) -> None:
    made = written(3, 2, 0.5)
    diagnose_map.draw_map(made.facts)
    diagnose_trials.draw_trials(made.facts)
    diagnose_ranking.draw_ranking(made.facts)
    diagnose_traces.draw_traces(made.facts, made.traces)
    labels = set(trial_labels(made.facts["trials"]).values())
    for _, _, texts in drawn:
        assert {t for t in texts if "18Dec" in t} in (labels, set())
        assert {t for t in texts if "base" in t} <= {BASE}


def test_every_trial_has_a_label_of_its_own() -> None:
    names = [f"simulated_18Dec2017a_amp383_rt{k}ms_pca61" for k in (1, 10, 100, 1000)]
    labels = trial_labels([{"trial": name, "pca": 6.1} for name in names])
    assert [labels[name] for name in names] == [f"…rt{k}ms_pca61  pCa 6.1" for k in (1, 10, 100, 1000)]
    # Alike at both ends, and the same from the start.
    alike = ["x" * 40 + middle + "y" * 40 for middle in "abc"]
    assert len(set(trial_labels([{"trial": name, "pca": None} for name in alike]).values())) == 3
    assert trial_labels([{"trial": "a", "pca": 5.0}, {"trial": "b", "pca": 5.5}]) == {
        "a": "a  pCa 5.0",
        "b": "b  pCa 5.5",
    }
    assert trial_labels([{"trial": "a" * 90, "pca": 5.0}])["a" * 90].count("a") < 30
