"""Explanations side by side: error on trials left out, and how much better or worse each predicts them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from xb_muscle_ros.diagnose.words import human
from xb_muscle_ros.figures.diagnose_common import BASE, WIDTH_MM, label, svg
from xb_muscle_ros.figures.style import DATA, MODEL, SECOND, figure

# Kinds differ in marker and in filling, so that they are told apart in grey.
_MARKS: Mapping[str, tuple[str, str, str, str]] = {
    "mechanism": ("o", MODEL, MODEL, "mechanism"),
    "pair": ("D", MODEL, "white", "several together"),
    "measurement": ("s", SECOND, "white", "fault of the measurement"),
    "base": ("|", "black", "black", BASE),
}
_MOST = 34


def compared(facts: Mapping[str, Any]) -> list[Any]:
    """Candidates that were fitted and compared on trials left out, best first."""
    return [r for r in facts["candidates"] if r["heldout_rmsd_f0"] is not None or r["delta_elpd"] is not None][:_MOST]


def kind_of(row: Mapping[str, Any]) -> str:
    """``mechanism``, ``pair``, ``measurement`` or ``base``."""
    return "base" if row["name"] == "base" else str(row["kind"] or "mechanism")


def reference(rows: Sequence[Mapping[str, Any]]) -> str:
    """What differences in prediction are counted from: the row at which they are zero."""
    zero = [row for row in rows if row["delta_elpd"] == 0.0]
    if any(row["name"] == "base" for row in zero):
        return f"the {BASE}"
    return "the best" if zero and zero[0] is rows[0] else "the reference"


def draw_ranking(facts: Mapping[str, Any]) -> list[str]:
    """Two panels over the candidates that were compared, as SVG; none where there were none."""
    rows = compared(facts)
    if not rows:
        return []
    has_scores = any(row["delta_elpd"] is not None for row in rows)
    with figure(WIDTH_MM, 27.0 + 5.4 * len(rows)) as made:
        axes = made.subplots(1, 2 if has_scores else 1, squeeze=False, sharey=True)[0]
        handles: dict[str, Any] = {}
        for place, row in enumerate(rows):
            handles |= _error(axes[0], place, row)
            if has_scores:
                _score(axes[1], place, row)
        base = next((r["heldout_rmsd_f0"] for r in rows if r["name"] == "base"), None)
        if base is not None:
            axes[0].axvline(100.0 * base, color=DATA, linewidth=0.7, linestyle=(0, (4, 2)), zorder=0)
        axes[0].set_xlim(0.0, 1.06 * axes[0].get_xlim()[1])
        axes[0].set_xlabel("RMSD on trials left out (% F$_0$)")
        if has_scores:
            axes[1].axvline(0.0, color=DATA, linewidth=0.7, linestyle=(0, (4, 2)), zorder=0)
            axes[1].set_xlabel("Δ elpd ± s.e. (right is better)")
        axes[0].set_yticks(range(len(rows)), [_name(row) for row in rows])
        for tick, row in zip(axes[0].get_yticklabels(), rows, strict=True):
            tick.set_fontweight("bold" if row["name"] in _answers(facts) else "normal")
        axes[0].set_ylim(len(rows) - 0.4, -0.6)
        for axis in axes:
            axis.grid(axis="y", color="#ececec", linewidth=0.6)
            axis.set_axisbelow(True)
            axis.tick_params(axis="y", length=0)
            axis.spines["left"].set_visible(False)
        made.legend(handles=list(handles.values()), loc="outside upper center", ncols=4, frameon=False)
        return [svg(made)]


def _name(row: Mapping[str, Any]) -> str:
    return BASE if row["name"] == "base" else label(human(str(row["name"])), 44)


def _answers(facts: Mapping[str, Any]) -> set[str]:
    return {*map(str, facts["answer"]), "+".join(map(str, facts["answer"]))}


def _error(axis: Any, place: int, row: Mapping[str, Any]) -> dict[str, Any]:
    if row["heldout_rmsd_f0"] is None:
        return {}
    marker, edge, face, words = _MARKS.get(kind_of(row), _MARKS["mechanism"])
    (handle,) = axis.plot(
        [100.0 * row["heldout_rmsd_f0"]], [place], marker, markersize=9 if marker == "|" else 4.5, markeredgecolor=edge,
        markerfacecolor=face, markeredgewidth=1.5 if marker == "|" else 1.0, linestyle="none", label=words,
    )  # fmt: skip
    return {words: handle}


def _score(axis: Any, place: int, row: Mapping[str, Any]) -> None:
    if row["delta_elpd"] is None:
        return
    marker, edge, face, _ = _MARKS.get(kind_of(row), _MARKS["mechanism"])
    axis.errorbar(
        [row["delta_elpd"]], [place], xerr=None if row["se"] is None else [row["se"]], fmt=marker, color=edge,
        markersize=9 if marker == "|" else 4.5, markeredgecolor=edge, markerfacecolor=face,
        markeredgewidth=1.5 if marker == "|" else 1.0, elinewidth=1.0, capsize=2.0,
    )  # fmt: skip
