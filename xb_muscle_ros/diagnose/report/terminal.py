"""A diagnosis as lines for a terminal: headline, summary, table of components, then what else has to be said."""

from __future__ import annotations

import textwrap

from xb_muscle_ros.diagnose.component import NAMED, Component, Kind
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.report.prose import headline, summary
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.tables import aligned

_HEAD = ("component", "probability", "ablation loss", "held-out gain ± se", "parameter [95 %]", "does")
_MOST_ROWS, _NAME = 8, 38
# Less probable ones are only counted, unless there is nothing else.
_LEAST = 0.05


def terminal_text(d: Diagnosis, width: int = 100) -> str:
    """Lines of at most `width` characters, but for the table, which is as wide as its names."""
    lines = [*_wrapped(headline(d), width), "", *_wrapped(" ".join(summary(d)), width)]
    if d.components:
        lines += ["", *_table(d)]
    for name, rows in (("warning", d.warnings), ("missing", d.missing), ("note", d.notes)):
        lines += [""] if rows else []
        for row in rows:
            lines += _wrapped(f"{name}: {row}", width, "  ")
    return "\n".join(lines)


def _wrapped(text: str, width: int, indent: str = "") -> list[str]:
    return textwrap.wrap(text, width, subsequent_indent=indent, break_on_hyphens=False)


def _table(d: Diagnosis) -> list[str]:
    likely = [c for c in d.components if c.inclusion_probability >= _LEAST] or list(d.components[:1])
    # Whatever is named is listed, however many there are.
    shown = likely[: max(_MOST_ROWS, sum(c.inclusion_probability >= NAMED for c in d.components))]
    lines = aligned(_HEAD, [row for c in shown for row in _rows(c)], left=(0, 3, 4, 5)).split("\n")
    left = len(d.components) - len(shown)
    return [*lines, f"{len(shown)} of {len(d.components)} candidates shown"] if left else lines


def _share(c: Component) -> str:
    """Nothing was taken out where it is not part of the answer."""
    return say.share(c.ablation_loss) if c.inclusion_probability >= NAMED else say.NOTHING


def _rows(c: Component) -> list[tuple[str, ...]]:
    """A line for a component, and one for each further line of its name or further parameter."""
    names = _wrapped(say.title(c) + (" (artefact)" if c.kind is Kind.ARTEFACT else ""), _NAME)
    values = [f"{p.name} {say.estimate(p)}{' at bound' if p.at_bound else ''}" for p in c.parameters]
    first = (say.probability(c.inclusion_probability), _share(c), say.gain(c.heldout_gain))
    out: list[tuple[str, ...]] = []
    for k in range(max(len(names), len(values), 1)):
        name, parameter = (names[k] if k < len(names) else ""), (values[k] if k < len(values) else "")
        out.append((name, *(first if k == 0 else ("", "", "")), parameter, c.direction if k == 0 else ""))
    return out
