"""The top of the page: verdict, confidence in words, checks, what to do next, what is missing."""

from __future__ import annotations

from typing import Any

from xb_muscle_ros.diagnose.claims import QUIET, Facts, Sentence, headline, sureness, what_it_means
from xb_muscle_ros.diagnose.report.markup import Markup, escaped, listed, prose
from xb_muscle_ros.diagnose.summary import summary_pieces, summary_text
from xb_muscle_ros.diagnose.words import chance, family_words, human, joined, meaning, percent


def lead(page: Markup, facts: Facts) -> str:
    """The summary; its numbers are links where it is the tool's own text."""
    if facts["summary"] and facts["summary"] != summary_text(facts):
        return f'<p class="lead">{prose(facts["summary"])}</p>'
    return f'<p class="lead">{_linked(page, summary_pieces(facts))}</p>'


def verdict_box(page: Markup, facts: Facts) -> str:
    """Verdict, what it means, how sure, and the few numbers it rests on."""
    told = [text for text in (what_it_means(facts),) if text]
    named = [str(name) for name in facts["answer"]]
    told += [f"{human(name)[:1].upper()}{human(name)[1:]}: {meaning(name)}." for name in named if meaning(name)]
    if facts["family"] and told:
        told[-1] += f" Family: {family_words(str(facts['family']))}."
    sure = "".join(f"<p>{_linked(page, sentence)}</p>" for sentence in sureness(facts))
    return (
        f'<section class="verdict" id="verdict"><p class="kicker">Verdict</p><h2>{prose(headline(facts))}</h2>'
        + "".join(f"<p>{prose(text)}</p>" for text in told)
        + sure
        + _facts(page, facts)
        + "</section>"
    )


def _linked(page: Markup, sentence: Sentence) -> str:
    return "".join(page.number(p.text, p.how) if p.how else prose(p.text) for p in sentence)


def _facts(page: Markup, facts: Facts) -> str:
    """Numbers in a row, each with what it is below."""
    cells = []
    for group, how, words in (("heldout_rmsd_f0", "heldout_rmsd", "left out"), ("train_rmsd_f0", "rmsd", "fitted")):
        before, after = facts["before"][group], facts["after"][group]
        if before is None:
            continue
        text = page.number(percent(before), how)
        if after is not None and after != before:
            text += f" → {page.number(percent(after), how)}"
        cells.append((f"{text} % F<sub>0</sub>", f"error, trials {words}"))
    if facts["flexible_bound_rmsd_f0"] is not None:
        bound = page.number(percent(facts["flexible_bound_rmsd_f0"]), "flexible_bound")
        cells.append((f"{bound} % F<sub>0</sub>", "flexible curve, left out"))
    if facts["p_value"] is not None:
        words = chance(facts["p_value"]).removeprefix("in ")
        cells.append((page.number(f"p = {facts['p_value']:.3g}", "p_value"), f"by chance: {words}"))
    return f'<div class="facts">{"".join(f"<div><b>{a}</b>{b}</div>" for a, b in cells)}</div>' if cells else ""


def checks(page: Markup, facts: Facts) -> str:
    """Checks, passed and failed, told by words and not by colour."""
    items = []
    for row in facts["checks"]:
        mark = {True: "✓ passed", False: "✗ failed"}.get(row["passed"], "– not run")
        value = "" if row["value"] in (None, "") else f" ({page.number(str(row['value']), 'checks')})"
        items.append(f'<span class="mark">{mark}</span>{prose(row["name"])}{value}')
    if not items:
        return ""
    failed = sum(1 for row in facts["checks"] if row["passed"] is False)
    summary = "All passed." if not failed else f"{failed} of {len(items)} failed."
    if failed and facts["verdict"] in QUIET:
        summary += " Where nothing is missing they are not expected to pass."
    elif failed and facts["verdict"] == "ambiguous":
        summary += " Those that ask for a single explanation may fail where several tie."
    return f"<h2>Checks</h2><p>What has to hold before a mechanism is named. {summary}</p>{listed(items, 'list')}"


def next_steps(page: Markup, facts: Facts) -> str:
    """The experiment proposed, the files to go on with, what is missing, and warnings."""
    return (
        _experiment(page, facts)
        + _files(facts)
        + _notes("What is missing", facts["missing"])
        + _notes("Warnings", facts["warnings"])
        + _notes("Assumed, left out, not looked at", facts["notes"])
    )


def _experiment(page: Markup, facts: Facts) -> str:
    planned = facts["next_experiment"]
    if planned is None:
        return ""
    out = ['<section class="next"><h3>The experiment to do next</h3>']
    if planned["protocol"]:
        out.append(f"<p>{prose(planned['protocol'])}</p>")
    names = [prose(human(str(name))) for name in planned["separates"] or ()]
    if names:
        difference = ""
        if planned["expected_difference_f0"] is not None:
            number = page.number(f"{percent(planned['expected_difference_f0'])} % F0", "next_experiment")
            difference = f"; they should differ there by up to {number}"
        out.append(f"<p>It separates {joined(names)}{difference}.</p>")
    if planned["bag"]:
        out.append(f"<p>The protocol lies beside this page as a bag: <code>{escaped(planned['bag'])}</code>.</p>")
    return "".join(out) + "</section>"


def _files(facts: Facts) -> str:
    if not facts["augmented_fiber"]:
        return ""
    name = escaped(facts["augmented_fiber"])
    what = "the first of these explanations" if facts["verdict"] == "ambiguous" else "what was found"
    return (
        f"<p>The model with {what} is the fibre file <code>{name}</code> beside this page. Replay, simulation "
        f"and the node take it as any other: <code>xb_muscle replay BAG --fiber {name}</code>.</p>"
    )


def _notes(title: str, notes: list[Any]) -> str:
    return f"<h3>{title}</h3>{listed([prose(note) for note in notes], 'list plain')}" if notes else ""
