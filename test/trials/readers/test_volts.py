"""Lengths and forces in volts: a calibration in place of the unit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.inspecting.inspection import inspect_file
from xb_muscle_ros.trials.readers.csv import read_csv
from xb_muscle_ros.trials.readers.mapping import build_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial

TIME_S = np.arange(300) / 1000.0
CHANGE_MM = np.interp(TIME_S, [0.1, 0.2], [0.0, 0.05])
FORCE_MN = 0.3 + 2.0 * CHANGE_MM
LENGTH = {"column": "Length (V)", "unit": "0.1 mm/V", "is": "change"}
FORCE = {"column": "Force (V)", "unit": "-0.5 mN/V", "zero": "0.12 V"}


def table(folder: Path, millivolts: bool = False) -> Path:
    """Length at 0.1 mm/V, force turned over at 0.5 mN/V with 0.12 V at rest."""
    many, unit = (1e3, "mV") if millivolts else (1.0, "V")
    rows = zip(TIME_S, many * CHANGE_MM / 0.1, many * (0.12 - FORCE_MN / 0.5), strict=True)
    path = folder / "volts.csv"
    lines = [f"Time (s),Length ({unit}),Force ({unit})", *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines))
    return path


def keys(length: dict[str, Any] | None = None, force: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    columns = {"time": {"column": "1", "unit": "s"}, "length": {**LENGTH, **(length or {})},
               "force": {**FORCE, **(force or {})}}  # fmt: skip
    return {"fibre": "f", "pca": 6.1, "columns": columns, "reference_length": "1.2 mm", "f0": "0.5 mN", **more}


def read(path: Path, tree: dict[str, Any]) -> Trial:
    return read_csv(path, build_mapping(tree, "the mapping"))


def same(trial: Trial) -> None:
    assert trial.length_m == pytest.approx(1e-3 * (1.2 + CHANGE_MM), abs=1e-12)
    assert trial.force_n == pytest.approx(1e-3 * FORCE_MN, abs=1e-12)


def test_calibration_polarity_and_zero(tmp_path: Path) -> None:
    trial = read(table(tmp_path), keys())
    same(trial)
    assert not trial.warnings
    assert "of the recorded force are its zero" in trial.facts.source


def test_millivolts(tmp_path: Path) -> None:
    tree = keys({"column": "Length (mV)", "unit": "1e-4mm/mV"}, {"column": "Force (mV)", "unit": "-5e-4 mN/mV"})
    trial = read(table(tmp_path, millivolts=True), tree)
    same(trial)
    assert not trial.warnings


def test_what_the_column_reads_at_the_reference_length(tmp_path: Path) -> None:
    path = table(tmp_path)
    text = path.read_text().splitlines()
    raised = [text[0]]
    for line in text[1:]:
        t, length, force = line.split(",")
        raised.append(f"{t},{float(length) + 2.5:.9g},{force}")
    path.write_text("\n".join(raised))
    tree = keys()
    tree["columns"]["length"] = {"column": "Length (V)", "unit": "0.1 mm/V", "at_reference": "2500 mV"}
    same(read(path, tree))


@pytest.mark.parametrize(
    ("length", "force", "words"),
    [
        (
            {},
            {"unit": "V"},
            r"'V' is no unit of force; in its place give what one V stands for, for example '0.5 mN/V'",
        ),
        ({"unit": "mV"}, {}, r"'mV' is no unit of length; in its place give what one mV stands for"),
        ({}, {"unit": "0 mN/V"}, "makes nothing of a volt"),
        ({}, {"unit": "0.5 mm/V"}, "unit '0.5 mm/V' of force is not known"),
        ({}, {"zero": "none"}, "allowed: as_recorded, slack, or what the column reads without force"),
        ({}, {"zero": "0.1 kPa"}, "zero is a stress, the force column a force"),
        ({}, {"zero": "1 x"}, "unit 'x' of force is not known"),
        ({"is": None}, {}, "lengths are in volts, and what 0 V is does not show"),
        ({"is": None, "at_reference": "high"}, {}, "at_reference is 'high'; needed is a number and its unit"),
    ],
)
def test_what_is_no_calibration_is_one_line(length: dict[str, Any], force: dict[str, Any], words: str) -> None:
    tree = keys(length, force)
    tree["columns"]["length"] = {key: value for key, value in tree["columns"]["length"].items() if value is not None}
    with pytest.raises(UserError, match=words):
        build_mapping(tree, "the mapping")


def test_volts_that_are_read_as_something_else_are_told(tmp_path: Path) -> None:
    trial = read(table(tmp_path), keys({"unit": "mm"}, {"unit": "mN", "zero": "as_recorded"}))
    told = "\n".join(trial.warnings)
    assert "'Length (V)' is read in mm, but its header tells V; by columns.length.unit (--length-unit) give" in told
    assert "'Force (V)' is read in mN, but its header tells V" in told
    wrong = read(table(tmp_path), keys({"unit": "0.1 mm/mV"}))
    assert any("is read in 0.1 mm/mV, but its header tells V" in line for line in wrong.warnings)


def test_a_header_in_volts_asks_for_a_calibration(tmp_path: Path) -> None:
    tree = keys()
    del tree["columns"]["force"]["unit"]
    with pytest.raises(
        UserError, match=r"'Force \(V\)' is in volts; by columns.force.unit in the mapping or --force-un"
    ):
        ImportSettings(tree, "here").prepare(table(tmp_path))
    found = inspect_file(table(tmp_path))
    assert {"length", "force"} <= set(found.recognition.roles)
    assert any("what one V stands for, for example '0.5 mN/V'" in line for line in found.proposal.missing)


def test_zero_of_a_force_in_its_own_unit(tmp_path: Path) -> None:
    path = tmp_path / "f.csv"
    rows = zip(TIME_S, 1.2 + CHANGE_MM, FORCE_MN + 0.05, strict=True)
    path.write_text("t,l,f\n" + "\n".join(",".join(f"{value:.9g}" for value in row) for row in rows))
    columns = {"time": {"column": "t", "unit": "s"}, "length": {"column": "l", "unit": "mm"},
               "force": {"column": "f", "unit": "mN", "zero": "0.05 mN"}}  # fmt: skip
    trial = read(path, {**keys(), "columns": columns})
    assert trial.force_n == pytest.approx(1e-3 * FORCE_MN, abs=1e-12)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"f0": "0.5 V"}, "f0 is in 'V'; needed is a force in one of N, mN"),
        ({"f0": "1 0.5mN/V"}, "f0 is in '0.5mN/V'; needed is a force"),
        ({"reference_length": "2 V"}, "reference_length is in 'V'; needed is a length"),
    ],
)
def test_amounts_are_not_in_volts(more: dict[str, Any], words: str) -> None:
    with pytest.raises(UserError, match=words):
        build_mapping({**keys(), **more}, "the mapping")
    with pytest.raises(UserError, match=r"unit 'mN/V' of force lacks the number before it, for example '0.5 mN/V'"):
        build_mapping(keys(force={"unit": "mN/V"}), "the mapping")


def test_headers_that_spell_volts(tmp_path: Path) -> None:
    path = table(tmp_path)
    path.write_text(path.read_text().replace("(V)", "(Volts)"))
    tree = keys({"column": "Length (Volts)", "unit": "mm"}, {"column": "Force (Volts)", "unit": "mN", "zero": "0 mN"})
    assert sum("its header tells V" in line for line in read(path, tree).warnings) == 2


def test_inspect_asks_what_zero_volts_are(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = zip(TIME_S, 2.5 + CHANGE_MM, FORCE_MN, strict=True)
    path.write_text("t (s),length (V),force (mN)\n" + "\n".join(",".join(f"{v:.9g}" for v in row) for row in rows))
    assert any(line.startswith("columns.length.is: what 0 V is") for line in inspect_file(path).proposal.missing)
