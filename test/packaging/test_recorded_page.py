"""The page of the recordings: what stays of a former one, and how held-out trials are told."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from xb_muscle_ros.diagnose import outputs

_SCRIPTS = Path(__file__).parents[2] / "scripts"


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(_SCRIPTS)
    return importlib.import_module("recorded_page")


@pytest.fixture
def tables(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(_SCRIPTS)
    return importlib.import_module("recorded_tables")


def _row(before: float | None, after: float | None, warned: bool = False) -> dict[str, Any]:
    own = {"pca_shift": 0.02, "force_offset": -0.001}
    return {
        "fibre": "f", "trial": "t", "tests": "ramps", "warned": warned, "rmsd_f0": {"before": before, "after": after},
        "own": {"before": own, "after": {}}, "end_f0": {"measured": 0.5, "before": 0.4, "after": None},
    }  # fmt: skip


def test_sections_of_the_former_version_are_marked_once_and_others_stay_as_they_are(page: ModuleType) -> None:
    new = "## New\n\n<!-- diagnosis.json, format 2 -->\n\nText.\n"
    given = f"# Real recordings\n\nIntro.\n\n## Overview\n\nRows.\n\n## Old\n\nText.\n\n{new}"
    kept = dict(page.former_sections(given))
    assert kept == {"Old": f"## Old\n\n{page.FORMER}\n\nText.\n", "New": new}
    again = page.write_page([], "images", given)
    assert page.write_page([], "images", again) == again
    assert again.count(page.FORMER) == 1
    assert again.startswith(page.INTRO)


def test_a_trial_without_solution_by_the_answer_is_not_better(tables: ModuleType) -> None:
    lines = tables.held_out([_row(0.02, 0.01), _row(0.02, None, True), _row(None, 0.05)]).splitlines()[2:]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    assert [row[2:6] for row in cells[:3]] == [
        ["2.00", "1.00", "yes", "no"],
        ["2.00", "–", "no", "yes"],
        ["–", "5.00", "yes", "no"],
    ]
    assert cells[0][6:8] == ["+0.020 / –", "-0.10 / –"]
    assert cells[3][:5] == ["all", "", "–", "–", "1 of 3"]


def test_where_there_is_no_answer_the_base_stands_alone(tables: ModuleType) -> None:
    row = _row(0.02, None)
    row["rmsd_f0"] = {"before": 0.02}
    text = tables.held_out([row])
    assert "answer" not in text
    assert "50.00 / 40.00 |" in text


@pytest.mark.parametrize("key", ["concealed", "heldout", "held_out"])
def test_a_section_has_every_fibre_and_an_overview_every_study(
    page: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, key: str
) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "diagnose" / "report")
    d = importlib.import_module("sample_diagnoses").five_fibres().diagnosis
    cases = importlib.import_module("recorded_cases").CASES
    (tmp_path / "diagnosis.json").write_text(json.dumps(outputs.as_row(d)))
    # Older formats had other names for held-out trials.
    rows = [_row(0.02, 0.01), _row(0.02, 0.05)]
    tree = {"format_version": 2, "held_out": rows} if key == "held_out" else {key: rows}
    (tmp_path / "predictions.json").write_text(json.dumps(tree))
    text = page.write_page([(cases["fibres_2state"], tmp_path)], "images", "## Five rat soleus fibres, base `2state`\n")
    assert page.FORMER not in text
    assert text.count("## Five rat soleus fibres, base `2state`\n") == 1
    for row in d.by_fibre:
        assert f"| {row.fibre} " in text
    overview = " ".join(text[text.index("## Overview") : text.index("## Five")].split())
    assert "1 of 2 | 1 |" in overview
