"""From bags to files: a study of two fibres as a user runs it, and what is refused in one line."""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from made_trials import FIBRE, given_fibre, trials_of, truth

from xb_muscle_ros.api.diagnosing import diagnose
from xb_muscle_ros.cli.main import main
from xb_muscle_ros.diagnose.outputs import read
from xb_muscle_ros.diagnose.report.traces import read_traces
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.trial import Trial

# What its tests share takes long to make.
pytestmark = pytest.mark.slow

OTHER = "14Dec2017b"
PCAS = (4.5, 6.0, 6.2, 9.0)
DRAG = 0.04


def write(folder: Path, trials: list[Trial]) -> Path:
    for trial in trials:
        write_trial(folder / f"{trial.facts.fibre}_{trial.facts.trial}", trial)
    return folder


def with_drag(name: str) -> Fibre:
    given = given_fibre("3state_coop", name)
    if name == FIBRE:
        return truth("3state_coop+viscous_drag", drag=DRAG)
    changes = {"smoothing": 0.0, "drag": DRAG, "f": 1.1 * given.values["f"]}
    return changed(load_fibre(name, "3state_coop+viscous_drag"), changes, "test")


class Ran(NamedTuple):
    """A run of the command, and what it said."""

    folder: Path
    out: Path
    said: str


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    folder = tmp_path_factory.mktemp("two")
    for seed, name in enumerate((FIBRE, OTHER)):
        write(folder / "bags", trials_of(with_drag(name), PCAS, seed))
    said = io.StringIO()
    given = ["diagnose", str(folder / "bags"), "--fiber", FIBRE, OTHER, "--model", "3state_coop", "--quick"]
    with contextlib.redirect_stdout(said):
        assert main([*given, "--processes", "0", "--out", str(folder / "out")]) == 0
    return Ran(folder, folder / "out", said.getvalue())


def test_two_fibres_have_one_answer_and_each_its_own(ran: Ran) -> None:
    found = read(ran.out)
    assert found.fibres == (FIBRE, OTHER)
    assert found.verdict.value in ("physics", "ambiguous")
    assert found.answer == ("viscous_drag",)
    component = next(c for c in found.components if c.name == "viscous_drag")
    assert component is not None
    (drag,) = component.parameters
    assert drag.interval[0] < DRAG < drag.interval[1]
    assert drag.spread is not None
    assert drag.spread < 0.03
    assert [row.fibre for row in component.by_fibre] == [FIBRE, OTHER]
    # Two fibres that say the same are surer than either.
    assert component.inclusion_probability >= max(row.inclusion_probability for row in component.by_fibre)
    for row in component.by_fibre:
        (own,) = row.parameters
        assert own.value == pytest.approx(DRAG, rel=0.25)
        assert row.heldout_gain is not None
        assert row.heldout_gain.conditions == len(PCAS)
    assert component.heldout_gain is not None
    assert component.heldout_gain.conditions == 2 * len(PCAS)


def test_a_fibre_that_was_left_out_is_predicted_by_the_other_s_effect(ran: Ran) -> None:
    for row in read(ran.out).by_fibre:
        assert row.trials == len(PCAS)
        assert row.left_out_rmsd_f0 is not None
        base, answer = row.left_out_rmsd_f0
        assert base == pytest.approx(row.before.train_rmsd_f0, rel=1e-6)
        assert answer < 0.5 * base


def test_files_are_there_and_belong_together(ran: Ran) -> None:
    tree = json.loads((ran.out / "diagnosis.json").read_text())
    found = read(ran.out)
    names = {path.name for path in ran.out.iterdir()}
    augmented = {f"augmented_{name}.yaml" for name in (FIBRE, OTHER)}
    assert augmented | {"diagnosis.json", "traces.npz", "report.html", "journal.jsonl"} <= names
    assert set(tree["augmented"].values()) == augmented
    for name, file in found.augmented.items():
        fibre = load_fibre(ran.out / file)
        assert (fibre.name, fibre.model) == (name, "3state_coop+viscous_drag")
    traces = read_traces(ran.out / "traces.npz")
    assert [(t.fibre, t.trial) for t in traces] == [(t.fibre, t.trial) for t in found.trials]
    assert len(traces) == 2 * len(PCAS)
    assert "viscous drag" in (ran.out / "report.html").read_text(encoding="utf-8")
    assert "viscous drag" in ran.said
    assert str(ran.out / f"augmented_{OTHER}.yaml") in ran.said


def test_a_second_run_takes_what_the_first_one_kept(ran: Ran) -> None:
    found = read(ran.out)
    journal = (ran.out / "journal.jsonl").stat().st_size
    again = diagnose(
        [ran.folder / "bags"], [FIBRE, OTHER], model="3state_coop", quick=True, processes=0,
        journal=ran.out / "journal.jsonl", tell=lambda _: None,
    )  # fmt: skip
    assert replace(again.diagnosis, seconds=0.0) == replace(found, seconds=0.0)
    assert (ran.out / "journal.jsonl").stat().st_size == journal


@pytest.fixture(scope="module")
def one_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("one"), trials_of(truth(), (6.0,)))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--fiber", "nobody"], "nobody"),
        (["--fiber", FIBRE, OTHER], f"no bag is of fibre '{OTHER}'"),
        (["--fiber", FIBRE, FIBRE], f"fibre '{FIBRE}' is given 2 times"),
        (["--fiber", OTHER, "19Dec2017a"], "no bag is of fibres"),
    ],
)
def test_what_does_not_belong_together_is_one_line(
    given: list[str], said: str, one_bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["diagnose", str(one_bag), *given, "--out", str(out), "--processes", "0"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert said in error
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.parametrize(
    ("force", "said"), [(np.empty(0), "has no measured force"), (None, r"force is 0 N in all .* samples; check")]
)
def test_forces_that_are_none_are_refused(force: Any, said: str, tmp_path: Path) -> None:
    (trial,) = trials_of(truth(), (6.0,))
    silent = replace(trial, force_n=np.zeros_like(trial.force_n))
    if force is not None:
        silent = replace(trial, force_time_s=force, force_n=force)
    write_trial(tmp_path / "bags" / "silent", silent)
    with pytest.raises(UserError, match=said):
        diagnose([tmp_path / "bags"], FIBRE)


def test_an_older_result_is_not_written_over_unasked(ran: Ran, capsys: pytest.CaptureFixture[str]) -> None:
    stamps = {path: path.stat().st_mtime_ns for path in ran.out.rglob("*")}
    capsys.readouterr()
    assert main(["diagnose", str(ran.folder / "bags"), "--fiber", FIBRE, "--out", str(ran.out)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert stamps == {path: path.stat().st_mtime_ns for path in ran.out.rglob("*")}
