"""Lines that are cut out of a text when they are asked for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.trials.readers import text_lines
from xb_muscle_ros.trials.readers.text_lines import TextLines, lines_of

LINES = st.lists(
    st.one_of(st.text(st.sampled_from("1,.# \t\u00b5\u00a0x"), max_size=12), st.just("# fact"), st.just("")),
    max_size=30,
)


def _pairs(lines: TextLines) -> list[tuple[int, str]]:
    return list(zip(lines.numbers.tolist(), lines, strict=True))


@settings(max_examples=300)
@given(lines=LINES, block=st.integers(1, 40), data=st.data())
def test_lines_are_those_of_the_text(lines: list[str], block: int, data: st.DataObject) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text_lines, "_BLOCK", block)
        patch.setattr(text_lines, "_SEARCHED", block)
        rows, comments = lines_of("".join(f"{line}\n" for line in lines).encode(), lambda line: line != "#1")
        kept = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and (line[0] != "#" or line == "#1")]
        assert _pairs(rows) == kept
        assert _pairs(comments) == [(i, line) for i, line in enumerate(lines, 1) if line[:1] == "#" and line != "#1"]
        first = data.draw(st.integers(0, len(rows)))
        part = rows[first:]
        assert _pairs(part) == kept[first:]
        assert [part[i] for i in range(len(part))] == [line for _, line in kept[first:]]
        for line in {*lines, "1", "# fact", "no such"}:
            assert (line in part) == (line in [each for _, each in kept[first:]])
        places = np.flatnonzero(np.arange(len(part)) % 2)
        assert _pairs(part.take(places)) == kept[first:][1::2]


def test_a_comment_becomes_a_row_without_its_sign() -> None:
    rows, comments = lines_of(b"#  a,b\n1,2\n3,4\n", lambda line: True)
    made = rows.with_line(0, comments[:1], 3)
    assert _pairs(made) == [(1, "a,b"), (2, "1,2"), (3, "3,4")]
    assert made[0] in made
    assert len(lines_of(b"", lambda line: True)[0]) == 0
