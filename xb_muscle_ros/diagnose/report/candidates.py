"""The explanations that were looked at: compared ones in a figure, all of them in a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from xb_muscle_ros.diagnose.report.markup import NOTHING, Markup, escaped, named, prose
from xb_muscle_ros.diagnose.words import digits, family_words, human, meaning, percent
from xb_muscle_ros.diagnose.written import Written
from xb_muscle_ros.figures.diagnose_ranking import compared, draw_ranking, kind_of, reference

Facts = Mapping[str, Any]

_KINDS = {
    "mechanism": "● mechanism",
    "pair": "◇ several",
    "measurement": "□ measurement",
    "base": "| base model",
}


def candidates(page: Markup, written: Written) -> str:
    """Figure and table."""
    facts = written.facts
    if not facts["candidates"]:
        return "<p>No explanations were compared.</p>"
    chosen = compared(facts)
    figure = page.figure(
        draw_ranking(facts),
        f"Explanations compared, best first: {page.number('error on trials left out', 'heldout_rmsd')} (left) and "
        f"{page.number('predictive score', 'delta_elpd')} with its standard error (right). Filled dots are mechanisms, "
        "open squares faults of the measurement, diamonds several together; the answer is bold.",
        "Explanations ranked by error on trials left out",
    )
    against = reference(chosen) if chosen else "the reference"
    caption = (
        "Everything that was looked at, best first; RMSD in % F<sub>0</sub>. Grey: left out after a first look, with "
        f"the reason. Δ elpd: predictive score minus that of {against}, with its standard error."
    )
    head = ["Explanation", "Kind", "Parameters [95 %]", "RMSD, fitted", "RMSD, left out", "Δ elpd ± s.e."]
    return figure + page.table(caption, head, [_row(page, facts, row) for row in facts["candidates"]], words=3)


def _row(page: Markup, facts: Facts, row: Facts) -> tuple[str, list[str]]:
    name = str(row["name"])
    told = f'<span class="any">{prose(human(name))}</span>'
    if meaning(name):
        told += f"<small>{prose(meaning(name))}</small>"
    if row["note"] and row["parameters"]:
        told += f"<small>{prose(row['note'])}</small>"
    answers = {*map(str, facts["answer"]), "+".join(map(str, facts["answer"]))}
    cut = row["heldout_rmsd_f0"] is None and row["delta_elpd"] is None and name != "base"
    kind = _KINDS.get(kind_of(row), escaped(kind_of(row)))
    if row["family"]:
        kind += f"<small>{prose(family_words(str(row['family'])))}</small>"
    cells = [
        told,
        kind,
        _parameters(page, row),
        page.cell(_percent(row["train_rmsd_f0"]), "rmsd"),
        page.cell(_percent(row["heldout_rmsd_f0"]), "heldout_rmsd"),
        page.cell(_score(row), "delta_elpd"),
    ]
    return ("answer" if name in answers else "left-out" if cut else ""), cells


def _parameters(page: Markup, row: Facts) -> str:
    out = []
    for name, value in row["parameters"].items():
        if value is None:
            continue
        text = f"{named(name)} = {page.number(digits(float(value), 3), 'parameters')}"
        interval = row["interval"].get(name)
        if interval and None not in interval:
            low, high = (digits(float(end), 3) for end in interval)
            text += f" [{page.number(f'{low}, {high}', 'interval')}]"
        out.append(text)
    return "<br>".join(out) or prose(row["note"] or NOTHING)


def _score(row: Facts) -> str | None:
    if row["delta_elpd"] is None:
        return None
    text = digits(row["delta_elpd"], 2).replace("-", "−")
    return text if not row["se"] else f"{text} ± {digits(row['se'], 2)}"


def _percent(value_f0: float | None) -> str | None:
    return None if value_f0 is None else percent(value_f0)
