"""Whole evaluations: files, resuming, bad input, clusters."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.request import Request
from xb_muscle_ros.evaluate.run import JOURNAL, evaluate
from xb_muscle_ros.evaluate.writing import draw_figures, write, write_tables
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options

Maker = Callable[..., Path]
HERE = Options(processes=0, quiet=True)


def request(out: Path, *bags: Path, **changes: Any) -> Request:
    given: dict[str, Any] = {"bags": tuple(map(str, bags)), "models": ("3state_coop", "2state"), "work": HERE}
    return Request(out, **{**given, **changes})


def run(made: Request) -> dict[str, Any]:
    write_tables(made.out, evaluate(made))
    found: dict[str, Any] = json.loads((made.out / "evaluate.json").read_text())
    return found


@pytest.fixture
def bags(make: Maker) -> Path:
    """Trials of one fibre: references and conditioned trials at three pCa."""
    for pca in (4.5, 6.1, 6.3):
        make(pca=pca, amplitude_l0=0.0, recovery_s=0.001)
        path = make(pca=pca, recovery_s=0.1)
    return path.parent


@pytest.mark.slow
def test_recordings_to_files(bags: Path, tmp_path: Path) -> None:
    made = request(tmp_path / "out", bags)
    write(made, evaluate(made))
    found = json.loads((tmp_path / "out" / "evaluate.json").read_text())
    assert [each["model"] for each in found["sets"]] == ["2state", "3state_coop"]
    assert "released parameter sets" in found["sets"][0]["obtained"]["18Dec2017a"]
    assert found["trials"] == {"used": 6, "fibres": ["18Dec2017a"], "left_out": [], "missing": {}}
    whole = found["force_rmsd"]["overall"]["3state_coop"]["whole"]
    assert (whole["mean"], whole["sd"], whole["trials"]) == (pytest.approx(0.02, abs=1e-9), None, 6)
    assert found["srs"]["models"]["3state_coop"]["text"]["conditions"] == {"large": 2, "small": 4, "all": 6}
    # The measurement is the model, lifted by a constant: SRS is the same.
    assert found["srs"]["models"]["3state_coop"]["text"]["rmsd"]["all"] == pytest.approx(0.0, abs=1e-9)
    names = {path.name for path in (tmp_path / "out").iterdir()}
    figures = {f"{name}.{kind}" for name in ("force_rmsd", "relative_srs") for kind in ("png", "pdf")}
    tables = {"trials.csv", "force_rmsd.csv", "relative_srs.csv", "srs_cells.csv", "evaluate.md", "evaluate.json"}
    assert names == figures | tables | {JOURNAL}


def test_conditions_that_are_not_the_papers(make: Maker, tmp_path: Path) -> None:
    """Neither the common amplitude nor a common recovery time: no empty figure, and a line that says why."""
    paths = [make(pca=pca, amplitude_l0=a, recovery_s=0.07) for pca in (4.5, 6.1) for a in (0.01, 0.03)]
    made = request(tmp_path / "out", *paths)
    results = evaluate(made)
    assert results.sections.srs is not None
    assert results.sections.srs.models["2state"].under["text"].conditions["all"] == 0
    assert "force_rmsd.png" in {path.name for path in write(made, results)}
    assert not list((tmp_path / "out").glob("relative_srs.p*"))
    assert [line for line in results.warnings if line.startswith("relative_srs.png is not drawn: no trial with 3.83")]
    assert "conditions | AIC" not in (tmp_path / "out" / "evaluate.md").read_text()


def test_tables_hold_what_the_sections_hold(bags: Path, tmp_path: Path) -> None:
    found = run(request(tmp_path / "out", bags))
    with (tmp_path / "out" / "trials.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 * 3
    measured = [r for r in rows if r["of"] == "measured" and r["amplitude_l0"] == "0.0383" and r["pca"] == "6.1"]
    reference = [r for r in rows if r["of"] == "measured" and r["amplitude_l0"] == "0.0" and r["pca"] == "6.1"]
    ratio = float(measured[0]["srs_test"]) / float(reference[0]["srs_test"])
    assert float(measured[0]["relative_srs"]) == pytest.approx(ratio)
    assert (measured[0]["rmsd_whole"], reference[0]["srs_conditioning"]) == ("", "")
    with (tmp_path / "out" / "force_rmsd.csv").open() as file:
        first = next(csv.DictReader(file))
    assert first["varied"] == "all trials"
    assert float(first["mean_f0"]) == found["force_rmsd"]["overall"][first["model"]][first["window"]]["mean"]
    text = (tmp_path / "out" / "evaluate.md").read_text()
    assert "| 3state_coop |      1 |      6 |" in text
    assert "no parameter set of its own" in text


@pytest.mark.slow
def test_processes_and_resuming_give_the_same_files(bags: Path, tmp_path: Path) -> None:
    run(request(tmp_path / "one", bags))
    run(request(tmp_path / "two", bags, work=Options(processes=2, quiet=True)))
    again = tmp_path / "three"
    again.mkdir()
    journal = (tmp_path / "one" / JOURNAL).read_text().splitlines(keepends=True)
    # As if stopped after two bags, in the middle of a line.
    (again / JOURNAL).write_text("".join(journal[:3]) + journal[3][:20])
    run(request(again, bags))
    for name in ("evaluate.json", "evaluate.md", "trials.csv", "force_rmsd.csv", "srs_cells.csv"):
        first = (tmp_path / "one" / name).read_bytes()
        assert (tmp_path / "two" / name).read_bytes() == first
        assert (again / name).read_bytes() == first


def test_bad_recordings_are_refused_and_nothing_is_written(
    bags: Path, tmp_path: Path, make: Maker, recorded: Callable[..., Trial]
) -> None:
    import dataclasses

    trial = recorded(pca=6.1, recovery_s=0.2)
    wrong_unit = make(dataclasses.replace(trial, force_n=1e3 * trial.force_n), name="x_unit")
    twice = bags / "y_twice"
    shutil.copytree(next(p for p in sorted(bags.iterdir()) if "pca61" in p.name and p != wrong_unit), twice)
    told: list[str] = []
    made = request(tmp_path / "out", bags)
    with pytest.raises(UserError, match=r"2 of 8 bags cannot be used; mend them, or leave them out with --skip-bad"):
        evaluate(made, told.append)
    assert len(told) == 2
    assert "x_unit: measured force goes to" in told[0]
    assert "y_twice" in told[1]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {JOURNAL}
    # The same work with the bad ones left out; what was done is not done again.
    told.clear()
    found = run(request(tmp_path / "out", bags, skip_bad=True))
    assert found["trials"]["used"] == 6
    assert len(found["trials"]["left_out"]) == 2
    assert "left out: " in (tmp_path / "out" / "evaluate.md").read_text()


def test_a_fibre_given_twice(make: Maker, tmp_path: Path, repo_root: Path) -> None:
    again = str(repo_root / "config" / "fibers" / "18Dec2017a.yaml")
    with pytest.raises(UserError, match="fibre 18Dec2017a is given twice"):
        evaluate(request(tmp_path / "out", make(), fibres=("18Dec2017a", again)))
    found = run(request(tmp_path / "out", make(), fibres=(again,)))
    assert list(found["sets"][0]["obtained"]) == ["18Dec2017a"]


def test_one_bad_recording_is_the_error(tmp_path: Path, make: Maker, recorded: Callable[..., Trial]) -> None:
    import dataclasses

    trial = recorded()
    path = make(dataclasses.replace(trial, length_m=1e3 * trial.length_m))
    for skip in (False, True):
        with pytest.raises(UserError, match=f"bag {path}: length differs from L0"):
            evaluate(request(tmp_path / "out", path, skip_bad=skip))


def small_table(folder: Path) -> Path:
    """Measured SRS of two fibres of the package and one other, one pCa each."""
    nothing = [[None, None], [None, None]]
    fibre = {
        "srs_test": [[[30.0, 15.0], [None, 20.0]], [[0.4, 0.3], [None, 0.5]]],
        "srs_conditioning": [[[None, 31.0], [None, 29.0]], nothing],
        "isometric_force": [[[None, 0.5], [None, 0.5]], [[None, 0.01], [None, None]]],
    }
    tree = {
        "pCa": [6.1, 9.0],
        "recovery_s": [0.001, 0.1],
        "amplitude_L0": [0.0, 0.0383],
        "fibres": {"18Dec2017a": fibre, "13Dec2017a": fibre, "unknown": fibre},
    }
    path = folder / "measured.json"
    path.write_text(json.dumps(tree))
    return path


@pytest.fixture
def small_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """The paper's grid with fewer cells; the tasks say which, so that other processes follow."""
    from xb_muscle_ros.evaluate import grid

    full = grid.tasks

    def fewer(sets: Any, **options: Any) -> list[dict[str, Any]]:
        return full(sets, [4.5, 6.1, 9.0], [0.001, 0.1], [0.0, 0.0383], **options)

    monkeypatch.setattr(grid, "tasks", fewer)
    monkeypatch.setattr(grid, "PCAS", (4.5, 6.1, 9.0))


