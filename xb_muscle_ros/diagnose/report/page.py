"""The page as a whole: head, verdict, parts with a table of contents, and how each number was computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from xb_muscle_ros.diagnose.claims import headline
from xb_muscle_ros.diagnose.report import sections, verdict
from xb_muscle_ros.diagnose.report.candidates import candidates
from xb_muscle_ros.diagnose.report.how import how_section
from xb_muscle_ros.diagnose.report.look import STYLE
from xb_muscle_ros.diagnose.report.markup import Markup, escaped
from xb_muscle_ros.diagnose.written import Written

_PARTS: tuple[tuple[str, str, Callable[[Markup, Written], str]], ...] = (
    ("where", "Where the model differs", sections.where),
    ("traces", "Measured and modelled force", sections.traces),
    ("memory", "What the difference follows", sections.kernel),
    ("explanations", "Explanations compared", candidates),
    ("errors", "Error of every trial", sections.before_after),
    ("parameter", "The new parameter", sections.profile),
    ("estimates", "Corrections and parameters", sections.estimates),
)
# Nothing on the page may load anything, whatever a name in it holds.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def as_page(written: Written) -> str:
    """The report as one HTML document that needs no other file and no network."""
    facts, page = written.facts, Markup()
    top = "\n".join(
        [verdict.lead(page, facts), verdict.verdict_box(page, facts), verdict.checks(page, facts), _next(page, facts)]
    )
    parts = [(name, title, make(page, written)) for name, title, make in _PARTS]
    shown = [(name, title, body) for name, title, body in parts if body]
    run = _run(page, facts)
    how = ("how", "How each number was computed", how_section(page.linked, facts["how"]))
    links = "".join(f'<a href="#{name}">{title}</a>' for name, title, _ in [*shown, how])
    body = "\n".join(
        f'<section id="{name}"><h2>{title}</h2>\n{inner}</section>' for name, title, inner in [*shown, how]
    )
    title = f"Diagnosis of fibre {facts['fibre']}" if facts["fibre"] else "Diagnosis"
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escaped(title)}: {escaped(headline(facts))}</title>\n"
        f"<style>{STYLE}</style>\n</head>\n<body>\n"
        f"<header><h1>{escaped(title)}</h1><p>{_model(facts)}</p></header>\n{top}\n<nav>{links}</nav>\n{body}\n"
        f"<footer>{run}</footer>\n</body>\n</html>\n"
    )


def _model(facts: Mapping[str, Any]) -> str:
    count = len(facts["trials"])
    words = [f"{count} trial{'' if count == 1 else 's'}"]
    if facts["model"]:
        words.append(f"base model {escaped(facts['model'])}")
    if facts["method"]:
        words.append(f"method {escaped(facts['method'])}")
    return " · ".join(words)


def _next(page: Markup, facts: Mapping[str, Any]) -> str:
    steps = verdict.next_steps(page, facts)
    return f"<h2>What to do next</h2>\n{steps}" if steps else ""


def _run(page: Markup, facts: Mapping[str, Any]) -> str:
    words = ["Written by xb_muscle diagnose" + (", quick" if facts["quick"] else "")]
    if facts["seed"] is not None:
        words.append(f"seed {page.number(str(facts['seed']), 'run')}")
    if facts["seconds"] is not None:
        words.append(page.number(f"{facts['seconds']:.0f} s", "run"))
    if facts["version"] is not None:
        words.append(f"format {page.number(str(facts['version']), 'run')}")
    return "; ".join(words) + ". Figures are vector graphics: save or copy them from this page."
