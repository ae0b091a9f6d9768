"""What users are told is one printable line."""

from __future__ import annotations

import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.errors import DataWarning, UserError, one_line


@given(st.text())
def test_any_text_becomes_one_printable_line_and_stays_so(text: str) -> None:
    line = one_line(text)
    assert line.isprintable()
    assert one_line(line) == line


@pytest.mark.parametrize("kind", [UserError, DataWarning])
def test_names_that_cannot_be_printed_are_shown_by_their_codes(kind: type[Exception]) -> None:
    told = kind("muscle 'sol\0eus\x1b[31m' of\n  file \udcff")
    assert str(told) == r"muscle 'sol\x00eus\x1b[31m' of file \udcff"
    assert str(pickle.loads(pickle.dumps(told))) == str(told)