def paper(out: Path, folder: Path, **changes: Any) -> Request:
    return request(out, empirical=small_table(folder), **changes)


@pytest.mark.slow
@pytest.mark.usefixtures("small_grid")
def test_the_papers_grid_to_files(tmp_path: Path) -> None:
    table = small_table(tmp_path)
    made = request(tmp_path / "out", empirical=table, golden=_golden(tmp_path, table))
    results = evaluate(made)
    write_tables(made.out, results)
    found = json.loads((made.out / "evaluate.json").read_text())
    drawn = {path.name for path in draw_figures(made.out, results)}
    assert [each["model"] for each in found["sets"]] == ["2state", "3state_coop"]
    # Fibres that were measured and have a file.
    assert list(found["sets"][0]["obtained"]) == ["18Dec2017a", "13Dec2017a"]
    assert found["paper"]["sources"] == ["ours", "ours, 1 fibres", "released output"]
    by = {(e["quantity"], e["model"]): e for e in found["paper"]["comparison"]}
    entry = by["srs_rmsd.all", "3state_coop"]["values"]
    # The released output given is the measurement itself, of one fibre of three alike.
    assert entry["released output"]["text"] == pytest.approx(0.0, abs=1e-12)
    assert entry["ours"]["text"] > 0.0
    assert by["k_tr", "3state_coop"]["values"]["ours"]["text"] > 1.0
    assert {row["of"] for row in found["k_tr"]} == {"2state", "3state_coop"}
    text = (tmp_path / "out" / "evaluate.md").read_text()
    assert "need the recordings of the 7 fibres" in text
    assert "no parameter set released for this model" in text
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert drawn == {"relative_srs.png", "srs_surfaces.png"}
    assert {"srs_rmsd.csv", "srs_cells.csv", "relative_srs.pdf", "srs_surfaces.pdf", *drawn} <= names


