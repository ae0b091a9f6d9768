"""The made laboratory of the fibre tutorial: its file, and what the page says was put in and came out."""

from __future__ import annotations

import math
import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xb_muscle_ros as xb

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "tutorials" / "fibre.md"


@pytest.fixture(scope="module")
def lab() -> dict[str, Any]:
    """The names that scripts/make_tutorial_lab defines."""
    return runpy.run_path(str(ROOT / "scripts" / "make_tutorial_lab"))


def table() -> dict[str, list[str]]:
    """Cells of the page's table of parameters, by parameter."""
    rows = re.findall(r"^\| `(\w+)` \([^|]*\) \|(.*)\|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return {name: [cell.strip(" *") for cell in rest.split("|")] for name, rest in rows}


def test_the_script_makes_the_file_that_is_there(lab: dict[str, Any], tmp_path: Path) -> None:
    kept = lab["TARGET"].read_text(encoding="utf-8").splitlines()
    made = tmp_path / "soleus_7.csv"
    lab["main"].__globals__["TARGET"] = made
    lab["main"]()
    again = made.read_text(encoding="utf-8").splitlines()
    assert again[:5] == kept[:5]
    numbers = [
        np.array([[float(cell.replace(",", ".") or "nan") for cell in line.split(";")] for line in lines[5:]])
        for lines in (again, kept)
    ]
    # The last digit may be rounded otherwise on another processor.
    np.testing.assert_allclose(numbers[0], numbers[1], rtol=0.0, atol=1.5e-5, equal_nan=True)


def test_what_the_page_says_was_put_in_is_what_the_script_puts_in(lab: dict[str, Any]) -> None:
    fibre = xb.changed(xb.load_fibre(lab["BASE"]), lab["TRUE"])
    told = table()
    assert len(told) == 11
    for name, cells in told.items():
        digits = len(cells[0].replace(".", "").lstrip("0"))
        value = fibre.values[name]
        rounded = round(value, digits - 1 - math.floor(math.log10(value)))
        assert float(cells[0]) == pytest.approx(rounded, rel=1e-9), name


def test_the_page_says_which_interval_misses_the_truth() -> None:
    missed = []
    for name, (truth, _, three, _, eleven) in table().items():
        for fit, interval in (("three", three), ("eleven", eleven)):
            if interval:
                low, high = (float(end) for end in interval.split(" to "))
                if not low <= float(truth) <= high:
                    missed.append((name, fit))
    assert missed == [("k21", "three")]
