"""Text of other encodings: read rightly, told which, and settled by an option."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import lab_tables as lab
import pytest

from xb_muscle_ros.errors import UserError

NAME = "length (µm)"
COLUMNS = {**lab.COLUMNS, "length": {"column": NAME}}
LINES = [f"time_s;{NAME};force_mN;20 °C", *(f"{line};0" for line in lab.rows(lab.TIME_S, 1e3 * lab.LENGTH_MM,
         lab.FORCE_MN, delimiter=";"))]  # fmt: skip


@pytest.mark.parametrize(
    ("encoding", "end", "words"),
    [
        ("utf-8", "\n", ""),
        ("utf-8-sig", "\r\n", ""),
        ("utf-16", "\r\n", "is UTF-16 text and read as such"),
        ("utf-16-le", "\n", "is UTF-16 text and read as such"),
        ("utf-16-be", "\n", "is UTF-16 text and read as such"),
        ("cp1252", "\r\n", "line 1 is no UTF-8; the file is read as Windows-1252 (cp1252) (--encoding names another)"),
        ("latin-1", "\n", "line 1 is no UTF-8; the file is read as Windows-1252 (cp1252)"),
        ("mac_roman", "\r", "line 1 is no UTF-8; the file is read as Mac Roman, as its ends of lines are those of a"),
    ],
)
def test_what_is_found_is_told(tmp_path: Path, encoding: str, end: str, words: str) -> None:
    path = lab.write(tmp_path, end.join(LINES).encode(encoding))
    (trial,) = lab.trials(path, COLUMNS)
    lab.same(trial)
    assert words in lab.told(trial)
    assert len(trial.warnings) == (2 if words else 1)  # and the unit of the header


def test_mac_roman_with_other_ends_of_lines_takes_the_option(tmp_path: Path) -> None:
    lines = [line.replace("force_mN", "Ångström_mN") for line in LINES]
    columns: dict[str, Any] = {**COLUMNS, "force": {"column": "Ångström_mN"}}
    path = lab.write(tmp_path, "\n".join(lines).encode("mac_roman"))
    why = lab.refusal(path, columns)
    assert "has no column 'Ångström_mN'" in why
    (trial,) = lab.trials(path, columns, encoding="mac_roman")
    lab.same(trial)
    assert "UTF-8" not in lab.told(trial)


def test_an_encoding_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    path = lab.write(tmp_path, "\r\n".join(LINES).encode("cp1252"))
    assert "line 1 is no utf-8 text (invalid start byte); give another encoding" in lab.refusal(
        path, COLUMNS, encoding="utf-8"
    )
    with pytest.raises(UserError, match="encoding is 'klingon'; needed is one that Python knows"):
        lab.run(path, COLUMNS, encoding="klingon")
