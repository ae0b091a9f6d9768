"""The files of a diagnosis: each whole or not at all, and the page can be made anew from the other two."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from sample_diagnoses import nothing, one_fibre

from xb_muscle_ros.diagnose.report.output import JSON, PAGE, TRACES, read, write, write_page
from xb_muscle_ros.diagnose.report.prose import headline, summary
from xb_muscle_ros.diagnose.report.traces import read_traces
from xb_muscle_ros.errors import UserError


def test_all_files_are_written_and_read(tmp_path: Path) -> None:
    d, traces = nothing()
    write(tmp_path / "new", d, traces)
    assert sorted(p.name for p in (tmp_path / "new").iterdir()) == sorted([JSON, PAGE, TRACES])
    assert read(tmp_path / "new") == d
    assert [t.trial for t in read_traces(tmp_path / "new" / TRACES)] == [t.trial for t in traces]
    first = (tmp_path / "new" / PAGE).read_bytes()
    assert write_page(tmp_path / "new") == tmp_path / "new" / PAGE
    assert (tmp_path / "new" / PAGE).read_bytes() == first


def test_the_json_has_its_words_beside_its_fields(tmp_path: Path) -> None:
    d, traces = one_fibre()
    write(tmp_path, d, traces, page=False)
    assert not (tmp_path / PAGE).exists()
    row = json.loads((tmp_path / JSON).read_text(encoding="utf-8"))
    assert row["headline"] == headline(d)
    assert row["summary"] == " ".join(summary(d))
    assert row["how"]["inclusion_probability"].startswith("Probability that a component")
    assert row["format_version"] == 2
    assert row["components"][0]["inclusion_probability"] == 0.998


@pytest.mark.parametrize(
    ("text", "told"),
    [(None, "cannot be read"), ("{", "cannot be read"), ('{"version": 1}', "older version"), ("[]", "holds a list")],
)  # fmt: skip
def test_damage_is_named_and_no_page_is_written(tmp_path: Path, text: str | None, told: str) -> None:
    write(tmp_path, *nothing(), page=False)
    if text is None:
        (tmp_path / JSON).unlink()
    else:
        (tmp_path / JSON).write_text(text)
    with pytest.raises(UserError, match=told) as caught:
        write_page(tmp_path)
    assert JSON in str(caught.value)
    assert not (tmp_path / PAGE).exists()


def test_files_stay_as_they_were_where_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, *nothing(), page=False)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    def full(self: Path, *args: Any, **kwargs: Any) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", full)
        with pytest.raises(OSError, match="No space"):
            write(tmp_path, *one_fibre(), page=False)
    after = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    assert set(after) == set(before)
    assert after[JSON] == before[JSON]
