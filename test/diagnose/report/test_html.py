"""The page of a diagnosis: it holds together, in its order, with gaps, and with names that try to break it."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest
from generated_diagnoses import diagnoses
from hypothesis import given, settings
from many_of_everything import many
from sample_diagnoses import ALL, Sample, one_fibre

from xb_muscle_ros.diagnose.report import html, prose
from xb_muscle_ros.diagnose.report.glossary import GLOSSARY
from xb_muscle_ros.diagnose.result import Diagnosis


class Walker(HTMLParser):
    """Checks on the way that tags balance; collects ids, links, headings, other attributes and all text."""

    VOID = ("meta", "img", "br")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.text = ""
        self.headings: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.tags.add(tag)
        self.attributes |= set(found)
        self.ids += [str(found["id"])] if "id" in found else []
        self.links += [str(found["href"])] if "href" in found else []
        self.sources += [str(found["src"])] if "src" in found else []
        if tag == "h2":
            self.headings.append("")
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag
        self.text += " " if tag in ("td", "th") else ""

    def handle_data(self, data: str) -> None:
        if "style" in self.open:
            return
        self.text += data
        if "h2" in self.open:
            self.headings[-1] += data

    @property
    def words(self) -> str:
        return " ".join(self.text.split())


def walked(text: str) -> Walker:
    """A page that holds together: tags balance, links resolve, ids are unique, nothing is loaded."""
    walker = Walker(text)
    assert len(walker.ids) == len(set(walker.ids))
    assert all(link.startswith("#") and link[1:] in walker.ids for link in walker.links)
    assert walker.tags.isdisjoint({"script", "link", "iframe", "object", "base", "form"})
    assert not any(name.startswith("on") for name in walker.attributes)
    assert not re.search(r"(https?:)?//\w", re.sub(r"data:image/svg\+xml;base64,[\w+/=]+", "", text))
    for source in walker.sources:
        head, _, data = source.partition(",")
        assert head == "data:image/svg+xml;base64"
        figure = base64.b64decode(data).decode("utf-8")
        ElementTree.fromstring(figure)
        assert not re.search(r"(href|src)=\"(?!#|data:image/png)|url\((?!#)|@import", figure)
    return walker


@cache
def page(name: str) -> str:
    return html.as_html(*ALL[name]())


def without_figures(d: Diagnosis) -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(html, "_figures", lambda *_: {})
        return html.as_html(d, ())


def plain(text: str) -> str:
    return " ".join(text.replace("\u00a0", " ").split())


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL)
def test_every_sample_makes_a_page_with_headline_summary_and_figures(name: str) -> None:
    d = ALL[name]().diagnosis
    walker = walked(page(name))
    words = plain(walker.text)
    assert prose.headline(d) in words
    assert " ".join(prose.summary(d)) in words
    for line in (*d.warnings, *d.missing, *d.notes):
        assert line in words
    assert len(walker.sources) == 4 + (len(d.fibres) > 1) + (d.base_law is not None)


def test_the_order_of_the_page() -> None:
    text = page("five_fibres")
    assert text.index("Figure 1.") < text.index('<div class="verdict">') < text.index("Figure 2.")
    assert "held-out" in text[: text.index('<div class="verdict">')].lower() or "did not see" in text
    assert [plain(h) for h in walked(text).headings][1:] == [
        "Components", "Where the base model differs", "What each component adds", "Fibres side by side", "Residual",
        "Features", "Ordinary artefacts, trials and parameters", "Sets averaged over", "Next experiment",
        "Warnings and notes", "Glossary",
    ]  # fmt: skip
    assert "Fibres side by side" not in walked(page("one_fibre")).headings
    assert "Features" not in walked(page("nothing")).headings


def test_terms_are_explained_where_they_stand_and_in_one_place() -> None:
    text = page("one_fibre")
    walker = walked(text)
    used = {link.removeprefix("#g-") for link in walker.links if link.startswith("#g-")}
    assert {"inclusion_probability", "ablation_loss", "heldout_gain", "interval", "not_separable_from"} <= used
    for key in used:
        assert GLOSSARY[key].text.split(".")[0].split("(")[0] in plain(walker.text)
        assert 'title="' in text
    assert {f"g-{key}" for key in GLOSSARY} <= set(walker.ids)


def test_terms_are_a_sentence_or_two() -> None:
    for term in GLOSSARY.values():
        assert term.text.endswith(".")
        assert 1 <= len(re.findall(r"[.:;](?:\s|$)", term.text)) <= 4
        assert len(term.text) < 330


def test_numbers_of_the_record_stand_on_the_page() -> None:
    words = plain(walked(page("one_fibre")).text)
    for told in ("k = 1040 1/s [870, 1230]", "drag = 0.0284 F0·s/L0 [0.0190, 0.0371]", "+0.80 ± 0.13", "> 0.99",
                 "not separable from weakly bound heads", "lowers force late in fast stretch",
                 "Less than 0.05: lattice spacing (0.03), phosphate (< 0.01), transducer lag (< 0.01).",
                 "SRS (F0/L0) pCa 6.2, 3.8 % L0, 316 ms 31.2 38.4 32.9 predicted",
                 "isometric force (F0) pCa 6.2 0.410 0.440 0.420 fitted",
                 "forcible detachment + viscous drag + force drift 0.52", "f 95.0 103 1/s", "augmented/18Dec2017a.yaml",
                 "time constant of 11.8 ms, scales with activation"):  # fmt: skip
        assert told in words, told


def test_bounds_and_beaten_benchmarks_are_said() -> None:
    d = one_fibre().diagnosis
    words = plain(walked(without_figures(replace(d, p_value_floor=0.002, benchmark_rmsd_f0=0.9))).text)
    assert "The p-value of the mismatch is ≤ 0.0020" in words
    assert "benchmark 90 % F0 (worse than the base)" in words
    before = plain(walked(without_figures(d)).text)
    assert "The p-value of the mismatch is 0.0020" in before
    assert "worse than the base" not in before.split("Glossary")[0]


def test_where_the_answer_is_the_base_nothing_is_told_twice() -> None:
    text = plain(walked(page("unexplained")).text)
    assert " → " not in text
    assert "Nothing is added, so the places are those above." in text
    assert " → " in walked(page("one_fibre")).text


def test_ordinary_errors_are_in_two_digits_and_short_times_in_ms() -> None:
    text = plain(walked(page("one_fibre")).text)
    assert "time shift whole study 0.41 ± 0.12 ms ± 0.70 ms" in text
    assert "pCa shift pCa 6.1 −0.030 ± 0.012 ± 0.050" in text


def test_long_tables_say_what_they_leave_out() -> None:
    words = plain(walked(without_figures(many(40, 5, 4, 31).diagnosis)).text)
    assert "40 of 200 shown; all are in diagnosis.json." in words
    assert "Parameters of 12 of 40 fibres shown" in words


@pytest.mark.slow
@settings(max_examples=40)
@given(diagnoses())
def test_any_record_makes_a_page_without_gaps(d: Diagnosis) -> None:
    # Words drawn at random may be anything.
    bare = replace(d, warnings=(), missing=(), notes=(), nuisance_parameters=(), features=(), next_experiment=None)
    walker = walked(without_figures(bare))
    assert not re.search(r"\bnan\b|\binf\b", walker.text)
    assert not re.search(r"\bNone\b", walker.text.replace("None:", "").replace("None.", ""))


HOSTILE = (
    "<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "$\\frac{1}{$ & _^%#", "{{ 7 * 7 }}{% raw %}",
    "nul \x00 bell \x07 line\nfeed", "half \ud800 pair, 力 и ünïcödé 🦵", "]]> --> &amp; x", "x" * 400,
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("turn", [0, 1])
def test_names_may_hold_anything(turn: int) -> None:
    """Fibres, trials, phases, components and lines of text."""
    d, traces = one_fibre()
    names = [HOSTILE[(4 * turn + k) % len(HOSTILE)] for k in range(4)]
    fibre, phase = names[0], names[1]

    def trial(name: str) -> str:
        return names[int(name[-2:]) % 4] + name

    known = d.map_before["18Dec2017a"]
    swapped = replace(
        d, fibres=(fibre,), warnings=tuple(names), missing=tuple(names), notes=tuple(names), model=names[2],
        trials=tuple(replace(t, fibre=fibre, trial=trial(t.trial)) for t in d.trials),
        mismatch=tuple(replace(p, fibre=fibre, trial=trial(p.trial), phase=phase) for p in d.mismatch),
        components=tuple(
            replace(c, name=names[k], members=(names[k],), direction=names[k]) if k < 4 else c
            for k, c in enumerate(d.components)
        ),
        by_fibre=tuple(replace(f, fibre=fibre) for f in d.by_fibre), augmented={fibre: names[3]},
        map_before={fibre: replace(known, trials=tuple(trial(t) for t in known.trials))},
        nuisance_parameters=tuple(replace(n, group=names[3]) for n in d.nuisance_parameters[:2]),
    )  # fmt: skip
    renamed = tuple(
        replace(t, fibre=fibre, trial=trial(t.trial),
                without_f0={names[k]: f for k, f in enumerate(t.without_f0.values())}) for t in traces
    )  # fmt: skip
    text = html.as_html(*Sample(swapped, renamed))
    text.encode("utf-8")
    walker = Walker(text)
    assert walker.tags.isdisjoint({"script", "iframe"})
    assert "onerror" not in walker.attributes
    assert len(walker.sources) == 5
    shown = plain(walker.text)
    for name in names:
        kept = "".join(c if c >= " " or c == "\n" else "\ufffd" for c in name).replace("\ud800", "?")
        assert plain(kept) in shown


def test_the_same_diagnosis_makes_the_same_page() -> None:
    assert html.as_html(*ALL["nothing"]()) == page("nothing")


def test_units_do_not_part_from_their_numbers() -> None:
    assert html._units("1.6 % F0 of <b> at 2 L0/s, 12 ms, > 0.99") == (
        "1.6\u00a0%\u00a0F<sub>0</sub> of &lt;b&gt; at 2 L<sub>0</sub>/s, 12\u00a0ms, &gt;\u00a00.99"
    )


def test_templates_and_style_are_installed_with_the_package() -> None:
    for name in (
        "page",
        "macros",
        "components",
        "where",
        "fibres",
        "residual",
        "features",
        "artefacts",
        "sets",
        "closing",
    ):
        assert html.source(f"templates/{name}.html.j2").strip()
    assert "@media print" in html.source("report.css")
    assert html.source("report.css") in page("nothing")
