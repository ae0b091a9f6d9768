"""The inspect command: report, mapping, picture; nothing is replaced unasked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import main

ROWS = "".join(f"{i / 1000},{1.2 + (0.05 if i > 60 else 0.0)},0.3\n" for i in range(100))


def _file(folder: Path, name: str = "a_pCa6.1.csv") -> Path:
    file = folder / name
    file.write_text("# f0: 0.5 mN\ntime_s,length_mm,force_mN\n" + ROWS)
    return file


def test_a_file_is_inspected_then_imported_by_its_mapping(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, mapping, out = _file(tmp_path), tmp_path / "m.yaml", tmp_path / "out"
    assert main(["inspect", str(file), "--mapping-out", str(mapping), "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert "Everything an import needs was recognised" in told
    assert sorted(path.name for path in out.iterdir()) == ["a_pCa6.1.pdf", "a_pCa6.1.png", "inspection.json"]
    tree = json.loads((out / "inspection.json").read_text())
    assert [row["role"] for row in tree["files"][0]["signals"]] == ["time", "length", "force"]
    assert main(["import", str(file), "--mapping", str(mapping), "--out", str(tmp_path / "bags")]) == 0
    assert main(["inspect", str(file), "--mapping-out", str(mapping)]) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_what_cannot_be_read_is_named_and_the_rest_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = tmp_path / "b.csv"
    broken.write_text("1,2\n3,4\n")
    assert main(["inspect", str(broken), str(_file(tmp_path))]) == 1
    told = capsys.readouterr()
    assert "needed is a header line" in told.err
    assert "length_mm" in told.out
    assert main(["inspect", str(broken)]) == 2


def test_a_folder_shows_signals_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a_pCa6.1.csv", "b_pCa4.5.csv"):
        (tmp_path / name).write_text("time_s,length_mm\n" + "".join(f"{i / 1000},1.2\n" for i in range(50)))
    assert main(["inspect", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert told.count("taken for") == 1
    assert "b_pCa4.5.csv: the signals of" in told
