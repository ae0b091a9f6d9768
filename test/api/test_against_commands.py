"""The public functions give the numbers of the commands, and their errors."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.cli.main import main
from xb_muscle_ros.diagnose.report.codec import to_json

FIBRE = "18Dec2017a"
EXACT = {"smoothing": 0.0}
EXACTLY = ["--set", "smoothing=0"]


def read(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


def as_written(found: object) -> Any:
    """What JSON makes of it."""
    return json.loads(json.dumps(found))


def test_simulate(made: xb.SimulationResult, tmp_path: Path) -> None:
    given = ["--pca", "4.5", "6.1", "--recovery", "0.1", "--as-measured", "--out", str(tmp_path)]
    assert main(["simulate", "--fiber", FIBRE, *EXACTLY, "--set", "f=95", "--set", "k21=20", *given]) == 0
    theirs = xb.read_trials(tmp_path, FIBRE)
    assert [t.facts for t in theirs] == [t.facts for t in made.trials]
    for ours, read_back in zip(made.trials, theirs, strict=True):
        for name in ("time_s", "length_m", "calcium_um", "force_time_s", "force_n"):
            assert np.array_equal(getattr(ours, name), getattr(read_back, name)), name


@pytest.mark.slow
def test_replay(made: xb.SimulationResult, bags: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "cli"
    assert main(["replay", str(bags), "--fiber", FIBRE, "--model", "2state", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    found = xb.replay(bags, FIBRE, model="2state")
    assert not capsys.readouterr().out
    assert as_written(found.rows) == read(out / "replay.json")["trials"]
    assert found.table in printed
    in_memory = xb.replay(made, FIBRE, model="2state")
    assert in_memory.rows == found.rows
    saved = found.save(tmp_path / "api")
    assert [path.name for path in saved] == ["replay.json", "replay.png"]
    assert read(saved[0]) == read(out / "replay.json")


@pytest.mark.slow
def test_fit(made: xb.SimulationResult, bags: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["--free", "f", "k21", "--hold-out", "pca=6.1", "--bound", "f=50:200", "--prior", "k21=20:0.5"]
    work = ["--starts", "1", "--no-intervals", "--no-anchor", "--processes", "0"]
    out = tmp_path / "mine.yaml"
    assert main(["fit", str(bags), "--fiber", FIBRE, *EXACTLY, *given, *work, "--out", str(out)]) == 0
    theirs = read(tmp_path / "mine" / "fit.json")
    capsys.readouterr()
    options: dict[str, Any] = {
        "set": EXACT, "free": ["f", "k21"], "hold_out": ["pca=6.1"], "bound": {"f": (50.0, 200.0)},
        "prior": {"k21": (20.0, 0.5)}, "starts": 1, "intervals": False, "anchor": False, "processes": 0,
    }  # fmt: skip
    found = xb.fit(bags, FIBRE, **options)
    said = capsys.readouterr()
    assert not (said.out + said.err)
    (ours,) = (read(path) for path in found.save(tmp_path / "api" / "mine.yaml") if path.name == "fit.json")
    assert ours == theirs
    assert found.fibre.values == xb.load_fibre(out).values
    assert (tmp_path / "api" / "mine.yaml").read_text() == out.read_text()
    in_memory = xb.fit(made, FIBRE, **options)
    assert in_memory.values == found.values
    assert found.values["f"] == pytest.approx(95.0, rel=0.02)


@pytest.mark.slow
def test_evaluate(made: xb.SimulationResult, bags: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    models = ["2state", "3state_coop"]
    given = ["evaluate", str(bags), "--model", *models, "--processes", "0", "--out", str(tmp_path / "cli")]
    assert main(given) == 0
    printed = capsys.readouterr().out
    found = xb.evaluate(bags, model=models, processes=0)
    assert not capsys.readouterr().out
    assert as_written(found.found) == read(tmp_path / "cli" / "evaluate.json")
    assert str(found) in printed
    in_memory = xb.evaluate(made, fibre=xb.load_fibre(FIBRE), model="3state_coop", processes=0)
    overall = [each.found["force_rmsd"]["overall"]["3state_coop"] for each in (found, in_memory)]
    assert overall[0] == overall[1]


@pytest.mark.slow
def test_diagnose(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = xb.simulate(
        FIBRE, model="3state_coop", set=EXACT, pca=[4.5, 6.1], amplitude=[0.0, 0.0383], recovery=0.1, as_measured=True
    )
    bags = made.save(tmp_path / "bags")
    out = tmp_path / "cli"
    given = [*map(str, bags), "--fiber", FIBRE, "--model", "2state", "--quick", "--nuisance", "time_shift=0.001"]
    assert main(["diagnose", *given, "--out", str(out), "--processes", "0"]) == 0
    printed = capsys.readouterr().out
    found = xb.diagnose(made, FIBRE, model="2state", quick=True, nuisance={"time_shift": 0.001}, processes=0)
    assert not capsys.readouterr().out
    theirs = read(out / "diagnosis.json")
    ours = as_written(to_json(found.diagnosis))
    assert {**ours, "seconds": 0} == {key: 0 if key == "seconds" else theirs[key] for key in ours}
    assert str(found) in printed
    assert (found.headline, found.verdict, found.answer) == (
        theirs["headline"], theirs["verdict"], tuple(theirs["answer"]),
    )  # fmt: skip
    saved = found.save(tmp_path / "api")
    assert {path.name for path in (tmp_path / "api").iterdir()} | {"journal.jsonl"} == {p.name for p in out.iterdir()}
    for name, fibre in found.augmented.items():
        assert xb.load_fibre(tmp_path / "api" / name).values == fibre.values
        assert tmp_path / "api" / name in saved
    assert "Inclusion probability" in {axis.get_xlabel() for axis in found.plot("probabilities").axes}
    assert set(found.to_dataframe()["name"]) == {row["name"] for row in theirs["components"]}


@pytest.mark.parametrize(
    ("command", "call"),
    [
        (["simulate", "--fiber", "nobody"], lambda bags: xb.simulate("nobody")),
        (["simulate", "--fiber", FIBRE, "--pca", "2"], lambda bags: xb.simulate(FIBRE, pca=2)),
        (["simulate", "--fiber", FIBRE, "--amplitude", "3.8"], lambda bags: xb.simulate(FIBRE, amplitude=3.8)),
        (["simulate", "--fiber", FIBRE, "--set", "g=1"], lambda bags: xb.simulate(FIBRE, set={"g": 1.0})),
        (["replay", "{bags}", "--fiber", FIBRE, "--substeps", "0"], lambda bags: xb.replay(bags, FIBRE, substeps=0)),
        (["replay", "{bags}", "--fiber", FIBRE, "--f0", "3 mm"], lambda bags: xb.replay(bags, FIBRE, f0="3 mm")),
        (["replay", "nowhere", "--fiber", FIBRE], lambda bags: xb.replay("nowhere", FIBRE)),
        (
            ["replay", "{bags}", "--fiber", FIBRE, "--live", "--set", "f=1"],
            lambda bags: xb.replay(bags, FIBRE, live=True, set={"f": 1.0}),
        ),
        (["fit", "{bags}", "--fiber", FIBRE, "--free", "vmax"], lambda bags: xb.fit(bags, FIBRE, free=["vmax"])),
        (["fit", "--fiber", FIBRE], lambda bags: xb.fit([], FIBRE)),
        (["fit", "{bags}", "--fiber", FIBRE, "--level", "2"], lambda bags: xb.fit(bags, FIBRE, level=2.0)),
        (["evaluate"], lambda bags: xb.evaluate()),
        (["evaluate", "{bags}", "--method", "x"], lambda bags: xb.evaluate(bags, method="x")),
        (["diagnose", "{bags}", "--fiber", FIBRE, FIBRE], lambda bags: xb.diagnose(bags, [FIBRE, FIBRE])),
        (
            ["diagnose", "{bags}", "--fiber", FIBRE, "--nuisance", "drag=1"],
            lambda bags: xb.diagnose(bags, FIBRE, nuisance={"drag": 1.0}),
        ),
    ],
)
def test_errors_are_those_of_the_commands(
    command: list[str],
    call: Callable[[Path], object],
    bags: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / ("out.yaml" if command[0] == "fit" else "out")
    assert main([part.format(bags=bags) for part in [*command, "--out", str(out)]]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    with pytest.raises(xb.UserError) as raised:
        call(bags)
    assert line == f"xb_muscle: error: {raised.value}"
