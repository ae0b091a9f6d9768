"""Figures of scored composites: are probabilities what they say, what is found by size, which family for which."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, figure, save
from xb_muscle_ros.prove.composite_counting import LARGE_F0
from xb_muscle_ros.prove.composite_judging import JudgedComposite
from xb_muscle_ros.prove.counting import Score
from xb_muscle_ros.prove.stated import FAMILIES_OF_PHYSICS

Array = npt.NDArray[np.float64]

OUTSIDE, ARTEFACTS, NOTHING = "outside the library alone", "artefacts", "nothing, or all found"
TRUTHS = (*FAMILIES_OF_PHYSICS, OUTSIDE, ARTEFACTS, NOTHING)
SILENT, OTHER = "not named", "another name"
ANSWERS = (*FAMILIES_OF_PHYSICS, OTHER, SILENT)


def draw(
    folder: Path, judged: Sequence[JudgedComposite], sizes: Sequence[dict[str, Any]], bins: Sequence[dict[str, Any]],
    error: Score,
) -> list[Path]:  # fmt: skip
    """Draw all figures into a folder; paths of the PNG files, each with a PDF beside it."""
    made = [
        _by_size(folder / "found_by_size.png", sizes),
        _families(folder / "families.png", families(judged)),
    ]
    if bins:
        made.append(_reliability(folder / "calibration.png", bins, error))
    return made


def families(judged: Sequence[JudgedComposite]) -> Array:
    """Numbers of effects and names by what is true (rows, `TRUTHS`) and what is named (columns, `ANSWERS`).

    An effect whose family is named counts once on the diagonal. One that is not counts once as not named. A name of a
    family that is not there counts once, divided evenly among the effects of its case that were not found; where there
    are none, in the row of what else the case is.
    """
    counts = np.zeros((len(TRUTHS), len(ANSWERS)))
    for j in judged:
        found = {effect.family for effect in j.effects if effect.family_found}
        missed = [effect.family for effect in j.effects if not effect.family_found]
        for family in found:
            counts[TRUTHS.index(family), ANSWERS.index(family)] += 1.0
        for family in missed:
            counts[TRUTHS.index(family), ANSWERS.index(SILENT)] += 1.0
        rows = missed or [_else(j)]
        wrong = {name.family for name in j.named if not name.family_right}
        for family in wrong:
            column = ANSWERS.index(family if family in ANSWERS else OTHER)
            for row in rows:
                counts[TRUTHS.index(row), column] += 1.0 / len(rows)
        if not j.effects and not j.named:
            counts[TRUTHS.index(_else(j)), ANSWERS.index(SILENT)] += 1.0
    return counts


def _else(j: JudgedComposite) -> str:
    if j.outside:
        return OUTSIDE
    return ARTEFACTS if j.artefacts else NOTHING


def _families(path: Path, counts: Array) -> Path:
    """The matrix in grey with its numbers; lines divide families from the rest."""
    rows = counts.any(axis=1)
    rows[: len(FAMILIES_OF_PHYSICS)] = True
    columns = counts.any(axis=0)
    columns[: len(FAMILIES_OF_PHYSICS)], columns[-1] = True, True
    truths = [t for t, kept in zip(TRUTHS, rows, strict=True) if kept]
    answers = [a for a, kept in zip(ANSWERS, columns, strict=True) if kept]
    shown = counts[rows][:, columns]
    total = shown.sum(axis=1, keepdims=True)
    shares = np.divide(shown, total, out=np.zeros_like(shown), where=total > 0.0)
    with figure(150.0, 105.0) as made:
        axes = made.add_subplot()
        image = axes.imshow(shares, cmap="Greys", vmin=0.0, vmax=1.0, aspect="auto")
        for i, k in np.argwhere(shown > 0.0):
            axes.text(
                k, i, f"{shown[i, k]:.1f}".removesuffix(".0"), ha="center", va="center", fontsize=6.5,
                color="white" if shares[i, k] > 0.55 else "black",
            )  # fmt: skip
        edge = len(FAMILIES_OF_PHYSICS) - 0.5
        axes.axhline(edge, color=DATA, linewidth=0.7)
        axes.axvline(edge, color=DATA, linewidth=0.7)
        axes.set_xticks(range(len(answers)), [a.replace("_", " ") for a in answers], rotation=90)
        axes.set_yticks(range(len(truths)), [t.replace("_", " ") for t in truths])
        axes.set_xlabel("Family named")
        axes.set_ylabel("Concealed")
        axes.tick_params(length=0.0)
        for side in axes.spines.values():
            side.set_visible(True)
        made.colorbar(image, ax=axes, label="Share of the row", shrink=0.6, pad=0.02)
        save(made, path)
    return path


def _by_size(path: Path, rows: Sequence[dict[str, Any]]) -> Path:
    """Share of effects found, by class of size, with 95 % intervals."""
    rows = [row for row in rows if row["n"]]
    with figure(110.0, 72.0) as made:
        axes = made.add_subplot()
        looks = (("family", SECOND, "s", "family"), ("exact", MODEL, "o", "name"))
        for shift, (name, colour, marker, label) in zip((-0.07, 0.07), looks, strict=True):
            values = np.array([row[name]["value"] for row in rows])
            low, high = (np.array([row[name][side] for row in rows]) for side in ("lower", "upper"))
            axes.errorbar(
                np.arange(len(rows)) + shift, 100.0 * values, 100.0 * np.vstack([values - low, high - values]),
                color=colour, marker=marker, markersize=4.5, capsize=2.0, linewidth=1.0, linestyle="none", label=label,
            )  # fmt: skip
        first = next((i for i, row in enumerate(rows) if row["from_f0"] >= LARGE_F0), len(rows))
        axes.hlines(
            75.0, first - 0.4, len(rows) - 0.6, color="black", linewidth=0.7, linestyle=(0, (4, 2)), label="bar"
        )
        ticks = [f"from {100.0 * row['from_f0']:g}" if row["from_f0"] else "below 0.5" for row in rows]
        axes.set_xticks(range(len(rows)), [f"{t}\n(n = {row['n']})" for t, row in zip(ticks, rows, strict=True)])
        axes.set_xlim(-0.5, len(rows) - 0.5)
        axes.set_xlabel("What the effect leaves beside the rest (% F$_0$)")
        axes.set_ylabel("Effects in the answer (%)")
        axes.set_ylim(-3.0, 103.0)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False, borderpad=0.0)
        save(made, path)
    return path


def _reliability(path: Path, bins: Sequence[dict[str, Any]], score: Score) -> Path:
    """Stated probability against the share that was right, and how many statements there are of each."""
    with figure(90.0, 100.0) as made:
        axes, below = made.subplots(2, 1, height_ratios=[3.0, 1.0], sharex=True)
        axes.plot([0.0, 1.0], [0.0, 1.0], color=DATA, linewidth=2.5, label="as stated")
        x, y, low, high = (
            np.array([row[name] for row in bins]) for name in ("mean_probability", "value", "lower", "upper")
        )
        axes.errorbar(
            x, y, np.vstack([y - low, high - y]), color=MODEL, marker="o", markersize=4.5, capsize=2.0, linewidth=1.0,
            linestyle="none", label="found (95 % interval)",
        )  # fmt: skip
        axes.set_ylim(-0.03, 1.03)
        axes.set_ylabel("Share that is there")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, borderpad=0.0)
        axes.text(
            0.98, 0.04,
            f"expected calibration error {score.value:.3f}\n95 % interval {score.lower:.3f} to {score.upper:.3f}",
            transform=axes.transAxes, ha="right", va="bottom", fontsize=7.0,
        )  # fmt: skip
        left, right = (np.array([row[name] for row in bins]) for name in ("from", "to"))
        heights = np.array([row["n"] for row in bins])
        below.bar(left, heights, right - left, align="edge", color="#c9c9c9", edgecolor="black", linewidth=0.5)
        below.set_yscale("log")
        below.set_ylim(0.7, 3.0 * heights.max())
        below.set_ylabel("Statements")
        below.set_xlim(-0.02, 1.02)
        below.set_xlabel("Inclusion probability stated")
        save(made, path)
    return path
