"""Bags of every kind through every command that reads them: the numbers of the own, whole bag, or one line and 2."""

from __future__ import annotations

import csv
import functools
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import foreign_bags as foreign
import numpy as np
import pytest
import yaml

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.diagnose.report.traces import read_traces
from xb_muscle_ros.models.fibre_file import changed, find_fibre_file, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.made import made
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

L0_M, F0_N = 0.0012, 0.0005
KINDS = ("no_phases", "no_facts", "several_fibres", "split", "truncated", "shuffled")
Right = Callable[[str], dict[str, float]]
COMMANDS = ("replay", "evaluate", "fit", "diagnose")


@pytest.fixture(scope="module")
def fibre(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fibre of 1.2 mm and 0.5 mN with one parameter set."""
    tree = yaml.safe_load(find_fibre_file("18Dec2017a").read_text(encoding="utf-8"))
    inner = tree["/**"]["ros__parameters"]
    inner["constants"] = {"reference_length_m": L0_M, "f0_n": F0_N}
    inner["models"] = {"3state_coop": {**inner["models"]["3state_coop"], "smoothing": 0.0}}
    inner.pop("sources", None)
    path = tmp_path_factory.mktemp("fibre") / "mine.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def trials(fibre: Path) -> list[Trial]:
    """Two conditioned trials and a reference, of a fibre that attaches 15 % faster than the file says."""
    given = load_fibre(fibre)
    muscle = Muscle(changed(given, {"f": 1.15 * given.values["f"]}, "test"))
    random, found = np.random.default_rng(5), []
    for amplitude, pca in ((0.0383, 6.1), (0.0, 6.1), (0.0383, 4.5)):
        protocol = StretchShortenStretch(amplitude, 0.1, lead_s=0.15, hold_s=0.2)
        trial = protocol.trial("18Dec2017a", pca, 500.0)
        facts = replace(trial.facts, reference_length_m=L0_M, f0_n=F0_N, recovery_s=0.1 if amplitude else None)
        trial = replace(trial, facts=facts, length_m=L0_M * trial.length_m)
        found.append(made(muscle, trial, random, 7e-4))
    return found


def own(folder: Path, trial: Trial) -> None:
    write_trial(folder / trial.facts.trial, trial)


def no_phases(folder: Path, trial: Trial) -> None:
    facts = foreign.facts_of(trial, ("phases", "amplitude_l0", "recovery_s"))
    foreign.write_folder(folder / trial.facts.trial, [foreign.messages(trial)], facts)


def no_facts(folder: Path, trial: Trial) -> None:
    foreign.write_folder(folder / trial.facts.trial, [foreign.messages(trial)], None)


def several_fibres(folder: Path, trial: Trial) -> None:
    logged = foreign.messages(trial, {"soleus": 1.3, "gastrocnemius": 0.8})
    foreign.write_folder(folder / trial.facts.trial, [logged], None)


def split(folder: Path, trial: Trial) -> None:
    logged = foreign.messages(trial)
    third = len(logged) // 3
    parts = [logged[:third], logged[third : 2 * third], logged[2 * third :]]
    foreign.write_folder(folder / trial.facts.trial, parts, None, listed=())


def truncated(folder: Path, trial: Trial) -> None:
    """The last chunk is gone, which is part of the hold."""
    own(folder, trial)
    (file,) = (folder / trial.facts.trial).glob("*.mcap")
    data = file.read_bytes()
    last = data.rindex(foreign.messages(trial)[-60].data)
    file.write_bytes(data[:last])


def shuffled(folder: Path, trial: Trial) -> None:
    logged = foreign.messages(trial)
    order = np.random.default_rng(2).permutation(len(logged)).tolist()
    half = len(logged) // 2
    parts = [[logged[i] for i in order[:half]], [logged[i] for i in order[half:]]]
    foreign.write_folder(folder / trial.facts.trial, parts, foreign.facts_of(trial), listed=(1, 0))


@pytest.fixture(scope="module")
def bags(trials: list[Trial], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A folder of bags of each kind."""
    made_bags = {}
    for write in (own, no_phases, no_facts, several_fibres, split, truncated, shuffled):
        folder = tmp_path_factory.mktemp(write.__name__)
        for trial in trials:
            write(folder, trial)
        made_bags[write.__name__] = folder
    return made_bags


def replay(bag: Path, fibre: Path, out: Path) -> dict[str, float]:
    assert main(["replay", str(bag), "--fiber", str(fibre), "--out", str(out)]) == 0
    found = {}
    for i, row in enumerate(json.loads((out / "replay.json").read_text())["trials"]):
        values = {**row, **{f"rmsd_{name}": value for name, value in row["rmsd_f0"].items()}}
        found |= {f"{i} {key}": value for key, value in values.items() if isinstance(value, float)}
    return found


def evaluate(bag: Path, fibre: Path, out: Path) -> dict[str, float]:
    given = ["--model", "3state_coop", "--processes", "0", "--out", str(out)]
    assert main(["evaluate", str(bag), "--fiber", str(fibre), *given]) == 0
    found = json.loads((out / "evaluate.json").read_text())
    windows = found["force_rmsd"]["overall"]["3state_coop"]
    with (out / "srs_cells.csv").open(newline="") as file:
        cells = [row for row in csv.DictReader(file) if row["srs_test"]]
    shown = {f"rmsd {name}": window["mean"] for name, window in windows.items()} | {"used": found["trials"]["used"]}
    for row in cells:
        cell = " ".join(row[key] for key in ("of", "pca", "amplitude_l0", "recovery_s"))
        shown |= {f"{cell} {key}": float(row[key]) for key in ("srs_test", "relative_srs") if row[key]}
    return shown


def fit(bag: Path, fibre: Path, out: Path) -> dict[str, float]:
    given = ["--free", "f", "--starts", "1", "--no-intervals", "--processes", "0", "--no-anchor"]
    assert main(["fit", str(bag), "--fiber", str(fibre), "--out", str(out / "x.yaml"), *given]) == 0
    found = json.loads((out / "x" / "fit.json").read_text())
    return {"f": found["parameters"][0]["value"], "rmsd": found["train_rmsd_f0"]}


def diagnose(bag: Path, fibre: Path, out: Path) -> dict[str, float]:
    """One trial alone: more take longer, and are read in no other way."""
    given = ["--quick", "--processes", "0"]
    first = next(
        path for path in sorted(bag.iterdir()) if path.name.startswith("amp383") and path.name.endswith("pca61")
    )
    assert main(["diagnose", str(first), "--fiber", str(fibre), "--out", str(out), *given]) == 0
    found = json.loads((out / "diagnosis.json").read_text())
    assert found["verdict"] in ("none", "parameters")
    (trial,) = found["trials"]
    (traces,) = read_traces(out / "traces.npz")
    start = float(np.sqrt(np.mean((traces.start_f0 - traces.measured_f0) ** 2)))
    starts = {name: start_s for name, start_s, _ in trial["phases"]}
    return {"start": start, "noise": trial["noise_sd_f0"], **starts}


RUN: dict[str, Callable[[Path, Path, Path], dict[str, float]]] = {
    "replay": replay, "evaluate": evaluate, "fit": fit, "diagnose": diagnose,
}  # fmt: skip
# What the reading of each kind says, once for a run.
SAID = {
    "no_phases": ["phases found from length ({n} trial", "amplitude and recovery found from length ({n} trial"],
    "no_facts": [
        "phases found from length ({n} trial",
        "facts missing in the bag, taken: L0 = 0.0012 m (of fibre file mine.yaml), F0 = 0.0005 N (of fibre file mine",
        "pCa taken from constant calcium ({n} trial",
    ],
    "several_fibres": ["of several fibres; taken: '18Dec2017a', left out: 'soleus', 'gastrocnemius'"],
    "split": ["metadata.yaml is missing"],
    "truncated": ["is cut short after"],
    "shuffled": [],
}


@pytest.fixture(scope="module")
def right(bags: dict[str, Path], fibre: Path, tmp_path_factory: pytest.TempPathFactory) -> Right:
    """Gives what a command says of the own, whole bags."""
    return functools.cache(lambda command: RUN[command](bags["own"], fibre, tmp_path_factory.mktemp(command)))


@pytest.mark.slow
def test_the_own_bags_tell_what_was_made(right: Right) -> None:
    assert right("fit")["f"] == pytest.approx(1.15 * 79.0, rel=5e-3)
    assert right("fit")["rmsd"] == pytest.approx(7e-4, rel=0.2)
    assert 0.7 < right("replay")["2 measured_relative_srs"] < 1.0
    assert right("evaluate")["used"] == 3
    assert right("diagnose")["noise"] == pytest.approx(7e-4, rel=0.5)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_of_any_kind_gives_the_numbers_of_the_own_one(
    kind: str,
    command: str,
    bags: dict[str, Path],
    fibre: Path,
    right: Right,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    expected = right(command)
    capsys.readouterr()
    found = RUN[command](bags[kind], fibre, tmp_path)
    captured = capsys.readouterr()
    # A diagnosis has it among its own lines, wrapped.
    said = " ".join(f"{captured.out} {captured.err}".split()) if command == "diagnose" else captured.err
    # Phases that were found are good to about a sample, 2 ms; a pause of none is told as one of another length.
    skipped = {"2 recovery_s", "1 recovery_s", "0 recovery_s"}
    assert set(found) - skipped >= set(expected) - skipped
    for name in set(expected) - skipped:
        within = 0.0025 if command == "diagnose" and name not in ("start", "noise") else 2e-4
        # A standard error comes of the few residuals about a line, which a sample more or less changes.
        part = 0.2 if name.endswith("_se") else 0.03
        assert found[name] == pytest.approx(expected[name], rel=part, abs=within), name
    n = 1 if command == "diagnose" else 3
    for line in SAID[kind]:
        assert line.format(n=n) in said
    assert "Traceback" not in said


@pytest.mark.parametrize("command", COMMANDS)
def test_lengths_far_from_l0_are_one_line_in_every_command(
    command: str, bags: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The fibre file knows of no L0 either: 1.2 mm would be 0.0012 L0."""
    bag = next(iter(sorted(bags["no_facts"].iterdir())))
    out = tmp_path / ("x.yaml" if command == "fit" else "out")
    capsys.readouterr()
    given = ["--fiber", "18Dec2017a", "--out", str(out)] + (["--processes", "0"] if command != "replay" else [])
    assert main([command, str(bag), *given]) == 2
    (said,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("xb_muscle: ")]
    assert "length differs from L0 by -0.999 L0; allowed is -0.9 to 1" in said
    assert "--reference-length gives another" in said
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and "journal" not in path.name]


@pytest.mark.slow
def test_l0_and_f0_of_the_command_line_are_as_good_as_those_of_a_bag(
    bags: dict[str, Path], fibre: Path, right: Right, tmp_path: Path
) -> None:
    """With a normalised fibre file the user tells what the bags lack."""
    text = fibre.read_text().replace(f"reference_length_m: {L0_M}", "reference_length_m: 1.0")
    (tmp_path / "plain.yaml").write_text(text.replace(f"f0_n: {F0_N}", "f0_n: 1.0"))
    given = ["--fiber", str(tmp_path / "plain.yaml"), "--reference-length", "1.2 mm", "--f0", "0.5 mN"]
    assert main(["replay", str(bags["no_facts"]), *given, "--out", str(tmp_path / "out")]) == 0
    rows = json.loads((tmp_path / "out" / "replay.json").read_text())["trials"]
    for i, row in enumerate(rows):
        assert row["rmsd_f0"]["whole"] == pytest.approx(right("replay")[f"{i} rmsd_whole"], rel=0.01)


@pytest.mark.slow
def test_evaluate_takes_every_fibre_that_has_a_file(
    bags: dict[str, Path], fibre: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "soleus.yaml"
    other.write_text(fibre.read_text().replace("fibre: 18Dec2017a", "fibre: soleus"))
    given = ["--fiber", str(fibre), str(other), "--model", "3state_coop", "--processes", "0"]
    assert main(["evaluate", str(bags["several_fibres"]), *given, "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "evaluate.json").read_text())
    assert found["trials"]["fibres"] == ["18Dec2017a", "soleus"]
    assert found["trials"]["used"] == 6
    assert "left out: 'gastrocnemius'" in capsys.readouterr().err
