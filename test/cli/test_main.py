"""The command line as a user meets it: exit codes, one line for what is wrong, files that appear whole."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import ALIASES, COMMANDS, build_parser, main
from xb_muscle_ros.errors import DataWarning


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bags")
    code = main(["simulate", "--fiber", "18Dec2017a", "--pca", "6.1", "--out", str(out), "--as-measured"])
    assert code == 0
    return out / "simulated_18Dec2017a_amp383_rt1ms_pca61"


def complaint(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> str:
    """The one line that a command that must fail says."""
    capsys.readouterr()
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith("xb_muscle: error: ")
    assert "Traceback" not in said
    return said


def test_simulate_then_replay_the_same_model(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(bag), "--fiber", "18Dec2017a", "--out", str(tmp_path)]) == 0
    entry = json.loads((tmp_path / "replay.json").read_text())["trials"][0]
    # The bag came from variable steps on the exact corners, replay sees their samples: they differ a little.
    assert 0.0 < entry["rmsd_f0"]["whole"] < 2e-3
    assert entry["srs_test"] == pytest.approx(entry["measured_srs_test"], rel=0.02)
    assert "amp383_rt1ms_pca61" in capsys.readouterr().out


def test_other_sets_and_fibres(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["replay", str(bag), "--fiber", "13Dec2017a", "--model", "2state", "--out", str(tmp_path)]
    assert main(arguments) == 0
    assert "1 of 1 trials are of fibre 18Dec2017a, replayed with parameters of 13Dec2017a" in capsys.readouterr().err
    assert json.loads((tmp_path / "replay.json").read_text())["trials"][0]["model"] == "2state"


def test_unknown_fibre(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = complaint(capsys, ["replay", str(bag), "--fiber", "nobody", "--out", str(tmp_path)])
    assert "fibre 'nobody' is not known" in said


def test_unknown_model(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = complaint(
        capsys, ["replay", str(bag), "--fiber", "18Dec2017a", "--model", "3state_cop", "--out", str(tmp_path)]
    )
    assert "did you mean '3state_coop'?" in said


def test_missing_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = complaint(capsys, ["replay", str(tmp_path / "none"), "--fiber", "18Dec2017a", "--out", str(tmp_path)])
    assert str(tmp_path / "none") in said


def test_output_that_cannot_be_written(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    said = complaint(capsys, ["replay", str(bag), "--fiber", "18Dec2017a", "--out", str(tmp_path / "file")])
    assert "cannot be written" in said


def test_malformed_fibre_file(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "fibre.yaml"
    file.write_text("/**:\n  ros__parameters: [")
    said = complaint(capsys, ["replay", str(bag), "--fiber", str(file), "--out", str(tmp_path)])
    assert "not valid YAML" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--pca", "99"], "--pca is 99"),
        (["--amplitude", "-0.1"], "--amplitude is -0.1 L0; allowed is 0 to 0.5 L0"),
        (["--rate", "0"], "--rate is 0"),
    ],
)
def test_impossible_protocols(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    said = complaint(capsys, ["simulate", "--fiber", "18Dec2017a", "--out", str(tmp_path), *arguments])
    assert words in said
    assert list(tmp_path.iterdir()) == []


def test_live_refuses_what_is_the_nodes(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["replay", str(bag), "--fiber", "18Dec2017a", "--out", str(tmp_path), "--live", "--substeps", "2"]
    assert "--live leaves steps" in complaint(capsys, arguments)


def test_live_refuses_changed_values(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["replay", str(bag), "--fiber", "18Dec2017a", "--out", str(tmp_path), "--live", "--set", "f=200"]
    assert "--live gives the node" in complaint(capsys, arguments)


def test_values_set_on_the_command_line_are_used(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    force = []
    for i, change in enumerate((["--set", "f=100"], ["--set", "f=200", "--set", "kon=50"])):
        out = tmp_path / str(i)
        assert main(["replay", str(bag), "--fiber", "18Dec2017a", "--out", str(out), *change]) == 0
        force.append(json.loads((out / "replay.json").read_text())["trials"][0]["rmsd_f0"]["whole"])
    assert abs(force[0] - force[1]) > 0.01


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("bins=100", "has no parameter 'bins'"),
        ("koff=-1", "parameter 'koff' is -1"),
        ("kof=1", "did you mean 'koff'"),
    ],
)
def test_values_that_cannot_be_set(capsys: pytest.CaptureFixture[str], change: str, words: str) -> None:
    assert words in complaint(capsys, ["parameters", "--fiber", "18Dec2017a", "--set", change])


def test_parameters_are_listed_with_unit_and_range(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["parameters", "--fiber", "18Dec2017a"]) == 0
    line = next(x for x in capsys.readouterr().out.splitlines() if x.startswith("kon "))
    assert "43.268" in line
    assert "1/(µM s)" in line


@pytest.mark.slow
def test_bench_writes_its_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "bench.json"
    assert main(["bench", "--study", "rhs", "--out", str(out)]) == 0
    figures = json.loads(out.read_text())["figures"]
    assert any(f["name"] == "right-hand side, 3state_coop, smooth" for f in figures)
    assert all(set(f) == {"name", "value", "unit", "spread", "compared_with"} for f in figures)
    assert all(f["value"] > 0.0 for f in figures)


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0


def test_ctrl_c_inside_a_compiler_is_an_interruption(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It may come back as an error of the compiler's own; any other error stays one."""
    from xb_muscle_ros.cli import main as module

    def run(error: type[BaseException]) -> int:
        class Parser:
            def __init__(self, command: str | None) -> None: ...

            def parse_args(self, argv: object) -> object:
                return self

            def run(self, arguments: object) -> int:
                try:
                    raise error
                finally:
                    raise RuntimeError("no compiled object yet")

        monkeypatch.setattr(module, "build_parser", Parser)
        return module.main([])

    assert run(KeyboardInterrupt) == 130
    assert capsys.readouterr().err == "xb_muscle: interrupted\n"
    with pytest.raises(RuntimeError):
        run(ValueError)


def test_every_command_is_in_the_full_parser() -> None:
    (commands,) = (action.choices for action in build_parser()._actions if isinstance(action.choices, dict))
    assert [name for name in commands if name not in ALIASES] == list(COMMANDS)
    for name, command in commands.items():
        assert command.description, name
        for action in command._actions:
            assert action.help or action.dest == "step", (name, action.dest)


def test_what_is_odd_in_data_is_a_line_and_not_a_place_in_the_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def odd(_: object) -> int:
        warnings.warn("muscle a has no tendon", DataWarning, stacklevel=1)
        return 0

    monkeypatch.setattr("xb_muscle_ros.cli.parameters_command.run", odd)
    assert main(["parameters"]) == 0
    assert capsys.readouterr().err == "xb_muscle: warning: muscle a has no tendon\n"
