"""``xb_muscle loop --scene myolegs`` as a user meets it."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import pytest
import yaml

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.plant.leg.stance import Stance

SHORT = ["loop", "--scene", "myolegs", "--model", "mujoco", "--duration", "0.3", "--sway", "3", "--sway-hz", "1"]


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch, stance: Stance) -> None:
    """The stance is that of the session; finding it is tested elsewhere."""
    monkeypatch.setattr("xb_muscle_ros.plant.leg.stance.find_stance", lambda *_: stance)


@pytest.mark.usefixtures("found")
def test_files_are_identical_when_repeated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one", "two"):
        assert main([*SHORT, "--out", str(tmp_path / name)]) == 0
    for file in ("loop.json", "loop.csv"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    assert (tmp_path / "one" / "loop.png").stat().st_size > 30_000
    tree = json.loads((tmp_path / "one" / "loop.json").read_text())
    assert tree["scene"] == "myolegs"
    assert tree["stance"]["residual_nm"] < 1e-6
    assert tree["stance"]["tone"] == 0.02
    assert sum(tree["stance"]["normal_forces_n"]) == pytest.approx(tree["stance"]["mass_kg"] * 9.81, rel=1e-6)
    (run,) = tree["runs"]
    assert len(run["activation"]) == 80
    assert run["hold"]["largest_com_m"] < 5e-5
    assert [push["platform"]["displacement_m"] for push in run["pushes"]] == [-0.0375, -0.075, 0.0375, 0.075]
    assert [after["sway"] for after in run["after_sway"]] == [
        {"fibre_l0": 0.0, "frequency_hz": 1.0},
        {"fibre_l0": 0.03, "frequency_hz": 1.0},
    ]
    said = capsys.readouterr()
    assert said.err == ""
    stiffness = run["pushes"][1]["numbers"]["stiffness_50ms_mgh"]
    assert f"{stiffness:.2f}" in said.out
    assert str(tmp_path / "two" / "loop.png") in said.out
    with (tmp_path / "one" / "loop.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    # A second each without a push and after the nudge, and 0.3 s each of four pushes and of three for the sway.
    assert len(rows) == 2 * 201 + 7 * 61
    assert max(len(row["soleus_r.force_n"].strip("-")) for row in rows) <= len("0.12345678e-10")
    assert tree["csv_step_s"] == 0.005
    assert run["beyond_lengths"] is None
    assert {row["before"] for row in rows} == {"no sway", "sway 3 % at 1 Hz"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--lead", "0.5"], "centre of mass before the ankles is 0.5; allowed is 0 to 0.1 (m)"),
        (["--tone", "nan"], "least activation is nan; allowed is 0.005 to 0.2"),
        (["--sway", "40"], "sway is 40 % of soleus fibre length; allowed is 0 to 10"),
        (["--sway-hz", "0.3"], "sway frequency is 0.3 Hz; allowed are multiples of 0.25"),
        (["--duration", "0.1"], "--duration is 0.1 s; allowed in the scene myolegs is 0.3 to 10"),
        (["--csv-step", "0.0015"], "--csv-step is 0.0015 s; allowed are whole ticks of 0.001 s, up to 1 s"),
        (["--scene", "ankle", "--csv-step", "0.01"], "--csv-step only with --scene myolegs"),
        (["--speed", "0"], "platform's speed is 0; allowed is 0.001 to 5"),
        (["--live"], "give one --model, and not mujoco"),
        (["--live", "--model", "mujoco"], "give one --model, and not mujoco"),
        (["--node-parameters", "leg.yaml", "--model", "mujoco"], "give one --model, and not mujoco"),
        (["--model", "hill", "--reflex-length-per-l0", "1", "--reflex-muscle", "soleus"], "did you mean 'soleus_"),
        (["--scene", "ankle", "--node-parameters", "leg.yaml"], "--node-parameters only with --scene myolegs"),
        (["--model", "3state_cop"], "did you mean '3state_coop"),
        (["--fiber", "nobody"], "fibre 'nobody' is not known"),
        (["--scene", "ankle", "--tone", "0.1"], "--tone only with --scene myolegs"),
        (["--scene", "knee", "--sway-hz", "1", "--lead", "0.1"], "--lead, --sway-hz only with --scene myolegs"),
    ],
)
def test_wrong_options(arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["loop", "--scene", "myolegs", *arguments, "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert message in said
    assert list(tmp_path.iterdir()) == []


def test_without_the_model(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from xb_muscle_ros.plant.leg import body

    monkeypatch.setitem(sys.modules, "myo_sim", None)
    body._compiled.cache_clear()
    assert main([*SHORT, "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'xb_muscle_ros[body]'" in said


def test_parameter_file_of_the_leg_s_node(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is run; an older file stays."""
    file = tmp_path / "leg.yaml"
    asked = ["loop", "--scene", "myolegs", "--model", "hill", "--node-parameters", str(file)]
    assert main(asked) == 0
    assert f"muscle_node --ros-args --params-file {file}" in capsys.readouterr().out
    tree = yaml.safe_load(file.read_text())["/**"]["ros__parameters"]
    assert len(tree["fibers"]) == 80
    assert tree["model"] == "hill+active_force_length+passive_force_length"
    assert tree["soleus_r"]["constants"]["f0_n"] > 1000.0
    assert [path.name for path in tmp_path.iterdir()] == ["leg.yaml"]
    assert main(asked) == 2
    assert "leg.yaml exists; use --overwrite" in capsys.readouterr().err


