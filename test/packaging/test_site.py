"""What scripts/site makes for the site beside its pages."""

from __future__ import annotations

import argparse
import base64
import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

_SITE = Path(__file__).parents[2] / "scripts" / "site"


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(_SITE)
    pytest.importorskip("mkdocs", reason="needs the extra docs")
    return importlib.import_module("hooks")


def _parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for made in action.choices.values():
                yield from _parsers(made)


def test_every_command_and_every_option_is_in_the_reference(site: ModuleType) -> None:
    from xb_muscle_ros.cli.main import build_parser

    text = site.command_line.reference()
    for made in list(_parsers(build_parser()))[1:]:
        assert f"# {made.prog}\n" in text
        section = text.split(f"# {made.prog}\n")[1].split("\n#")[0]
        for action in made._actions:
            for name in set(action.option_strings) - {"-h", "--help"}:
                assert f"`{name}`" in section, (made.prog, name)


def test_a_table_has_as_many_cells_in_each_row_whatever_the_text_says(site: ModuleType) -> None:
    # In a process of its own: modules of ROS are stood in for there.
    program = "import json, hooks; print(json.dumps({name: made() for name, made in hooks.GENERATED.items()}))"
    done = subprocess.run([sys.executable, "-c", program], cwd=_SITE, check=True, capture_output=True, text=True)
    parts = json.loads(done.stdout)
    assert "`rate_hz`" in parts["node parameters"]
    assert "`viscous_drag`" in parts["mechanisms"]
    for text in parts.values():
        for block in text.split("\n\n"):
            rows = [line.replace("\\|", "").count("|") for line in block.splitlines() if line.startswith("|")]
            assert len(set(rows)) <= 1
    assert site.tables.cell("a | b_c\n *d* <e> [f]") == r"a \| b\_c \*d\* \<e> \[f]"


def test_a_notebook_is_shown_with_its_outputs_and_not_run(site: ModuleType, tmp_path: Path) -> None:
    picture = base64.b64encode(b"\x89PNG").decode()
    outputs = [
        {"output_type": "stream", "text": ["1\n", "2\n"]},
        {"output_type": "display_data", "data": {"image/png": picture, "text/plain": ["<Figure>"]}},
        {"output_type": "execute_result", "data": {"text/html": ["<table></table>"], "text/plain": ["x"]}},
        {"output_type": "error", "traceback": ["\x1b[31mValueError\x1b[0m: no"]},
    ]
    cells = [
        {"cell_type": "markdown", "source": ["# Title\n", "Text."]},
        {"cell_type": "code", "source": ["print(undefined)"], "outputs": outputs},
    ]
    path = tmp_path / "study.ipynb"
    path.write_text(json.dumps({"cells": cells, "nbformat": 4}), encoding="utf-8")
    page = site.notebooks.as_page(path)
    assert page.text.startswith("# Title\nText.\n\n```python\nprint(undefined)\n```\n\n```text\n1\n2\n```\n")
    assert "![Output](study_1.png)" in page.text
    assert page.pictures == {"study_1.png": b"\x89PNG"}
    assert "<table></table>" in page.text
    assert "ValueError: no" in page.text
    assert "\x1b" not in page.text


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("see `scripts/setup` and `models/muscle.py`", False),
        ("see `muscle.py`, `report.html` and `out/a.py`", False),
        ("see `scripts/none_of_these`", True),
        ("see `models/none_of_these.py`", True),
        ("```bash\n`scripts/none_of_these`\n```\n", False),
    ],
)
def test_files_that_a_page_names_are_looked_for(
    site: ModuleType, caplog: pytest.LogCaptureFixture, text: str, missing: bool
) -> None:
    site._check_names(text, "page.md")
    assert ("none_of_these" in caplog.text) is missing


def test_a_page_that_loads_from_another_host_is_found(site: ModuleType) -> None:
    assert site._FETCHED.search('<script async src="https://host/x.js"></script>')
    assert site._FETCHED.search("<link rel=stylesheet href=//host/x.css>")
    assert not site._FETCHED.search('<a href="https://host/">x</a><script src="../assets/x.js"></script>')
