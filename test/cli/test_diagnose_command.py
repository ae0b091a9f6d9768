"""`xb_muscle diagnose` with several fibres and tables of features: bad input is one line, and nothing is written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch

A, B = "14Dec2017b", "18Dec2017a"


@pytest.fixture
def bags(tmp_path: Path) -> dict[str, str]:
    """A bag of each fibre at one condition."""
    found = {}
    for name in (A, B):
        trial = StretchShortenStretch(0.0383, 0.1).trial(name, 6.2)
        trial = replace(trial, force_time_s=trial.time_s, force_n=np.full(trial.time_s.size, 0.4))
        write_trial(tmp_path / name, trial)
        found[name] = str(tmp_path / name)
    return found


def _said(arguments: list[str], out: Path, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["diagnose", *arguments, "--out", str(out)]) == 2
    captured = capsys.readouterr()
    assert not captured.out
    (line,) = captured.err.splitlines()
    assert not out.exists()
    return line


def test_studies_that_do_not_hold_together_are_refused(
    bags: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    line = _said([bags[A], "--fiber", A, B], out, capsys)
    assert "no bag is of fibre '18Dec2017a'" in line
    line = _said([bags[A], bags[B], "--fiber", A, "19Dec2017a"], out, capsys)
    assert "no bag is of fibre '19Dec2017a'" in line
    assert "is given 2 times" in _said([bags[A], "--fiber", A, A], out, capsys)
    assert "--trials-of" in _said([bags[A], bags[B], "--fiber", A, B, "--trials-of", A], out, capsys)


@pytest.mark.parametrize("option", ["--features", "--predict"])
def test_tables_that_do_not_belong_to_the_study_are_refused(
    bags: dict[str, str], option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, table = tmp_path / "out", tmp_path / "table.json"
    cells = {name: [[[1.0]]] for name in ("srs_test", "srs_conditioning", "isometric_force")}
    tree = {"pCa": [6.2], "recovery_s": [0.1], "amplitude_L0": [0.0383], "fibres": {B: cells}}
    table.write_text(json.dumps(tree), encoding="utf-8")
    line = _said([bags[A], "--fiber", A, option, str(table)], out, capsys)
    assert f"features {table} are of '{B}'; the trials are of '{A}'" in line
    table.write_text(json.dumps({**tree, "pCa": [4.5]}), encoding="utf-8")
    assert "no condition in common" in _said([bags[B], "--fiber", B, option, str(table)], out, capsys)
    assert "cannot be read" in _said([bags[B], "--fiber", B, option, str(tmp_path / "none.json")], out, capsys)
