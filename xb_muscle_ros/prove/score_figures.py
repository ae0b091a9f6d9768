"""Figures of a scored benchmark: what is taken for what, what is found by size, whether probabilities are right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.names import FAMILY, MECHANISMS
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, figure, save
from xb_muscle_ros.prove.answers import FAMILIES_OF_PHYSICS
from xb_muscle_ros.prove.counting import LARGE_F0
from xb_muscle_ros.prove.judging import JudgedComposite, JudgedSingle
from xb_muscle_ros.trials.trial import Array

_FAMILIES = list(dict.fromkeys(FAMILY.values()))
# Families side by side, artefacts behind.
_NAMES = sorted(FAMILY, key=lambda n: (n not in MECHANISMS, _FAMILIES.index(FAMILY[n])))
_TRUTHS = (*_NAMES, "outside", "null")
_ANSWERS = (*_NAMES, Verdict.UNEXPLAINED.value, Verdict.PARAMETERS.value, Verdict.NONE.value, "other")
_WORDS = {"null": "nothing", "outside": "outside the library"}

OUTSIDE, ARTEFACTS, NOTHING = "outside the library alone", "artefacts", "nothing, or all found"
TRUTHS = (*FAMILIES_OF_PHYSICS, OUTSIDE, ARTEFACTS, NOTHING)
SILENT, OTHER = "not named", "another name"
ANSWERS = (*FAMILIES_OF_PHYSICS, OTHER, SILENT)
_ABOVE: Any = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "frameon": False, "borderpad": 0.0}


def draw_singles(folder: Path, judged: Sequence[JudgedSingle], sizes: Sequence[Any], bins: Sequence[Any]) -> list[Path]:
    """Draw all figures into a folder; paths of the PNG files, each with a PDF beside it."""
    made, counts = [], confusion(judged)
    # Squares of families need the same names both ways.
    used = counts[: len(_NAMES)].any(axis=1) | counts[:, : len(_NAMES)].any(axis=0)
    kept = [name for name, there in zip(_NAMES, used, strict=True) if there]
    edges = [sum(name in MECHANISMS for name in kept), len(kept)]
    for name, axis, whose in (("confusion", 1, "truth"), ("inversion", 0, "answer")):
        path, words = folder / f"{name}.png", (f"Share of the {whose}'s cases", "Answered first")
        made.append(_matrix(path, counts, (_TRUTHS, _ANSWERS), kept, axis, words, edges, True))
    with figure(170.0, 70.0) as both:
        left, right = both.subplots(1, 2)
        _found(left, sizes, ("right family first", "right mechanism first"))
        left.set_xlabel("Effect after refit, class (% F$_0$)")
        left.set_ylabel("Single effects (%)")
        _gains(right, judged)
        save(both, folder / "by_size.png")
    made.append(folder / "by_size.png")
    if bins:
        axes = ("Confidence stated", "Share with the right name first")
        made.append(_reliability(folder / "calibration.png", bins, axes, ""))
    return made


def draw_composites(
    folder: Path, judged: Sequence[JudgedComposite], sizes: Sequence[Any], bins: Sequence[Any], error: str
) -> list[Path]:
    """The same for composites; `error` is the calibration error in words."""
    families_, path = len(FAMILIES_OF_PHYSICS), folder / "found_by_size.png"
    with figure(110.0, 72.0) as made:
        axes = made.add_subplot()
        rows = _found(axes, sizes, ("family", "name"))
        first = next((i for i, row in enumerate(rows) if row["from_f0"] >= LARGE_F0), len(rows))
        axes.hlines(
            75.0, first - 0.4, len(rows) - 0.6, color="black", linewidth=0.7, linestyle=(0, (4, 2)), label="bar"
        )
        axes.set_xlabel("Unique contribution of the effect (% F$_0$)")
        axes.set_ylabel("Effects in the answer (%)")
        axes.legend(**_ABOVE, ncols=3)
        save(made, path)
    words = ("Share of the row", "Family named")
    kept = FAMILIES_OF_PHYSICS
    found = [
        path,
        _matrix(folder / "families.png", families(judged), (TRUTHS, ANSWERS), kept, 1, words, [families_], False),
    ]
    if bins:
        axes_of = ("Inclusion probability stated", "Share that is there")
        found.append(_reliability(folder / "calibration.png", bins, axes_of, error))
    return found


def confusion(judged: Sequence[JudgedSingle]) -> Array:
    """Numbers of cases by what is true (rows) and what is answered (columns); pairs have no row of their own."""
    counts = np.zeros((len(_TRUTHS), len(_ANSWERS)))
    for j in judged:
        # Of a pair either name is right; what an untouched recording lacks nobody knows.
        if j.kind in ("pair", "untouched"):
            continue
        truth = j.labels[0] if j.kind in ("single", "artefact") else j.kind
        answer = j.answer if j.answer in _ANSWERS else "other"
        counts[_TRUTHS.index(truth), _ANSWERS.index(answer)] += 1.0
    return counts


def families(judged: Sequence[JudgedComposite]) -> Array:
    """Numbers of effects and names by what is true (rows, `TRUTHS`) and what is named (columns, `ANSWERS`).

    An effect whose family is named counts once on the diagonal. One that is not counts once as not named. A name of a
    family that is not there counts once, divided evenly among the effects of its case that were not found; where there
    are none, in the row of what else the case is.
    """
    counts = np.zeros((len(TRUTHS), len(ANSWERS)))

    def count(truth: str, answer: str, share: float = 1.0) -> None:
        counts[TRUTHS.index(truth), ANSWERS.index(answer if answer in ANSWERS else OTHER)] += share

    for j in judged:
        rest = OUTSIDE if j.outside else ARTEFACTS if j.artefacts else NOTHING
        for family in {effect.family for effect in j.effects if effect.family_found}:
            count(family, family)
        missed = [effect.family for effect in j.effects if not effect.family_found]
        for family in missed:
            count(family, SILENT)
        for wrong in {name.family for name in j.named if not name.family_right}:
            for row in missed or [rest]:
                count(row, wrong, 1.0 / len(missed or [rest]))
        if not j.effects and not j.named:
            count(rest, SILENT)
    return counts


def _matrix(
    path: Path, counts: Array, names: tuple[Sequence[str], Sequence[str]], kept: Sequence[str], axis: int,
    words: tuple[str, str], edges: Sequence[int], framed: bool,
) -> Path:  # fmt: skip
    """A matrix in grey with its numbers: shares along an axis; lines divide families from the rest, frames mark them.

    Args:
        counts: by truth and answer.
        names: of rows and columns; those without a case are left out unless they are `kept`.
        axis: along which shares add up to 1.
        words: of the shares and of the columns.
        edges: numbers of rows and columns after which a line is drawn.
        framed: whether names of one family have a frame.
    """
    there = [
        [name in kept or bool(used) for name, used in zip(of, counts.any(axis=1 - k), strict=True)]
        for k, of in enumerate(names)
    ]
    if not framed:
        there[1][-1] = True
    truths, answers = ([n for n, yes in zip(names[k], there[k], strict=True) if yes] for k in range(2))
    shown = counts[there[0]][:, there[1]]
    total = shown.sum(axis=axis, keepdims=True)
    shares = np.divide(shown, total, out=np.zeros_like(shown), where=total > 0.0)
    with figure(52.0 + 5.6 * len(answers), 44.0 + 5.2 * len(truths)) as made:
        axes = made.add_subplot()
        image = axes.imshow(shares, cmap="Greys", vmin=0.0, vmax=1.0, aspect="auto")
        for i, k in np.argwhere(shown > 0.0):
            axes.text(
                k, i, f"{shown[i, k]:.1f}".removesuffix(".0"), ha="center", va="center", fontsize=6.5,
                color="white" if shares[i, k] > 0.55 else "black",
            )  # fmt: skip
        if framed:
            _frames(axes, [FAMILY[name] for name in kept])
        for edge in {*edges}:
            axes.axhline(edge - 0.5, color=DATA, linewidth=0.7)
            axes.axvline(edge - 0.5, color=DATA, linewidth=0.7)
        axes.set_xticks(range(len(answers)), [_WORDS.get(a, a.replace("_", " ")) for a in answers], rotation=90)
        axes.set_yticks(range(len(truths)), [_WORDS.get(t, t.replace("_", " ")) for t in truths])
        axes.set_xlabel(words[1])
        axes.set_ylabel("Concealed")
        axes.tick_params(length=0.0)
        axes.spines[:].set_visible(True)
        made.colorbar(image, ax=axes, label=words[0], shrink=0.6, pad=0.02)
        save(made, path)
    return path


def _frames(axes: Any, families_: Sequence[str]) -> None:
    from matplotlib.patches import Rectangle

    for family in dict.fromkeys(families_):
        start, size = families_.index(family) - 0.5, families_.count(family)
        look: Any = {"fill": False, "edgecolor": SECOND, "linewidth": 1.1, "zorder": 3}
        axes.add_patch(Rectangle((start, start), size, size, **look))


def _errorbars(axes: Any, x: Array, rows: Sequence[Mapping[str, Any]], scale: float, **look: Any) -> None:
    """Shares with their 95 % intervals."""
    y, low, high = (scale * np.array([row[name] for row in rows]) for name in ("value", "lower", "upper"))
    axes.errorbar(
        x, y, np.vstack([y - low, high - y]), markersize=4.5, capsize=2.0, linewidth=1.0, linestyle="none", **look
    )


def _found(axes: Any, rows: Sequence[Any], labels: tuple[str, str]) -> list[Any]:
    """Share of effects found, by class of size; classes that have effects."""
    rows = [row for row in rows if row["n"]]
    looks = (("family", SECOND, "s", labels[0]), ("exact", MODEL, "o", labels[1]))
    for shift, (name, colour, marker, label) in zip((-0.07, 0.07), looks, strict=True):
        x = np.arange(len(rows)) + shift
        _errorbars(axes, x, [row[name] for row in rows], 100.0, color=colour, marker=marker, label=label)
    ticks = [f"from {100.0 * row['from_f0']:g}" if row["from_f0"] else "below 0.5" for row in rows]
    axes.set_xticks(range(len(rows)), [f"{t}\n(n = {row['n']})" for t, row in zip(ticks, rows, strict=True)])
    axes.set_xlim(-0.5, len(rows) - 0.5)
    axes.set_ylim(-3.0, 103.0)
    axes.legend(**_ABOVE, ncols=2)
    return rows


def _gains(axes: Any, judged: Sequence[JudgedSingle]) -> None:
    named = [j for j in judged if j.kind == "single" and j.gain is not None and j.says(Verdict.PHYSICS)]
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
        axes.legend(**_ABOVE, ncols=2)


def _reliability(path: Path, bins: Sequence[Any], words: tuple[str, str], error: str) -> Path:
    """Stated probability against the share that was right, and how many statements there are of each."""
    with figure(90.0, 100.0) as made:
        axes, below = made.subplots(2, 1, height_ratios=[3.0, 1.0], sharex=True)
        axes.plot([0.0, 1.0], [0.0, 1.0], color=DATA, linewidth=2.5, label="as stated")
        x, left, right, heights = (np.array([row[k] for row in bins]) for k in ("mean_probability", "from", "to", "n"))
        _errorbars(axes, x, bins, 1.0, color=MODEL, marker="o", label="found (95 % interval)")
        axes.set_ylim(-0.03, 1.03)
        axes.set_ylabel(words[1])
        axes.legend(**_ABOVE, ncols=2)
        axes.text(0.98, 0.04, error, transform=axes.transAxes, ha="right", va="bottom", fontsize=7.0)
        below.bar(left, heights, right - left, align="edge", color="#c9c9c9", edgecolor="black", linewidth=0.5)
        below.set_yscale("log")
        below.set_ylim(0.7, 3.0 * heights.max())
        below.set_ylabel("Statements")
        below.set_xlim(-0.02, 1.02)
        below.set_xlabel(words[0])
        save(made, path)
    return path
