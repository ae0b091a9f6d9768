"""Results of an older run: refused in one line, replaced with --overwrite, nothing stale left, nothing foreign gone."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.diagnose.outputs import NEXT, older_results
from xb_muscle_ros.trials.bags import read_trial, write_trial

FIBRE = ["--fiber", "18Dec2017a"]


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bags")
    given = ["--pca", "4.5", "6.1", "--recovery", "0.05", "--as-measured", "--out", str(out), "--rate", "500"]
    assert main(["simulate", *FIBRE, *given]) == 0
    return out


def one(bags: Path) -> str:
    return str(sorted(bags.iterdir())[0])


Runs = dict[str, Callable[[Path, Path, bool], list[str]]]
RUNS: Runs = {
    "replay": lambda bags, out, less: ["replay", one(bags) if less else str(bags), *FIBRE, "--out", str(out)],
    "evaluate": lambda bags, out, less: [
        "evaluate", one(bags) if less else str(bags), "--processes", "0", "--out", str(out),
        *(["--measured-only"] if less else ["--model", "3state_coop"]),
    ],
    "fit": lambda bags, out, less: [
        "fit", str(bags), *FIBRE, "--out", str(out / "x.yaml"), "--starts", "1", "--processes", "0", "--no-nuisance",
        "--free", "f", *(["--no-intervals"] if less else ["k21"]), *([] if less else ["--no-intervals"]),
    ],
    "simulate": lambda bags, out, less: ["simulate", *FIBRE, "--out", str(out)],
}  # fmt: skip
# What a full run leaves and a lesser run does not make.
STALE = {
    "replay": {"bags/amp383_rt50ms_pca61"},
    "evaluate": {"force_rmsd.csv", "force_rmsd.png", "force_rmsd.pdf"},
    "fit": {"x/correlation.png", "x/correlation.pdf"},
    "simulate": set(),
}  # fmt: skip


def inside(out: Path) -> set[str]:
    return {path.relative_to(out).as_posix() for path in out.rglob("*")}


@pytest.mark.slow
@pytest.mark.parametrize("command", RUNS)
def test_one_rule_for_older_results(
    command: str, bags: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(RUNS[command](bags, out, False)) == 0
    before = inside(out)
    assert before >= STALE[command]
    foreign = ["notes.txt", "replay_of_mine.png", "x/mine.png", "bags/mine/mine_0.mcap", "force_rmsd_mine.png"]
    for name in foreign:
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text("mine")
    stamps = {path: path.stat().st_mtime_ns for path in out.rglob("*") if path.is_file()}
    capsys.readouterr()
    assert main(RUNS[command](bags, out, True)) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "exists; use --overwrite to replace it" in said
    assert stamps == {path: path.stat().st_mtime_ns for path in out.rglob("*") if path.is_file()}
    assert main([*RUNS[command](bags, out, True), "--overwrite"]) == 0
    after = inside(out)
    assert not after & STALE[command]
    assert set(foreign) <= after
    assert all((out / name).read_text() == "mine" for name in foreign)


def test_a_replay_does_not_write_over_a_bag_that_is_of_no_replay(
    bags: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", *FIBRE, "--out", str(tmp_path / "bags"), "--as-measured"]) == 0
    (made,) = (tmp_path / "bags").iterdir()
    made.rename(tmp_path / "bags" / "amp383_rt1ms_pca61")  # as its trial is called
    content = {path.name: path.read_bytes() for path in (tmp_path / "bags" / "amp383_rt1ms_pca61").iterdir()}
    capsys.readouterr()
    arguments = ["replay", str(tmp_path / "bags"), *FIBRE, "--out", str(tmp_path), "--overwrite"]
    assert main(arguments) == 2
    assert "exists and is of no replay" in capsys.readouterr().err
    assert content == {path.name: path.read_bytes() for path in (tmp_path / "bags" / "amp383_rt1ms_pca61").iterdir()}


def test_a_diagnosis_names_what_is_its_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = {"diagnosis.json", "augmented.yaml", "augmented_18Dec2017a.yaml", "report.html", "traces.npz"}
    for name in (*own, "journal.jsonl", "mine.html", "augmented.txt"):
        (tmp_path / name).write_text("{}")
    (tmp_path / NEXT).mkdir()
    assert {path.name for path in older_results(tmp_path)} == {*own, NEXT}
    assert main(["diagnose", "nowhere", *FIBRE, "--out", str(tmp_path)]) == 2
    assert "use --overwrite" in capsys.readouterr().err


def test_bench_and_loop_keep_what_is_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("bench.json", "loop.csv"):
        (tmp_path / name).write_text(json.dumps({}))
    assert main(["bench", "--study", "rhs", "--out", str(tmp_path / "bench.json")]) == 2
    assert main(["loop", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.count("use --overwrite") == 2
    assert said.count("\n") == 2


def test_a_benchmark_is_made_anew_only_when_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from xb_muscle_ros.prove.sealing import older_cases

    public = {"version": 2, "cases": ["case_0001"], "key_sha256": "0"}
    folder = tmp_path / "b"
    (folder / "cases" / "case_0001" / "bags" / "trial_1").mkdir(parents=True)
    (folder / "cases" / "case_0001" / "fibre.yaml").write_text("x")
    (folder / "cases" / "mine.txt").write_text("mine")
    (folder / "benchmark.json").write_text(json.dumps(public))
    given = ["prove", "make", "--cases", "1", "--seed", "1", "--out", str(folder), "--key", str(tmp_path / "k.json")]
    assert main(given) == 2
    assert "use --overwrite to replace it" in capsys.readouterr().err
    case = folder / "cases" / "case_0001"
    assert older_cases(folder) == [case / "bags" / "trial_1", case / "fibre.yaml", folder / "benchmark.json"]


@pytest.mark.slow
@pytest.mark.parametrize(("trial", "folder"), [("a/b", "a_b"), ("../../x", "_.._x"), ("", "_")])
def test_a_trial_s_name_leads_out_of_no_folder(bags: Path, tmp_path: Path, trial: str, folder: str) -> None:
    """Neither is a bag written beside the results, nor one removed that only has such a name."""
    named = tmp_path / "named"
    found = read_trial(Path(one(bags)))
    write_trial(named, replace(found, facts=replace(found.facts, trial=trial)))
    (tmp_path / "x").mkdir()
    (tmp_path / "x" / "mine.mcap").write_text("mine")
    before = inside(tmp_path)
    for more in ([], ["--overwrite"]):
        assert main(["replay", str(named), *FIBRE, "--out", str(tmp_path / "out"), *more]) == 0
        new = {name for name in inside(tmp_path) - before if "/" not in name or not name.startswith("out/")}
        assert new == {"out"}
        assert [path.name for path in (tmp_path / "out" / "bags").iterdir()] == [folder]
    assert (tmp_path / "x" / "mine.mcap").read_text() == "mine"


def test_trials_that_would_become_one_bag_are_refused(
    bags: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = read_trial(Path(one(bags)))
    for name, trial in (("one", "a b"), ("two", "a/b")):
        write_trial(tmp_path / "in" / name, replace(found, facts=replace(found.facts, trial=trial)))
    assert main(["replay", str(tmp_path / "in"), *FIBRE, "--out", str(tmp_path / "out")]) == 2
    assert "trials 'a b' and 'a/b' would both become bag" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