def _golden(folder: Path, table: Path) -> Path:
    tree = json.loads(table.read_text())
    tree["fibres"] = {"18Dec2017a": tree["fibres"]["18Dec2017a"]}
    path = folder / "golden.json"
    path.write_text(json.dumps({"3state_coop": tree, "2state_xb": tree, "hill_se": tree}))
    return path


@pytest.mark.usefixtures("small_grid")
def test_recordings_and_paper_together(bags: Path, tmp_path: Path) -> None:
    found = run(paper(tmp_path / "out", tmp_path, bags=(str(bags),)))
    assert found["trials"]["used"] == 6
    assert found["force_rmsd"]["overall"]
    assert found["paper"]["recordings"] is True
    assert found["srs_of_recordings"]["models"]["2state"]["fibres"] == ["18Dec2017a"]
    assert found["srs"]["models"]["2state"]["fibres"] == ["18Dec2017a", "13Dec2017a"]
    assert "need the recordings" not in (tmp_path / "out" / "evaluate.md").read_text()


def test_a_bad_table_leaves_nothing_behind(tmp_path: Path) -> None:
    path = small_table(tmp_path)
    tree = json.loads(path.read_text())
    tree["fibres"]["18Dec2017a"]["srs_test"].pop()
    path.write_text(json.dumps(tree))
    with pytest.raises(UserError, match="srs_test holds 1 values; needed are 2, one for each pCa"):
        evaluate(request(tmp_path / "out", empirical=path))
    assert not (tmp_path / "out").exists()


