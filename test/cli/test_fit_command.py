"""``xb_muscle fit`` as a user meets it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.fit.coordinates import FITTED
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY
from xb_muscle_ros.models.fibre_file import load_fibre

QUICK = ["--free", "f", "k21", "--starts", "1", "--no-intervals", "--processes", "0"]


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("bags")
    made = [
        "simulate",
        "--fiber",
        "18Dec2017a",
        "--set",
        "f=95",
        "--set",
        "k21=20",
        "--set",
        "smoothing=0",
        "--as-measured",
    ]
    assert main([*made, "--pca", "4.5", "6.1", "--amplitude", "0.0383", "--recovery", "0.1", "--out", str(out)]) == 0
    return str(out)


def fit(bags: str, out: Path, *more: str) -> list[str]:
    return ["fit", bags, "--fiber", "18Dec2017a", "--set", "smoothing=0", "--out", str(out), *more]


@pytest.mark.slow
def test_fitted_fibre_meets_the_data_it_was_made_with(
    bags: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mine.yaml"
    more = ["--hold-out", "pca=6.1", "--free", "f", "k21", "--starts", "1", "--processes", "0", "--no-anchor"]
    assert main(fit(bags, out, *more)) == 0
    said = capsys.readouterr().out
    assert "held out" in said
    found = json.loads((tmp_path / "mine" / "fit.json").read_text())
    assert found["heldout_rmsd_f0"] < 2e-3 < found["before"]["heldout_rmsd_f0"]
    assert all(row["interval"][0] < row["value"] < row["interval"][1] for row in found["parameters"])
    for figure in ("trials", "profiles", "correlation"):
        assert (tmp_path / "mine" / f"{figure}.png").stat().st_size > 10_000
        assert (tmp_path / "mine" / f"{figure}.pdf").is_file()
    fibre = load_fibre(out)
    assert fibre.values["f"] == pytest.approx(95.0, rel=0.02)
    # What was written replays as it is.
    assert main(["replay", bags, "--fiber", str(out), "--out", str(tmp_path / "replay")]) == 0
    rows = json.loads((tmp_path / "replay" / "replay.json").read_text())["trials"]
    assert all(row["rmsd_f0"]["whole"] < 5e-3 for row in rows)


@pytest.mark.slow
def test_features_alone(tmp_path: Path) -> None:
    table = {
        "pCa": [4.5, 6.1],
        "recovery_s": [0.1],
        "amplitude_L0": [0.0, 0.0383],
        "fibres": {
            "mine": {
                "isometric_force": [[[1.0, 1.0]], [[0.5, None]]],
                "srs_conditioning": [[[None, 40.0]], [[None, 25.0]]],
                "srs_test": [[[40.0, 36.0]], [[25.0, 20.0]]],
            }
        },
    }
    (tmp_path / "table.json").write_text(json.dumps(table))
    out = tmp_path / "mine.yaml"
    given = ["fit", "--features", str(tmp_path / "table.json"), "--features-of", "mine", "--fiber", "18Dec2017a"]
    assert main([*given, "--out", str(out), *QUICK]) == 0
    found = json.loads((tmp_path / "mine" / "fit.json").read_text())
    # Two forces, two unconditioned stretches, four test stretches, and the anchor.
    assert len(found["features"]) == 9
    assert found["train_rmsd_f0"] is None
    assert "9 features of mine" in load_fibre(out).source


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--hold-out", "trial=*"], "all 2 trials are held out"),
        (["--bound", "f=200:100"], "bounds 200 to 100"),
        (["--bound", "f=1"], "two numbers with a colon"),
        (["--prior", "f=x:1"], "'x' is not a number"),
        (["--nuisance", "pca_shif"], "did you mean 'pca_shift'"),
        (["--nuisance", "none", "pca_shift"], "--nuisance none is given with others"),
        (["--free", "vmax"], "has no parameter 'vmax'"),
        (["--tie", "f"], "needed is NAME=VALUE"),
        (["--starts", "0"], "number of starts is 0"),
        (["--level", "2"], "--level is 2"),
        (["--weight", "nobody=1"], "weight of trial 'nobody'"),
        (["--features", "none.json"], "cannot be read"),
        (["--prior-fibers", "13Dec2017a"], "at least 3"),
    ],
)
def test_one_line_for_what_cannot_be(
    bags: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], words: str
) -> None:
    assert main(fit(bags, tmp_path / "x.yaml", "--processes", "0", *more)) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert words in said
    assert not (tmp_path / "x.yaml").exists()


def test_what_exists_is_kept(bags: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.yaml").write_text("mine")
    assert main(fit(bags, tmp_path / "x.yaml", *QUICK)) == 2
    assert "exists; use --overwrite" in capsys.readouterr().err
    assert (tmp_path / "x.yaml").read_text() == "mine"


def test_nothing_to_fit_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit", "--fiber", "18Dec2017a", "--out", str(tmp_path / "x.yaml")]) == 2
    assert "nothing to fit to" in capsys.readouterr().err
    assert main(["fit", "--fiber", "18Dec2017a", "--out", str(tmp_path / "x.txt")]) == 2
    assert "ending in .yaml" in capsys.readouterr().err


@pytest.fixture(scope="module")
def own_bags(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Bags of a fibre of the user's own, 30 mm long and of 0.4 N, with some drag."""
    from dataclasses import replace

    from xb_muscle_ros.models.fibre_file import changed
    from xb_muscle_ros.models.muscle import Muscle
    from xb_muscle_ros.simulation.offline import simulate_trial
    from xb_muscle_ros.trials.bags import write_trial
    from xb_muscle_ros.trials.protocol import StretchShortenStretch

    out = tmp_path_factory.mktemp("own")
    muscle = Muscle(
        changed(load_fibre("18Dec2017a", "3state_coop+viscous_drag"), {"drag": 0.03, "smoothing": 0.0}, "test")
    )
    for pca in (4.5, 6.1):
        trial = StretchShortenStretch(0.0383, 0.1).trial("mine", pca)
        facts = replace(trial.facts, reference_length_m=0.03, f0_n=0.4)
        trial = replace(trial, facts=facts, length_m=0.03 * trial.length_m)
        force = simulate_trial(muscle, trial).force_n
        write_trial(out / trial.facts.trial, replace(trial, force_time_s=trial.time_s, force_n=force))
    return str(out)


