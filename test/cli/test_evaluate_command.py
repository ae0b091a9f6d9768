"""The evaluate command: options, what it prints, what it refuses."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    trial = StretchShortenStretch(0.0383, 0.1).trial("18Dec2017a", 6.1, 500.0)
    force = simulate_trial(Muscle(load_fibre("18Dec2017a", "2state")), trial).force_n
    path = tmp_path / "bags" / "one"
    write_trial(path, replace(trial, force_time_s=trial.time_s, force_n=force))
    return path


@pytest.mark.slow
def test_it_prints_tables_and_names_the_files(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["evaluate", str(bag), "--model", "2state", "3state_coop", "--processes", "0", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "| 2state      |      1 |      1 |         0.00 |" in printed
    # Without a reference trial there is one condition under this reading and none under the other.
    assert "reading 'released'" in printed
    assert "reading 'text'" not in printed
    for line in printed.splitlines():
        if line.startswith(str(out)):
            assert Path(line).stat().st_size > 0
    assert json.loads((out / "evaluate.json").read_text())["trials"]["used"] == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "there is nothing to evaluate; give bags, or --paper"),
        (["--paper"], "--paper and --empirical go together"),
        (["b", "--empirical", "e.json"], "--paper and --empirical go together"),
        (["b", "--golden", "g.json"], "--golden is compared with --paper only"),
        (["b", "--measured-only", "--model", "2state"], "--measured-only has no models"),
        (["b", "--settle", "-1"], "--settle is -1 s; allowed is above 0"),
        (["b", "--model", "3state_cop"], "model '3state_cop' is not known; did you mean '3state_coop'?"),
        (["b", "--method", "gauss"], "method 'gauss' is not known"),
        (["no/such/bag"], "bag no/such/bag does not exist"),
        (["--paper", "--empirical", "none.json"], "none.json cannot be read"),
        (["b", "--processes", "2", "--scheduler", "x:1"], "drop one of them"),
    ],
)
def test_mistakes_are_one_line_and_write_nothing(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", *arguments, "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1
    assert words in told[0]
    assert not (tmp_path / "out").exists()


def test_each_bad_bag_is_one_line(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trial = StretchShortenStretch(0.0383, 0.1).trial("18Dec2017a", 6.3, 500.0)
    for name in ("b", "c"):
        write_trial(bag.parent / name, trial)
    assert (
        main(["evaluate", str(bag.parent), "--model", "2state", "--processes", "0", "--out", str(tmp_path / "o")]) == 2
    )
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("xb_muscle: ")]
    assert len(told) == 3
    assert all("no measured force" in line for line in told[:2])
    assert told[2].startswith("xb_muscle: error: 2 of 3 bags cannot be used")
