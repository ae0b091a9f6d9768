"""``xb_muscle loop`` as a user meets it."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import main

pytest.importorskip("mujoco", reason="needs the extra mujoco")


def draw_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figure out where it is not what is tested; it takes most of the time."""
    monkeypatch.setattr("xb_muscle_ros.plant.figure.draw_loop", lambda *_: None)


def test_files_are_identical_when_repeated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("one", "two"):
        arguments = ["loop", "--model", "3state_coop", "--model", "mujoco", "--duration", "0.12"]
        assert main([*arguments, "--out", str(tmp_path / name)]) == 0
        draw_nothing(monkeypatch)
    for file in ("loop.json", "loop.csv"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    assert (tmp_path / "one" / "loop.png").stat().st_size > 10_000
    tree = json.loads((tmp_path / "one" / "loop.json").read_text())
    assert [run["model"] for run in tree["runs"]] == ["3state_coop", "mujoco"]
    ours, mujoco = tree["runs"]
    # Free calcium in µM for the fibre's models, activation for MuJoCo's muscle: each under its own name.
    assert ours["calcium_um"]["tibialis_anterior"] == pytest.approx(1e-3)
    assert 0.3 < ours["calcium_um"]["soleus"] < 5.0
    assert "activation" not in ours
    assert mujoco["activation"]["tibialis_anterior"] == 0.0
    assert "calcium_um" not in mujoco
    assert tree["platform"]["displacement_m"] == -0.075
    assert tree["tendon"] == "rigid"
    said = capsys.readouterr().out
    value = tree["runs"][0]["numbers"]["peak_force_rise_100ms_n"]
    assert f"{value:.1f}" in said
    rows = (tmp_path / "one" / "loop.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * 121


def test_knee_is_run_with_and_without_movement(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw_nothing(monkeypatch)
    arguments = ["loop", "--scene", "knee", "--model", "mujoco", "--duration", "0.2", "--out", str(tmp_path)]
    assert main(arguments) == 0
    assert [r["moved_before"] for r in json.loads((tmp_path / "loop.json").read_text())["runs"]] == [False, True]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--model", "3state_cop"], "did you mean '3state_coop'?"),
        (["--fiber", "nobody"], "fibre 'nobody' is not known"),
        (["--duration", "0"], "--duration is 0 s; allowed is 0.01 to 60"),
        (["--speed", "0"], "platform's speed is 0; allowed is 0.001 to 5"),
        (["--displacement", "nan"], "platform's displacement is nan"),
        (["--live"], "give one --model"),
        (["--live", "--model", "mujoco"], "give one --model"),
        (["--scene", "knee", "--speed", "1"], "are of the scenes ankle and myolegs; drop them"),
        (["--reflex-delay-s", "0.1"], "the reflex has no gain above 0"),
        (["--reflex-length-per-l0", "-1"], "length_per_l0 is -1; allowed is 0 to 1000"),
        (["--reflex-force-per-f0", "1", "--reflex-muscle", "soleuss"], "called 'soleuss'; did you mean 'soleus'?"),
        (["--reflex-force-per-f0", "1", "--reflex-delay-s", "0.0123"], "allowed are whole ticks of 0.001 s"),
    ],
)
def test_wrong_options(arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["loop", *arguments, "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert message in said
    assert list(tmp_path.iterdir()) == []


def test_without_the_engine(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert main(["loop", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'xb_muscle_ros[mujoco]'" in said


def test_a_fibre_beyond_its_lengths_is_told_once_with_the_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A body that is thrown over stretches its soleus further than any fibre goes."""
    draw_nothing(monkeypatch)
    thrown = ["--displacement", "-0.9", "--speed", "3", "--acceleration", "30"]
    arguments = ["loop", "--model", "mujoco", "--duration", "0.5", *thrown, "--out", str(tmp_path)]
    assert main(arguments) == 0
    said = capsys.readouterr().err
    assert said.count("beyond 0.5 to 1.5 L0") == 1
    assert "mujoco: the fibre of soleus comes to 1.5" in said
    text = (tmp_path / "loop.csv").read_text().splitlines()
    column = text[0].split(",").index("soleus.length_change_l0")
    first = next(row.split(",") for row in text[1:] if float(row.split(",")[column]) > 0.5)
    assert f"from t = {float(first[1]):.3f} s on" in said
    run = json.loads((tmp_path / "loop.json").read_text())["runs"][0]
    assert run["beyond_lengths"] in said
    assert run["ended_before_its_time"] is None
    assert main(["loop", "--model", "mujoco", "--duration", "0.1", "--out", str(tmp_path / "short")]) == 0
    assert "beyond" not in capsys.readouterr().err
    assert json.loads((tmp_path / "short" / "loop.json").read_text())["runs"][0]["beyond_lengths"] is None


def test_a_run_that_ends_before_its_time_has_files_a_line_and_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from xb_muscle_ros.plant.drives import FibreDrive, RunEnded

    draw_nothing(monkeypatch)
    pull = FibreDrive.pull

    def torn(drive: FibreDrive) -> object:
        if drive._plant.time_s > 0.0505:
            raise RunEnded("the body is gone")
        return pull(drive)

    monkeypatch.setattr(FibreDrive, "pull", torn)
    assert main(["loop", "--model", "3state_coop", "--duration", "0.1", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr()
    assert said.err.count("3state_coop: the body is gone") == 1
    run = json.loads((tmp_path / "loop.json").read_text())["runs"][0]
    assert run["ended_before_its_time"] == "the body is gone"
    assert run["numbers"]["stiffness_50ms_mgh"] is not None
    assert run["numbers"]["stiffness_100ms_mgh"] is None
    assert len((tmp_path / "loop.csv").read_text().splitlines()) == 1 + 51


def test_a_reflex_is_run_beside_its_absence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The absence is what a run without the option gives; calcium and activation of every tick are in the table."""
    draw_nothing(monkeypatch)
    arguments = ["loop", "--model", "3state_coop", "--model", "mujoco", "--duration", "0.15"]
    reflex = ["--reflex-length-per-l0", "2", "--reflex-delay-s", "0.03", "--reflex-muscle", "soleus"]
    assert main([*arguments, *reflex, "--out", str(tmp_path / "with")]) == 0
    assert main([*arguments, "--out", str(tmp_path / "without")]) == 0
    having, plain = (json.loads((tmp_path / name / "loop.json").read_text()) for name in ("with", "without"))
    assert having["reflex"]["delay_s"] == 0.03
    assert having["reflex"]["muscles"] == ["soleus"]
    assert [run["reflex"] for run in having["runs"]] == [False, True, False, True]
    assert [run for run in having["runs"] if not run["reflex"]] == plain["runs"]
    with (tmp_path / "with" / "loop.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    calcium, activation = (rows[0].index(f"soleus.{kind}") for kind in ("calcium_um", "activation"))
    last = {row[0]: row for row in rows[1:]}
    assert float(last["3state_coop, reflex"][calcium]) > float(last["3state_coop"][calcium])
    assert last["3state_coop"][activation] == ""
    assert float(last["mujoco, reflex"][activation]) > float(last["mujoco"][activation])
    assert "calcium" not in (tmp_path / "without" / "loop.csv").read_text().splitlines()[0]
