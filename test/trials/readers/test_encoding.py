"""Text of other encodings: read rightly, told which, and settled by an option."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import lab_tables as lab
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import spool
from xb_muscle_ros.trials.readers import encoding as encodings

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


@pytest.mark.parametrize("block", [1, 2, 3, 7, 1000])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252", "latin-1"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_blocks_and_a_file_for_large_texts_change_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, encoding: str, end: str, block: int
) -> None:
    if block == 1 and encoding.startswith("utf-16-"):
        block = 4  # its zeros show in the first two characters
    if encoding in ("cp1252", "latin-1") and end == "\r":
        encoding = "mac_roman"
    path = lab.write(tmp_path, end.join(LINES).encode(encoding))
    whole = encodings.read_text(path)
    monkeypatch.setattr(encodings, "_BLOCK_BYTES", block)
    monkeypatch.setattr(spool, "LEAST", 10)
    found = encodings.read_text(path, None if block > 3 else "utf-8-sig" if encoding == "utf-8" else encoding)
    assert isinstance(whole.utf8, bytes)
    assert isinstance(found.utf8, spool.Spool)
    assert found.utf8[:] == whole.utf8 == "".join(f"{line}\n" for line in LINES).encode()
    if block > 3:
        assert found.notice == whole.notice


@pytest.mark.parametrize("block", [5, 64, 100_000])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_line_at_fault_is_named_whatever_the_blocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, block: int, end: str
) -> None:
    monkeypatch.setattr(encodings, "_BLOCK_BYTES", block)
    lines = ["time_s,length_mm,force_mN", *["0.001,2,3"] * 30, "# 20 °C", *["0.001,2,3"] * 30]
    path = lab.write(tmp_path, end.join(lines).encode("cp1252"))
    assert "line 32 is no UTF-8; the file is read as Windows-1252" in encodings.read_text(path).notice
    with pytest.raises(UserError, match=r"line 32 is no utf-8 text \(invalid start byte\)"):
        encodings.read_text(path, "utf-8")


def test_a_zero_anywhere_is_no_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encodings, "_BLOCK_BYTES", 8)
    path = lab.write(tmp_path, b"a,b\n1,2\n3,4\n5,\x006\n")
    with pytest.raises(UserError, match="is no text; export the recording as CSV or TSV"):
        encodings.read_text(path)


@pytest.mark.parametrize("encoding", ["utf-16", "utf_32", "UTF16"])
def test_an_order_of_bytes_that_is_not_told_is_the_machine_s(tmp_path: Path, encoding: str) -> None:
    own = f"{encoding.lower().replace('_', '-')}-{sys.byteorder[0]}e".replace("utf16", "utf-16")
    path = lab.write(tmp_path, "\n".join(LINES).encode(own))
    assert encodings.read_text(path, encoding).utf8[:] == "".join(f"{line}\n" for line in LINES).encode()


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32", "punycode", "utf-7"])
def test_text_of_another_encoding_is_one_line(tmp_path: Path, encoding: str) -> None:
    path = lab.write(tmp_path, "\n".join(LINES).encode("utf-8"))
    why = lab.refusal(path, COLUMNS, encoding=encoding)
    assert str(path) in why
    with pytest.raises(UserError, match="encoding is 'undefined'"):
        lab.run(path, COLUMNS, encoding="undefined")


def test_the_line_at_fault_of_wide_characters(tmp_path: Path) -> None:
    lines = ["time_s,length_mm,force_mN", *["0.001,2,3"] * 30]
    path = lab.write(tmp_path, "\n".join(lines).encode("utf-16-le") + b"\n\x00\x00\xd8\x31\x00")
    with pytest.raises(UserError, match=r"line 32 is no utf-16-le text"):
        encodings.read_text(path, "utf-16-le")
