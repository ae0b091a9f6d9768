"""The page of the recordings: one section to a case, made of what its folder holds; nothing is written by hand."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from recorded_cases import Case
from recorded_predictions import END_S
from recorded_tables import (
    components,
    feature_scores,
    fibres,
    force,
    held_out,
    places,
    predicted_rows,
    probability,
    sets,
)

from xb_muscle_ros.diagnose import outputs
from xb_muscle_ros.diagnose.component import Kind
from xb_muscle_ros.diagnose.report import prose
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.tables import markdown

INTRO = """# Real recordings

Made by `scripts/diagnose_recordings.py`. Training trials are diagnosed. Test trials are never shown to the tool
(figures call them concealed). Two fibre files predict them: the fitted base, and the answer's augmented fibre. Of a
test trial nothing is used but its own force before anything moves, and that only for its solution's pCa shift and its
force offset. Errors of a whole set (time shift, length gain) go on to test trials that were recorded with the
training ones. RMSD is the root mean square of simulated less measured force, in % F0. "Held out" is that of
conditions which the diagnosis itself left out of its fits (whole solutions where each has two trials or more).
"""
FORMER = "*This section was made by the former version of the diagnosis (format 1), and has not been run again.*"
_MARK = "<!-- diagnosis.json, format {} -->"
_MOST_NOTES = 8
_HEADING = re.compile(r"^## (.+)$", re.MULTILINE)


def write_page(done: Sequence[tuple[Case, Path]], images: str, former: str = "") -> str:
    """The page.

    Args:
        done: cases that are done, each with its folder.
        images: folder of the figures, as the page links it.
        former: the page as it stands; its sections of cases that are not among `done` are kept.
    """
    read = [(case, folder, outputs.read(folder), predicted_rows(folder)) for case, folder in done]
    made = [section(case, d, rows, images) for case, _, d, rows in read if not case.pooled or case.held_out]
    made += [_singly(key, [(c, d) for c, _, d, _ in read if c.pooled == key]) for key in _pools(read)]
    titles = {match[1] for text in made for match in _HEADING.finditer(text)}
    kept = [text for title, text in former_sections(former) if title not in titles]
    return "\n".join([INTRO, *([_overview(read)] if read else []), *made, *kept])


def former_sections(page: str) -> list[tuple[str, str]]:
    """Title and text of each section of a page, those of the former diagnosis marked as such."""
    found = []
    starts = [*(match.start() for match in _HEADING.finditer(page)), len(page)]
    for begin, end in itertools.pairwise(starts):
        text = page[begin:end].rstrip() + "\n"
        head, _, rest = text.partition("\n")
        title = head.removeprefix("## ")
        if title in ("Overview", "Each fibre by itself"):
            continue
        if "<!-- diagnosis.json, format" not in text and FORMER not in text:
            text = f"{head}\n\n{FORMER}\n{rest}"
        found.append((title, text))
    return found


def _pools(read: Sequence[tuple[Case, Path, Diagnosis, list[dict[str, Any]]]]) -> list[str]:
    return list(dict.fromkeys(case.pooled for case, *_ in read if case.pooled))


def _overview(read: Sequence[tuple[Case, Path, Diagnosis, list[dict[str, Any]]]]) -> str:
    """A line for each study."""
    heads = ["study", "base", "verdict", "answer", "held out", "test trials better", "worse unwarned"]
    cells = []
    for case, _, d, rows in read:
        both = [(r["rmsd_f0"]["before"], r["rmsd_f0"].get("after"), r["warned"]) for r in rows]
        judged = [(b, a, w) for b, a, w in both if b is not None and "after" in rows[0]["rmsd_f0"]]
        better = sum(a is not None and a < b for b, a, _ in judged)
        worse = sum((a is None or a > b + 0.02) and not w for b, a, w in judged)
        answer = _answer(d)
        held = force(d.before.heldout_rmsd_f0) + (f" → {force(d.after.heldout_rmsd_f0)}" if answer else "")
        cells.append(
            [
                case.title, f"`{d.model}`", d.verdict.value, answer or "–", held,
                f"{better} of {len(rows)}" if judged else "–", str(worse) if judged else "–",
            ]
        )  # fmt: skip
    told = '"Worse unwarned": trials that the answer predicts worse than the base by more than 2 % F0, or not at all, '
    return f"## Overview\n\n{markdown(heads, cells)}\n\n{told}without a warning given beforehand.\n"


def _answer(d: Diagnosis) -> str:
    return ", ".join(f"{c.members[0]} ({probability(c.inclusion_probability)})" for c in d.named)


def section(case: Case, d: Diagnosis, rows: Sequence[dict[str, Any]], images: str) -> str:
    """One case."""
    effort = "quick search" if d.quick else "full search"
    many = f", {len(d.fibres)} fibres" if len(d.fibres) > 1 else ""
    parts = [
        f"## {case.title}\n\n{_MARK.format(d.format_version)}",
        case.about,
        f"![{case.title}]({images}/recorded_{case.key}.png)",
        f"**{prose.headline(d)}**",
        " ".join(prose.summary(d)),
        f"Base `{d.model}`, {len(d.trials)} trials{many}, {effort}, {d.seconds:.0f} s. Verdict: {d.verdict.value}.",
        "Components (share: ablation loss as a share of the base's mismatch; gain: mean logarithm of the ratio of "
        "held-out RMSD without and with it):\n\n" + components(d),
        "Each fibre:\n\n" + fibres(d) if many else "",
        "Where the base differs most:\n\n" + places(d.mismatch),
        "What the answer leaves:\n\n" + places(d.residual.places) if d.named else "",
        "Most probable sets:\n\n" + sets(d),
        _held_out(d, rows),
        "RMSD of relative SRS at conditions that no trace has (`empirical_srs.json`, readings of "
        "[evaluate.md](evaluate.md)):\n\n" + feature_scores(d)
        if d.feature_scores
        else "",
        _lines("Warnings, given before any test trial was looked at", d.warnings),
        _lines("Missing", d.missing),
        _lines("Notes", d.notes),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _held_out(d: Diagnosis, rows: Sequence[dict[str, Any]]) -> str:
    if not rows:
        return ""
    if not d.augmented:
        told = "Test trials (no mechanism is in the answer: the base alone predicts them):"
    else:
        told = "Test trials (–: no solution at these parameters; pCa shift and offset: what each model asks of the "
        told += "trial's force before anything moves):"
    end = f"Last column: mean force of the last {END_S:g} s, % F0."
    return f"{told}\n\n{held_out(rows)}\n\n{end}"


def _lines(head: str, lines: Sequence[str]) -> str:
    if not lines:
        return ""
    more = [f"- and {len(lines) - _MOST_NOTES} more"] if len(lines) > _MOST_NOTES else []
    return "\n".join([f"{head}:\n", *(f"- {line}" for line in lines[:_MOST_NOTES]), *more])


def _singly(key: str, found: Sequence[tuple[Case, Diagnosis]]) -> str:
    """Fibres of a pooled study, each by itself: which names come back, and what they gain."""
    model = found[0][1].model
    heads = ["fibre", "verdict", "answer", "RMSD, base → answer", "held out, base → answer", "ratio"]
    cells = []
    for _, d in found:
        before, after = d.before.heldout_rmsd_f0, d.after.heldout_rmsd_f0
        ratio = f"{after / before:.2f}" if before and after else "–"
        train = f"{force(d.before.train_rmsd_f0)} → {force(d.after.train_rmsd_f0)}"
        cells.append(
            [d.fibres[0], d.verdict.value, _answer(d) or "–", train, f"{force(before)} → {force(after)}", ratio]
        )
    names = [c.members[0] for _, d in found for c in d.named if c.kind is Kind.MECHANISM]
    count = {n: names.count(n) for n in sorted(set(names), key=lambda n: (-names.count(n), n))}
    told = "; ".join(f"{name} in {k} of {len(found)}" for name, k in count.items()) or "no mechanism in any fibre"
    return (
        f"## Each fibre by itself, base `{model}`\n\n{_MARK.format(found[0][1].format_version)}\n\n"
        f"{markdown(heads, cells)}\n\nNamed with probability 0.5 and more: {told}. Key of the pooled study: `{key}`.\n"
    )
