"""Files of a diagnosis: in the place of an older one's, and nothing half written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from made_trials import PROTOCOL, given_fibre
from sample_diagnoses import one_fibre

from xb_muscle_ros.diagnose.outputs import NEXT, Files, augmented_name, older_results, write
from xb_muscle_ros.diagnose.report import output
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
    assert output.read(out) == SAMPLE.diagnosis
    assert load_fibre(out / "augmented.yaml").values == given_fibre().values
    assert not read_trial(out / NEXT).force_n.size


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


@pytest.mark.parametrize("what", ["write_traces", "write_text"])
def test_a_record_appears_last_and_whole(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any) -> None:
        raise UserError("disk full")

    monkeypatch.setattr(output, what, fails)
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
