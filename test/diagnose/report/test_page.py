"""The page of a diagnosis: for every verdict, with gaps, and with names that try to break it."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from xb_muscle_ros.diagnose.names import Verdict
from xb_muscle_ros.diagnose.report import write_report
from xb_muscle_ros.diagnose.summary import summary_text


class Walker(HTMLParser):
    """Checks on the way that tags balance; collects ids, links, other attributes, and text in and outside links."""

    VOID = ("meta", "img", "br")

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.outside = ""
        self.linked: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.tags.add(tag)
        self.attributes |= set(found)
        self.ids += [str(found["id"])] if "id" in found else []
        self.links += [str(found["href"])] if "href" in found else []
        self.sources += [str(found["src"])] if "src" in found else []
        if tag == "a" and found.get("class") == "n":
            self.linked.append("")
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "a" in self.open and self.linked:
            self.linked[-1] += data
        elif "style" not in self.open:
            self.outside += data


def walked(path: Path) -> Walker:
    """A page that holds together: tags balance, links resolve, ids are unique, nothing is loaded."""
    text = path.read_text(encoding="utf-8")
    walker = Walker()
    walker.feed(text)
    walker.close()
    assert walker.open == []
    assert len(walker.ids) == len(set(walker.ids))
    assert all(link.startswith("#") and link[1:] in walker.ids for link in walker.links)
    assert walker.tags.isdisjoint({"script", "link", "iframe", "object", "base", "form"})
    assert not any(name.startswith("on") for name in walker.attributes)
    assert not re.search(r"(https?:)?//\w", re.sub(r"data:image/svg\+xml;base64,[\w+/=]+", "", text))
    for figure in figures(walker):
        assert not re.search(r"(href|src)=\"(?!#|data:image/png)|url\((?!#)|@import", figure)
    return walker


def figures(walker: Walker) -> list[str]:
    """SVG of all figures, each well formed."""
    found = []
    for source in walker.sources:
        head, _, data = source.partition(",")
        assert head == "data:image/svg+xml;base64"
        found.append(base64.b64decode(data).decode("utf-8"))
        ElementTree.fromstring(found[-1])
    return found


@pytest.mark.parametrize("verdict", [v.value for v in Verdict])
def test_every_verdict_makes_a_page_with_its_summary_and_figures(made: Any, verdict: str) -> None:
    given = made(verdict)
    page = walked(given.report())
    text = page.outside + " ".join(page.linked)
    for row in given.facts["checks"]:
        assert row["name"] in text
    # Map, trials, ranking, before and after always; memory where it describes something, profile where there is one.
    memory = given.facts["kernel"] is not None and given.facts["kernel"]["explained"] >= 0.2
    assert len(page.sources) == 4 + memory + (given.facts["profile"] is not None)
    assert ("Physics that was left out" in text) == (verdict == "physics")
    assert ("augmented.yaml" in text) == bool(given.facts["answer"])


def test_numbers_of_the_diagnosis_stand_in_links_only(made: Any) -> None:
    given = made("physics")
    given.facts["before"] = {"train_rmsd_f0": 0.0831, "heldout_rmsd_f0": 0.0862}
    given.facts["after"] = {"train_rmsd_f0": 0.0773, "heldout_rmsd_f0": 0.0794}
    given.facts["start"] = {"train_rmsd_f0": 0.0911}
    given.facts.update(flexible_bound_rmsd_f0=0.0782, p_value=0.00737, confidence=0.731)
    given.facts["summary"] = summary_text(given.facts)
    page = walked(given.report())
    for shown in ("8.3", "8.6", "7.7", "7.9", "7.8", "0.00737", "73 %", "9.1"):
        assert any(shown in link for link in page.linked), shown
        assert not re.search(rf"(?<![\d.]){re.escape(shown)}(?!\d)", page.outside), shown
    # What the tool tells of its computing stands in place of the definition, and what nothing links to stands as well.
    assert all(text in page.outside for text in given.facts["how"].values())
    assert "how-something_else" in page.ids


HOSTILE = (
    "<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "$\\frac{1}{$ & _^%#",
    "nul \x00 bell \x07 line\nfeed", "half \ud800 pair, 力 и ünïcödé 🦵",
    "]]> --> &amp; https" + "://example.org/x", "x" * 400,
)  # fmt: skip


@pytest.mark.parametrize("turn", range(3))
def test_names_may_hold_anything(made: Any, turn: int) -> None:
    given = made("physics")
    names = [HOSTILE[(3 * turn + k) % len(HOSTILE)] for k in range(3)]
    text = json.dumps(given.facts)
    for row, name in zip(given.facts["trials"], names, strict=False):
        text = text.replace(json.dumps(row["trial"]), json.dumps(name))
    text = text.replace('"18Dec2017a"', json.dumps(names[0])).replace('"drag"', json.dumps(names[1]))
    text = text.replace('"static_calcium_stiffness"', json.dumps(names[2])).replace(
        '"something_else"', json.dumps(names[1])
    )
    text = text.replace('"recovery"', json.dumps(names[2])).replace('"s"', json.dumps(names[0]))
    changed_facts = json.loads(text)
    changed_facts["warnings"] = changed_facts["missing"] = names
    changed_facts["summary"] = summary_text(changed_facts)
    (given.folder / "diagnosis.json").write_text(json.dumps(changed_facts), encoding="utf-8")
    path = given.folder / "report.html"
    page = Walker()
    page.feed(write_report(given.folder).read_text(encoding="utf-8"))
    assert page.open == []
    assert page.tags.isdisjoint({"script", "iframe"})
    assert "onerror" not in page.attributes
    assert all(link[1:] in page.ids for link in page.links)
    assert len(figures(page)) == 6
    shown = page.outside + "".join(page.linked)
    for name in names:
        assert "".join(c if c >= " " or c == "\n" else "\ufffd" for c in name).replace("\ud800", "?") in shown
    assert path.is_file()


def leaves(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all that may be null."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in items:
        if isinstance(value, (dict, list)) and value:
            yield from leaves(value, (*path, key))
        elif key not in ("trial", "name", "verdict", "trials", "start_s", "end_s") and path[-1:] != ("trials",):
            yield (*path, key)


def test_everything_unknown_still_makes_a_page(made: Any) -> None:
    given = made("physics")
    for path in leaves(given.facts):
        inner = given.facts
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = None
    given.facts["answer"] = []
    walked(given.report())


@pytest.mark.parametrize("verdict", [v.value for v in Verdict])
def test_empty_lists_and_missing_keys_still_make_a_page(tmp_path: Path, verdict: str) -> None:
    (tmp_path / "diagnosis.json").write_text(json.dumps({"verdict": verdict, "trials": []}), encoding="utf-8")
    np.savez(tmp_path / "traces.npz")
    page = walked(write_report(tmp_path))
    assert page.sources == []
    assert "nan" not in page.outside.lower().split()
    assert "None" not in page.outside.replace("None of the", "")
