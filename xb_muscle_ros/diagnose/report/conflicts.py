"""Whether parts of the study contradict each other: a table, and what it means where that is clear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from xb_muscle_ros.diagnose.report.markup import NOTHING, Markup, prose

Facts = Mapping[str, Any]

# From this share on parts contradict each other, if no parameter has to go further than this (its moved scale: a factor
# of 20) and this much more is gone than with the other way of parting; below that one, trials contradict themselves.
_GONE, _FURTHEST, _MORE, _STAYS = 0.9, 3.0, 0.1, 0.8
_PARTS = {"solutions": "solution (pCa)", "protocols": "kind of protocol", "trials": "trial"}


def conflicts(page: Markup, facts: Facts) -> str:
    """Sentence and table; nothing where it was not looked at."""
    rows = [row for row in facts["conflicts"] if row["between"] in _PARTS and row["gone"] is not None]
    if not rows:
        return ""
    cells = [
        ("", [_PARTS[row["between"]], NOTHING if row["parts"] is None else str(row["parts"]), _percent(page, row)])
        for row in rows
    ]
    caption = "Share of the mismatch's mean square that would be gone if each part had parameters of its own."
    told = contradiction(rows)
    sentence = f"<p>{prose(told)}</p>" if told else ""
    return sentence + page.table(caption, ["Own parameters for each", "Parts", "Gone"], cells)


def contradiction(rows: Sequence[Facts]) -> str:
    """What the shares say; empty where nothing is clear."""
    gone = {row["between"]: row["gone"] for row in rows if row["gone"] is not None}
    near = {row["between"] for row in rows if row["furthest"] is not None and row["furthest"] <= _FURTHEST}
    if gone.get("trials", 1.0) < _STAYS:
        return (
            "The mismatch lies within the trials rather than between them: much of it would stay even if every trial "
            "had parameters of its own."
        )
    for between, other, at in (
        ("solutions", "protocols", "at the calcium of the solutions, and at what depends on activation"),
        ("protocols", "solutions", "at what depends on the order of movements or of trials"),
    ):
        if between in near and gone[between] >= _GONE and gone[between] - gone.get(other, 0.0) >= _MORE:
            words = "solutions" if between == "solutions" else "kinds of protocol"
            return f"The {words} contradict each other: each by itself agrees with the model. Look {at}."
    return ""


def _percent(page: Markup, row: Facts) -> str:
    return page.number(f"{100.0 * row['gone']:.0f} %", "conflicts")
