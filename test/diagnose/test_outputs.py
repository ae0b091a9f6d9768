"""Files of a diagnosis: in the place of an older one's, and nothing half written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from made_trials import PROTOCOL, given_fibre
from sample_diagnoses import nothing, one_fibre

from xb_muscle_ros.diagnose import outputs
from xb_muscle_ros.diagnose.outputs import JSON, NEXT, PAGE, TRACES, Files, augmented_name, older_results, read, write
from xb_muscle_ros.diagnose.report.html import as_html
from xb_muscle_ros.diagnose.report.prose import headline, summary
from xb_muscle_ros.diagnose.report.traces import read_traces
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.trials.bags import read_trial

SAMPLE = one_fibre()


def files(*names: str, protocol: bool = True) -> Files:
    trial = PROTOCOL.trial("18Dec2017a", 6.1) if protocol else None
    return Files({name: given_fibre() for name in names}, SAMPLE.traces, trial)


def inside(out: Path) -> set[str]:
    return {path.name for path in out.iterdir()}


def test_everything_is_written_and_can_be_read(tmp_path: Path) -> None:
    out = tmp_path / "out"
    write(out, SAMPLE.diagnosis, files("augmented.yaml"), report=False)
    assert inside(out) == {"diagnosis.json", "augmented.yaml", "traces.npz", NEXT}
    assert read(out) == SAMPLE.diagnosis
    assert load_fibre(out / "augmented.yaml").values == given_fibre().values
    assert not read_trial(out / NEXT).force_n.size


@pytest.mark.slow
def test_the_page_is_that_of_record_and_traces(tmp_path: Path) -> None:
    d, traces = nothing()
    write(tmp_path, d, Files({}, traces, None))
    assert inside(tmp_path) == {JSON, PAGE, TRACES}
    assert [t.trial for t in read_traces(tmp_path / TRACES)] == [t.trial for t in traces]
    assert (tmp_path / PAGE).read_text(encoding="utf-8") == as_html(read(tmp_path), read_traces(tmp_path / TRACES))


def test_the_json_has_its_words_beside_its_fields(tmp_path: Path) -> None:
    d = SAMPLE.diagnosis
    write(tmp_path, d, files(protocol=False), report=False)
    row = json.loads((tmp_path / JSON).read_text(encoding="utf-8"))
    assert row["headline"] == headline(d)
    assert row["summary"] == " ".join(summary(d))
    assert row["glossary"]["inclusion_probability"].startswith("Probability that a component")
    assert row["format_version"] == 3
    assert row["components"][0]["inclusion_probability"] == 0.998


@pytest.mark.parametrize(
    ("text", "told"),
    [(None, "cannot be read"), ("{", "cannot be read"), ('{"version": 1}', "older version"), ("[]", "holds a list")],
)  # fmt: skip
def test_damage_is_named(tmp_path: Path, text: str | None, told: str) -> None:
    if text is not None:
        (tmp_path / JSON).write_text(text)
    with pytest.raises(UserError, match=told) as caught:
        read(tmp_path)
    assert JSON in str(caught.value)


def test_files_stay_as_they_were_where_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, SAMPLE.diagnosis, files(protocol=False), report=False)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    def full(self: Path, *args: Any, **kwargs: Any) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", full)
        with pytest.raises((OSError, UserError), match="No space"):
            write(tmp_path, replace(SAMPLE.diagnosis, seed=7), files(protocol=False), report=False)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_what_an_older_diagnosis_had_is_gone_and_what_is_not_its_own_stays(tmp_path: Path) -> None:
    write(tmp_path, SAMPLE.diagnosis, files("augmented_a.yaml", "augmented_b.yaml"), report=False)
    for name in ("mine.yaml", "journal.jsonl", "augmented.txt"):
        (tmp_path / name).write_text("mine")
    (tmp_path / "report.html").write_text("older")
    older = {path.name for path in older_results(tmp_path)}
    assert older == {"diagnosis.json", "augmented_a.yaml", "augmented_b.yaml", "traces.npz", "report.html", NEXT}
    write(tmp_path, replace(SAMPLE.diagnosis, seed=7), files(protocol=False), report=False)
    assert inside(tmp_path) == {"diagnosis.json", "traces.npz", "mine.yaml", "journal.jsonl", "augmented.txt"}
    assert json.loads((tmp_path / "diagnosis.json").read_text())["seed"] == 7


@pytest.mark.parametrize("what", ["write_traces", "write_json"])
def test_a_record_appears_last_and_whole(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any) -> None:
        raise UserError("disk full")

    monkeypatch.setattr(outputs, what, fails)
    with pytest.raises(UserError, match="disk full"):
        write(tmp_path, SAMPLE.diagnosis, files("augmented.yaml"), report=False)
    assert "diagnosis.json" not in inside(tmp_path)
    assert not [path for path in tmp_path.rglob("*") if "tmp" in path.name]


@pytest.mark.parametrize(
    ("fibre", "several", "name"),
    [("a", False, "augmented.yaml"), ("a", True, "augmented_a.yaml"), ("a/../b c", True, "augmented_a_.._b_c.yaml")],
)
def test_a_fibre_s_name_leads_out_of_no_folder(fibre: str, several: bool, name: str) -> None:
    assert augmented_name(fibre, several) == name
