"""The export command: one file for each trial, nothing half written, nothing replaced unasked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.cli.main import main
from xb_muscle_ros.trials.bags import read_trial

BAGS = Path(__file__).resolve().parents[2] / "bags"
BAG = BAGS / "simulated_18Dec2017a_amp383_rt1ms_pca61"


def test_a_bag_goes_out_and_comes_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(BAG), "--out", str(tmp_path)]) == 0
    table = tmp_path / f"{BAG.name}.csv"
    assert capsys.readouterr().out.splitlines() == [str(table), str(table.with_suffix(".yaml"))]
    assert main(["import", str(table), "--mapping", str(table.with_suffix(".yaml")), "--out", str(tmp_path / "b")]) == 0
    [bag] = (tmp_path / "b").iterdir()
    back, trial = read_trial(bag), read_trial(BAG)
    np.testing.assert_array_equal(back.length_m, trial.length_m)
    np.testing.assert_array_equal(back.force_n, trial.force_n)
    assert back.facts.pca == trial.facts.pca
    assert [p.name for p in back.facts.phases] == [p.name for p in trial.facts.phases]
    found = xb.inspect(table).files[0]
    assert found.imports
    np.testing.assert_allclose(found.trials[0].length_m, trial.length_m, rtol=0.0, atol=1e-12)


def test_several_trials_are_a_file_each_and_older_ones_stay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(BAGS), "--to", "sto", "--out", str(tmp_path)]) == 0
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == [f"{bag.name}.sto" for bag in sorted(BAGS.iterdir()) if bag.is_dir()]
    (tmp_path / names[0]).unlink()
    assert main(["export", str(BAGS), "--to", "sto", "--out", str(tmp_path)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert not (tmp_path / names[0]).exists()
    assert main(["export", str(BAGS), "--to", "sto", "--out", str(tmp_path), "--overwrite"]) == 0


def test_a_bag_that_cannot_be_read_leaves_nothing(tmp_path: Path) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"no bag")
    assert main(["export", str(BAG), str(broken), "--out", str(tmp_path / "out")]) == 2
    assert not (tmp_path / "out").exists()


def test_two_trials_of_one_name_are_refused(tmp_path: Path) -> None:
    trial = read_trial(BAG)
    with pytest.raises(xb.UserError, match="2 trials would become"):
        xb.export_trials([trial, trial], tmp_path / "out")


def test_a_normalised_trial_comes_back_without_doubts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its lengths are in m with 1 m for L0, which the mapping reads in L0."""
    assert main(["export", str(BAG), "--out", str(tmp_path)]) == 0
    table = tmp_path / f"{BAG.name}.csv"
    assert main(["import", str(table), "--mapping", str(table.with_suffix(".yaml")), "--out", str(tmp_path / "b")]) == 0
    assert "its header tells" not in capsys.readouterr().out