@pytest.mark.usefixtures("found")
def test_a_model_that_cannot_stand_is_left_out_with_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stiff = ["loop", "--scene", "myolegs", "--model", "hill", "--elastic-tendon", "--duration", "0.3", "--sway", "0"]
    assert main([*stiff, "--model", "mujoco", "--out", str(tmp_path / "both")]) == 0
    warned = capsys.readouterr().err.splitlines()
    assert len(warned) == 1
    assert "has no series element that could take an elastic tendon up" in warned[0]
    assert warned[0].endswith("; that model is left out")
    assert [run["model"] for run in json.loads((tmp_path / "both" / "loop.json").read_text())["runs"]] == ["mujoco"]
    assert main([*stiff, "--out", str(tmp_path / "one")]) == 2
    assert "left out" not in capsys.readouterr().err
    assert not (tmp_path / "one").exists()


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        ([], "--out is missing; give a folder"),
        (["--scene", "ankle", "--node-parameters", "leg.yaml"], "--node-parameters only with --scene myolegs"),
    ],
)
def test_a_run_needs_a_folder(extra: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["loop", *extra]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("found")
def test_a_reflex_is_run_beside_its_absence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("xb_muscle_ros.plant.leg.figure.draw_leg", lambda *_: None)
    asked = ["loop", "--scene", "myolegs", "--model", "hill", "--model", "mujoco", "--duration", "0.3", "--sway", "0"]
    reflex = ["--reflex-length-per-l0", "3", "--reflex-muscle", "soleus_*"]
    assert main([*asked, *reflex, "--out", str(tmp_path)]) == 0
    tree = json.loads((tmp_path / "loop.json").read_text())
    assert tree["reflex"]["muscles"] == ["soleus_*"]
    assert [run["model"] for run in tree["runs"]] == ["hill", "hill, reflex", "mujoco", "mujoco, reflex"]
    pushes = [[push["numbers"] for push in run["pushes"]] for run in tree["runs"]]
    for without, having in (pushes[:2], pushes[2:]):
        # Backwards, where soleus is stretched: stiffer, but not before the reflex.
        assert having[1]["stiffness_20ms_mgh"] == without[1]["stiffness_20ms_mgh"]
        assert having[1]["stiffness_100ms_mgh"] > without[1]["stiffness_100ms_mgh"]
