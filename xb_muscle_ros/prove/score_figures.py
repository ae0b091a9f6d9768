"""Figures of a scored benchmark: who is taken for whom, and how well by size, and how well the tool knows it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.names import FAMILY, MECHANISMS, Name
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, figure, save
from xb_muscle_ros.prove.judging import Judged

Array = npt.NDArray[np.float64]

_FAMILIES = list(dict.fromkeys(FAMILY.values()))
_IS_PHYSICS = {name.value for name in MECHANISMS}
# Families side by side, faults behind.
_NAMES = sorted(
    (name.value for name in FAMILY), key=lambda name: (name not in _IS_PHYSICS, _FAMILIES.index(FAMILY[Name(name)]))
)
_TRUTHS = [*_NAMES, "outside", "null"]
_ANSWERS = [*_NAMES, Verdict.UNEXPLAINED.value, Verdict.PARAMETERS.value, Verdict.NONE.value, "other"]


def draw(folder: Path, judged: Sequence[Judged], tree: dict[str, Any]) -> list[Path]:
    """Draw all figures into a folder; paths of the PNG files, each with a PDF beside it."""
    counts = confusion(judged)
    made = [
        _matrix(folder / "confusion.png", counts, 1, "Share of the truth's cases"),
        _matrix(folder / "inversion.png", counts, 0, "Share of the answer's cases"),
        _by_size(folder / "by_size.png", judged, tree),
    ]
    if tree["calibration"]["bins"]:
        made.append(_calibration(folder / "calibration.png", tree["calibration"]))
    return made


def confusion(judged: Sequence[Judged]) -> Array:
    """Numbers of cases by what is true (rows) and what is answered (columns); pairs have no row of their own."""
    counts = np.zeros((len(_TRUTHS), len(_ANSWERS)))
    for j in judged:
        # Of a pair either name is right; what an untouched recording lacks nobody knows.
        if j.kind in ("pair", "untouched"):
            continue
        truth = j.labels[0] if j.kind in ("single", "fault") else j.kind
        answer = j.answer if j.answer in _ANSWERS else "other"
        counts[_TRUTHS.index(truth), _ANSWERS.index(answer)] += 1.0
    return counts


def _matrix(path: Path, counts: Array, axis: int, label: str) -> Path:
    """A matrix in grey with its numbers; frames mark families, the line divides mechanisms and faults."""
    rows, columns = counts.any(axis=1), counts.any(axis=0)
    # Squares of families need the same names both ways.
    either = rows[: len(_NAMES)] | columns[: len(_NAMES)]
    rows[: len(_NAMES)], columns[: len(_NAMES)] = either, either
    truths = [t for t, kept in zip(_TRUTHS, rows, strict=True) if kept]
    answers = [a for a, kept in zip(_ANSWERS, columns, strict=True) if kept]
    shown = counts[rows][:, columns]
    total = shown.sum(axis=axis, keepdims=True)
    shares = np.divide(shown, total, out=np.zeros_like(shown), where=total > 0.0)
    with figure(52.0 + 5.6 * len(answers), 44.0 + 5.2 * len(truths)) as made:
        axes = made.add_subplot()
        image = axes.imshow(shares, cmap="Greys", vmin=0.0, vmax=1.0, aspect="auto")
        for i, k in np.argwhere(shown > 0.0):
            axes.text(
                k, i, f"{shown[i, k]:.0f}", ha="center", va="center", fontsize=6.5,
                color="white" if shares[i, k] > 0.55 else "black",
            )  # fmt: skip
        _frames(axes, truths, answers)
        axes.set_xticks(range(len(answers)), [_words(a) for a in answers], rotation=90)
        axes.set_yticks(range(len(truths)), [_words(t) for t in truths])
        axes.set_xlabel("Answered first")
        axes.set_ylabel("Concealed")
        axes.tick_params(length=0.0)
        for side in axes.spines.values():
            side.set_visible(True)
        made.colorbar(image, ax=axes, label=label, shrink=0.6, pad=0.02)
        save(made, path)
    return path


def _frames(axes: Any, truths: Sequence[str], answers: Sequence[str]) -> None:
    from matplotlib.patches import Rectangle

    names = [t for t in truths if t in _NAMES]
    start = 0
    while start < len(names):
        family = FAMILY[Name(names[start])]
        end = start
        while end < len(names) and FAMILY[Name(names[end])] == family:
            end += 1
        size = end - start
        axes.add_patch(
            Rectangle((start - 0.5, start - 0.5), size, size, fill=False, edgecolor=SECOND, linewidth=1.1, zorder=3)
        )
        start = end
    physics = sum(name in _IS_PHYSICS for name in names)
    for edge in {physics, len(names)}:
        axes.axhline(edge - 0.5, color=DATA, linewidth=0.7)
        axes.axvline(edge - 0.5, color=DATA, linewidth=0.7)


def _words(label: str) -> str:
    return {"null": "nothing", "outside": "outside the library"}.get(label, label.replace("_", " "))


def _by_size(path: Path, judged: Sequence[Judged], tree: dict[str, Any]) -> Path:
    """Left: naming by class of size; right: gain of the effects named right."""
    rows = [row for row in tree["by_size"] if row["n"]]
    with figure(170.0, 70.0) as made:
        left, right = made.subplots(1, 2)
        looks = (("family", SECOND, "s", "right family first"), ("exact", MODEL, "o", "right mechanism first"))
        for shift, (name, colour, marker, label) in zip((-0.07, 0.07), looks, strict=True):
            values = np.array([row[name]["value"] for row in rows])
            low, high = (np.array([row[name][side] for row in rows]) for side in ("lower", "upper"))
            left.errorbar(
                np.arange(len(rows)) + shift, 100.0 * values, 100.0 * np.vstack([values - low, high - values]),
                color=colour, marker=marker, markersize=4.5, capsize=2.0, linewidth=1.0, linestyle="none", label=label,
            )  # fmt: skip
        ticks = [f"{100.0 * row['size_class_f0']:g}" if row["size_class_f0"] else "< 0.5" for row in rows]
        left.set_xticks(range(len(rows)), [f"{t}\n(n = {row['n']})" for t, row in zip(ticks, rows, strict=True)])
        left.set_xlabel("Effect after refit, class (% F$_0$)")
        left.set_ylabel("Single effects (%)")
        left.set_ylim(-3.0, 103.0)
        left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, borderpad=0.0)
        _gains(right, judged)
        save(made, path)
    return path


def _gains(axes: Any, judged: Sequence[Judged]) -> None:
    named = [j for j in judged if j.kind == "single" and j.gain is not None and j.verdict == Verdict.PHYSICS.value]
    for right, colour, marker, label in ((False, DATA, "x", "named wrong"), (True, MODEL, "o", "named right")):
        points = [(100.0 * j.size_f0, j.gain) for j in named if j.exact == right]
        if points:
            x, y = np.array(points, dtype=np.float64).T
            axes.plot(x, np.clip(y, -0.5, 1.5), marker, color=colour, markersize=4.5, linestyle="none", label=label)
    axes.axhline(1.0, color=DATA, linewidth=0.7)
    axes.axhline(0.8, color="black", linewidth=0.7, linestyle=(0, (4, 2)))
    axes.set_xscale("log")
    axes.set_xticks([0.5, 1.0, 2.0, 4.0], ["0.5", "1", "2", "4"])
    axes.minorticks_off()
    axes.set_xlim(0.2, 8.0)
    axes.set_ylim(-0.55, 1.55)
    axes.set_xlabel("Effect after refit (% F$_0$)")
    axes.set_ylabel("Held-out gain / gain of the true model")
    if named:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, borderpad=0.0)


def _calibration(path: Path, found: dict[str, Any]) -> Path:
    with figure(80.0, 75.0) as made:
        axes = made.add_subplot()
        axes.plot([0.0, 1.0], [0.0, 1.0], color=DATA, linewidth=2.5, label="as stated")
        x, y, low, high = (
            np.array([row[name] for row in found["bins"]]) for name in ("mean_confidence", "value", "lower", "upper")
        )
        axes.errorbar(
            x, y, np.vstack([y - low, high - y]), color=MODEL, marker="o", markersize=4.5, capsize=2.0, linewidth=1.0,
            linestyle="none", label="found (95 % interval)",
        )  # fmt: skip
        for row in found["bins"]:
            right = row["mean_confidence"] > 0.85
            axes.annotate(
                f"n = {row['n']}", (row["mean_confidence"], row["value"]), (-4.0 if right else 4.0, 4.0),
                textcoords="offset points", fontsize=6.5, ha="right" if right else "left",
            )  # fmt: skip
        axes.set_xlim(0.0, 1.03)
        axes.set_ylim(-0.03, 1.05)
        axes.set_xlabel("Confidence stated")
        axes.set_ylabel("Share with the right name first")
        axes.legend(loc="upper left", frameon=False)
        save(made, path)
    return path
