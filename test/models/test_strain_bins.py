"""Bins too wide for the heads are told of, wherever a fibre's force is computed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.errors import StateViolation
from xb_muscle_ros.evaluate.sets import gather, value_lines
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.strain_bins import wide_bins_line


@pytest.mark.parametrize(("bins", "told"), [(10, True), (100, True), (145, False), (200, False)])
def test_bins_are_too_wide_where_force_is_off(bins: int, told: bool) -> None:
    fine = load_fibre("18Dec2017a", "3state_coop", "characteristics")
    fibre = changed(fine, {"bins": float(bins)}, "test")
    force, right = (Muscle(f).outputs(Muscle(f).settle(0.0, 0.8)).force_f0 for f in (fibre, fine))
    line = wide_bins_line(fibre.values)
    assert bool(line) == told
    if told:
        assert line.endswith("take 145 bins or more")
        assert abs(force / right - 1.0) > 1e-5
    else:
        assert force == pytest.approx(right, rel=1e-4)
    assert wide_bins_line(load_fibre("18Dec2017a").values) == ""


def test_every_command_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (chosen,) = gather(["18Dec2017a"], ["3state_coop"], "characteristics")
    assert value_lines([chosen]) == []
    fibre = changed(chosen.fibres["18Dec2017a"], {"bins": 10.0}, "test")
    (line,) = value_lines([replace(chosen, fibres={"18Dec2017a": fibre})])
    assert line.startswith("model 3state_coop, fibre 18Dec2017a: strain bins of 3.3 power strokes are too wide")
    assert (
        main(
            [
                "replay",
                "nowhere",
                "--fiber",
                "18Dec2017a",
                "--method",
                "characteristics",
                "--set",
                "bins=10",
                "--out",
                str(tmp_path / "out"),
            ]
        )
        == 2
    )
    assert "warning: strain bins of 3.3 power strokes are too wide" in capsys.readouterr().err


def test_a_grid_that_moves_beyond_its_range_is_told_with_the_range() -> None:
    fine = load_fibre("18Dec2017a", "3state_coop", "characteristics")
    narrow = Muscle(changed(fine, {"strain_range": 3.0, "regrid": 0.0}, "test"))
    with pytest.raises(StateViolation, match=r"state grid_shift became \S+ at .*; allowed is -2 to 2; "):
        narrow.step(narrow.settle(0.0, 0.8), 0.2, 0.8, 1e-2)
