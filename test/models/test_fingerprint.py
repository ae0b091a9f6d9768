"""Generated code is made anew where its own source has changed, and only there."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.models import fingerprint
from xb_muscle_ros.models.registry import METHODS, MODELS, compose

BLOCK = '''
"""A drag."""
{imports}
from xb_muscle_ros.mechanisms import Entry, Extra, Parameter

DRAG = Parameter("own_drag", "F0 s/L0", "drag", 0.0, 10.0, 0.0, "this test")


class Own(Extra):
    """{doc}"""

    name = "own"
    parameters = (DRAG,)
    entry = Entry("own_family", "own drag", "{meaning}", "own_drag", 0.02, starts=({{"own_drag": 0.01}},))

    def force(self, q):
        return {formula}  # {doc}
'''
USUAL = {"imports": "", "doc": "F = c v.", "meaning": "a drag", "formula": "q.own_drag * q.velocity"}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in ("own_block", "own_helper"):
        sys.modules.pop(name, None)


def of_file(folder: Path, **changes: str) -> str:
    """Fingerprint of a model with a mechanism whose file reads so."""
    for name in ("own_block", "own_helper"):
        sys.modules.pop(name, None)
    (folder / "own_block.py").write_text(BLOCK.format(**USUAL | changes), encoding="utf-8")
    importlib.invalidate_caches()
    fingerprint._tree.cache_clear()
    fingerprint._code.cache_clear()
    block: Any = importlib.import_module("own_block").Own
    return fingerprint.fingerprint(replace(MODELS["2state"], extras=(block,)).composed("own", Gaussian))


@pytest.fixture(autouse=True)
def no_bytecode(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files that are written twice within a second would be taken from bytecode."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)


def test_a_changed_formula_changes_it_and_changed_words_do_not(folder: Path) -> None:
    before = of_file(folder)
    assert of_file(folder) == before
    assert of_file(folder, doc="Force is drag times velocity.", meaning="a force that follows velocity") == before
    assert of_file(folder, formula="q.own_drag * q.velocity * 2") != before


def test_what_a_mechanism_imports_counts(folder: Path) -> None:
    found = []
    for text in ("TWICE = 2.0", "TWICE = 2.5"):
        (folder / "own_helper.py").write_text(text, encoding="utf-8")
        found.append(of_file(folder, imports="from own_helper import TWICE", formula="q.own_drag * q.velocity * TWICE"))
    assert found[0] != found[1]


def test_models_have_their_own_by_their_blocks() -> None:
    """Methods differ in rows, the two fixed grids in nothing; a mechanism reads its own file alone."""
    found = [fingerprint.fingerprint(compose(name, method)) for name in MODELS for method in METHODS]
    of_heads = [name for name in MODELS if not name.startswith("hill")]
    assert len(set(found)) == len(of_heads) * 3 + len(MODELS) - len(of_heads)
    names: dict[str, None] = {}
    for kind in type(compose("2state+viscous_drag").blocks[-1]).__mro__[:1]:
        fingerprint._collect(kind.__module__, names)
    assert list(names) == ["xb_muscle_ros.mechanisms.extras.viscous_drag"]