def test_measured_fibres_without_a_file(tmp_path: Path) -> None:
    path = small_table(tmp_path)
    tree = json.loads(path.read_text())
    tree["fibres"] = {"unknown": tree["fibres"]["unknown"]}
    path.write_text(json.dumps(tree))
    with pytest.raises(UserError, match="no fibre file for any of the measured fibres unknown; give fibre files"):
        evaluate(request(tmp_path / "out", empirical=path))


@pytest.mark.slow
@pytest.mark.usefixtures("small_grid")
def test_a_cluster_gives_the_same_and_survives_a_killed_worker(bags: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    run(paper(tmp_path / "local", tmp_path, bags=(str(bags),)))
    total = _records(tmp_path / "local")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        work = Options(scheduler=cluster.scheduler_address, quiet=True)
        made = paper(tmp_path / "cluster", tmp_path, bags=(str(bags),), work=work)
        killed = _kill_a_worker_at(cluster, made.out, 2)
        run(made)
        killed.join(30.0)
    assert 2 <= killed.done < total
    for name in ("evaluate.json", "evaluate.md", "trials.csv", "srs_rmsd.csv", "relative_srs.csv"):
        assert (tmp_path / "cluster" / name).read_bytes() == (tmp_path / "local" / name).read_bytes()


def _records(out: Path) -> int:
    path = out / JOURNAL
    return len(path.read_bytes().splitlines()) - 1 if path.exists() else 0


class _Killer(threading.Thread):
    """Kills a worker once so many results are in; `done` tells how many there were."""

    def __init__(self, pid: int, out: Path, count: int) -> None:
        super().__init__(daemon=True)
        self._pid, self._out, self._count = pid, out, count
        self.done = -1

    def run(self) -> None:
        while _records(self._out) < self._count:
            time.sleep(0.005)
        os.kill(self._pid, signal.SIGKILL)
        self.done = _records(self._out)


def _kill_a_worker_at(cluster: Any, out: Path, count: int) -> _Killer:
    pid = next(iter(cluster.workers.values())).process.process.pid
    killer = _Killer(pid, out, count)
    killer.start()
    return killer


def mine(make: Maker, count: int) -> Path:
    """Bags of a fibre that no file is known of."""
    for k in range(count):
        trial = StretchShortenStretch(0.0383, 0.1).trial("mine", 6.1 + 0.1 * k, 500.0)
        force = simulate_trial(Muscle(load_fibre("18Dec2017a", "2state")), trial).force_n
        path = make(replace(trial, force_time_s=trial.time_s, force_n=force + 0.01))
    return path.parent


def test_a_fibre_nobody_knows_is_one_line_however_many_bags(make: Maker, tmp_path: Path) -> None:
    folder = mine(make, 3)
    with pytest.raises(UserError, match=r"^3 bags, from .* to .*: fibre 'mine' is not known.* --fiber$"):
        evaluate(request(tmp_path / "out", folder))


def test_the_one_file_given_serves_a_fibre_nobody_knows(make: Maker, tmp_path: Path) -> None:
    folder = mine(make, 2)
    results = evaluate(request(tmp_path / "out", folder, fibres=("18Dec2017a",), models=("2state",)))
    assert results.sections.force_rmsd is not None
    whole = results.sections.force_rmsd.overall["2state"]["whole"]
    assert whole is not None
    assert whole.mean == pytest.approx(0.01, abs=1e-6)
    assert results.trials is not None
    assert results.trials.fibres == ["mine"]
    served = [line for line in results.warnings if "mine" in line and not line.startswith("force-pCa curve")]
    assert served == ["trials of fibre mine are compared with parameters of 18Dec2017a, the one file given"]


@pytest.mark.slow
def test_a_mechanism_at_its_null_is_said(make: Maker, tmp_path: Path) -> None:
    make()
    results = evaluate(request(tmp_path / "out", tmp_path / "bags", models=("3state_coop+viscous_drag",)))
    (line,) = [line for line in results.warnings if "drag" in line]
    assert line == (
        "model 3state_coop+viscous_drag, fibre 18Dec2017a: viscous_drag is at its null value, its effect is exactly "
        "zero; fit it first"
    )
