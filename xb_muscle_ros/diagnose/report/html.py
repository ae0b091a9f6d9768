"""The page of a diagnosis: one HTML document that needs no other file and no network."""

from __future__ import annotations

import base64
import functools
import re
from collections.abc import Sequence
from importlib import resources
from typing import Any

import jinja2
from jinja2.filters import do_forceescape, do_mark_safe

from xb_muscle_ros.diagnose.component import NAMED
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.report.figures import FIGURES
from xb_muscle_ros.diagnose.report.figures.common import trial_labels
from xb_muscle_ros.diagnose.report.glossary import GLOSSARY
from xb_muscle_ros.diagnose.report.prose import headline, summary
from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.result import Diagnosis, NuisanceParameter
from xb_muscle_ros.diagnose.words import family_words, human, joined, meaning, phase_words

_HERE = "xb_muscle_ros.diagnose.report"
_UNITS = re.compile(r"\b([FL])0\b")
# A number does not part from its unit or its sign.
_TIED = re.compile(
    r"(?<=\d) (?=%|ms\b|s\b)|(?<=%) (?=[FL]0)|(?<=[<>±]) (?=\d)|(?<=&[lg]t;) (?=\d)|(?<=,) (?=−?[\d.]+\])"
)
MOST_ROWS = 40
"""Rows of a table of trials, errors or places; the rest is in `diagnosis.json`, and said to be."""
# Candidates below this probability are listed in one line.
_LEAST = 0.05


def as_html(d: Diagnosis, traces: Sequence[TrialTraces]) -> str:
    """The report; figures of forces show the trials of which there are traces."""
    page: str = _environment().get_template("page.html.j2").render(_context(d, traces))
    return page


def source(name: str) -> str:
    """A template or the style sheet, as installed with the package.

    Raises:
        FileNotFoundError: the package was installed without it.
    """
    place = resources.files(_HERE)
    for part in name.split("/"):
        place = place.joinpath(part)
    return place.read_text(encoding="utf-8")


@functools.cache
def _environment() -> jinja2.Environment:
    made = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: source(f"templates/{name}")),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_printable,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters.update(
        f0=lambda value: say.force(value, ""), prob=say.probability, share=say.share, gain=say.gain, num=say.number,
        estimate=say.estimate, title=say.title, human=human, meaning=meaning, family=family_words, phase=phase_words,
        units=_units, joined=joined, signed=say.signed, error=say.error,
    )  # fmt: skip
    return made


def _context(d: Diagnosis, traces: Sequence[TrialTraces]) -> dict[str, Any]:
    likely = [c for c in d.components if c.inclusion_probability >= _LEAST]
    return {
        "d": d,
        "headline": headline(d),
        "summary": summary(d),
        "figures": _figures(d, traces),
        "glossary": GLOSSARY,
        "style": do_mark_safe(source("report.css")),
        "likely": likely,
        "unlikely": [c for c in d.components if c not in likely],
        "nuisances": sorted(d.nuisance_parameters, key=lambda n: -_beyond(n)),
        "beyond": _beyond,
        "labels": {f"{fibre}\n{trial}": text for (fibre, trial), text in trial_labels(d).items()},
        "p": lambda value, fibres=1: say.p_value(value, fibres * d.p_value_floor),
        "called": lambda names: [say.called(d, name) for name in names],
        "named": NAMED,
        "most": MOST_ROWS,
        "several": len(d.fibres) > 1,
        "changed": say.changed(d),
        "replicated": lambda fibre: say.replicated_by(d, fibre),
    }


def _figures(d: Diagnosis, traces: Sequence[TrialTraces]) -> dict[str, Any]:
    """Figures that there are with their numbers, from 1 on in the order of the page, and data URIs."""
    drawn = ((name, draw(d, traces)) for name, draw in FIGURES.items())
    there = [(name, figure) for name, figure in drawn if figure is not None]
    return {name: {"number": k, "source": _uri(f.svg), "figure": f} for k, (name, f) in enumerate(there, start=1)}


def _uri(svg: str) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode("utf-8")).decode("ascii")


def _printable(value: object) -> object:
    """What no page may hold becomes U+FFFD; what is unknown a dash."""
    if value is None:
        return say.NOTHING
    if not isinstance(value, str) or hasattr(value, "__html__"):
        return value
    kept = "".join(c if c >= " " or c in "\t\n" else "\ufffd" for c in value)
    return kept.encode("utf-8", "replace").decode("utf-8")


def _units(text: object) -> str:
    """Words of the tool's own, with F0 and L0 as physiologists print them."""
    escaped = str(do_forceescape(str(_printable(str(text)))))
    return do_mark_safe(_UNITS.sub(r"\1<sub>0</sub>", _TIED.sub("\u00a0", escaped)))


def _beyond(n: NuisanceParameter) -> float:
    """Size of an ordinary artefact in its prior SDs."""
    ratio = abs(n.value) / n.prior_sd if n.prior_sd > 0.0 else 0.0
    return ratio if ratio == ratio else 0.0
