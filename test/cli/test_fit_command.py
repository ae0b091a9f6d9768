"""``xb_muscle fit`` as a user meets it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import main
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