DRAG = ["--model", "3state_coop+viscous_drag", "--starts", "1", "--no-intervals", "--processes", "0"]


@pytest.mark.slow
def test_a_mechanism_is_fitted_without_being_named_and_the_file_serves_the_bags(
    own_bags: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mine.yaml"
    fixed = [n for n in FITTED if n in load_fibre("18Dec2017a", "3state_coop").values and n != "f"]
    assert main([*fit(own_bags, out), *DRAG, "--fix", *fixed]) == 0
    said = capsys.readouterr()
    assert "viscous_drag has no fitted values in the fibre file; starts from the catalogue's: drag 0.01" in said.err
    assert "held at their values: kon " in said.out
    fibre = load_fibre(out)
    assert fibre.values["drag"] == pytest.approx(0.03, rel=0.02)
    assert (fibre.name, fibre.reference_length_m, fibre.f0_n) == ("mine", 0.03, 0.4)
    found = json.loads((tmp_path / "mine" / "fit.json").read_text())
    assert found["held"]["koff"] == 80.0
    assert found["fibre"] == "mine"
    # Every command takes the file for the bags it was fitted to, and has no more to remark than how few they are.
    arguments = ["evaluate", own_bags, "--fiber", str(out), "--processes", "0", "--out", str(tmp_path / "e")]
    assert main(arguments) == 0
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("xb_muscle: ")]
    assert line.endswith("isometric force is known at 2 levels of pCa; 5 are needed")


@pytest.mark.slow
def test_a_mechanism_left_at_its_null_is_said(
    own_bags: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*fit(own_bags, tmp_path / "x.yaml"), *DRAG, "--free", "f"]) == 0
    line = "xb_muscle: warning: viscous_drag is at its null value (drag 0) and not fitted, its effect is exactly zero"
    assert capsys.readouterr().err.count(line) == 1
    given = ["simulate", "--fiber", "18Dec2017a", "--model", "3state_coop+viscous_drag", "--set", "smoothing=0"]
    assert main([*given, "--out", str(tmp_path / "b")]) == 0
    line = "viscous_drag is at its null value, its effect is exactly zero; fit it or give --set drag=VALUE\n"
    assert capsys.readouterr().err.count(line) == 1


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--free", "f", "--bound", "k21=1:2"], "parameter 'k21' has a bound or prior but is not fitted"),
        (["--bound", "f=1:200", "--bound", "f=1:2", "f=3:200"], "--bound f is given more than once"),
        (["--nuisance", "all=0.1"], "'all' takes no SD"),
        (["--nuisance", "ordinary=0.1"], "'ordinary' takes no SD"),
        (["--hold-out", "pca=9"], "no trial meets the rule 'pca=9'"),
    ],
)
def test_what_would_have_been_passed_over(
    bags: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], words: str
) -> None:
    assert main(fit(bags, tmp_path / "x.yaml", "--processes", "0", *more)) == 2
    assert words in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "fitted", "absent"),
    [
        ([], {*ORDINARY}, "force_drift, transducer_lag"),
        (["--nuisance", "ordinary", "transducer_lag"], {*ORDINARY, "transducer_lag"}, "force_drift"),
        (["--nuisance", "pca_shift=0.1"], {"pca_shift"}, ", ".join(n for n in ARTEFACTS if n != "pca_shift")),
        (["--no-nuisance"], set(), ", ".join(ARTEFACTS)),
        (["--nuisance", "none"], set(), ", ".join(ARTEFACTS)),
    ],
)
def test_ordinary_errors_are_fitted_unless_asked_otherwise(
    bags: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], fitted: set[str], absent: str
) -> None:
    assert main(fit(bags, tmp_path / "x.yaml", *QUICK, *more)) == 0
    said = capsys.readouterr().out
    assert ("errors of the measurement fitted beside: " in said) == bool(fitted)
    assert f"taken as absent: {absent}\n" in said
    rows = json.loads((tmp_path / "x" / "fit.json").read_text())["parameters"]
    assert {row["name"] for row in rows if row["group"] is not None} == fitted
    # A value for each solution and each trial.
    assert sum(row["name"] == "pca_shift" for row in rows) == 2 * ("pca_shift" in fitted)


@pytest.mark.slow
def test_what_one_trial_cannot_show_is_said(bags: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(fit(bags, tmp_path / "x.yaml", *QUICK, "--hold-out", "pca=6.1")) == 0
    said = capsys.readouterr()
    assert "xb_muscle: warning: not fitted, since nothing in the trials shows it: run_down" in said.err
    assert "with what its isometric force tells: " in said.out


def test_none_and_some_errors_at_once_cannot_be(bags: str, tmp_path: Path) -> None:
    with pytest.raises(SystemExit):
        main(fit(bags, tmp_path / "x.yaml", "--no-nuisance", "--nuisance", "pca_shift"))
