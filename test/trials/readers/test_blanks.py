"""Blank samples: short runs are filled and told, whatever stands for them; all others are refused."""

from __future__ import annotations

from pathlib import Path

import lab_tables as lab
import numpy as np
import pytest

from xb_muscle_ros.trials.readers import blanks


def blanked(folder: Path, places: list[int], mark: str, column: int = 2, delimiter: str = ",") -> Path:
    lines = lab.rows(delimiter=delimiter)
    for place in places:
        cells = lines[place].split(delimiter)
        cells[column] = mark
        lines[place] = delimiter.join(cells)
    return lab.write(folder, [delimiter.join(lab.NAMES), *lines])


@pytest.mark.parametrize("mark", ["", " ", "NaN", "nan", "#N/A", "#NV", "N/A", "-", "--", "\u2212", "null", "#DIV/0!"])
@pytest.mark.parametrize("delimiter", [",", "\t"])
def test_short_runs_are_filled_by_lines_and_told(tmp_path: Path, mark: str, delimiter: str) -> None:
    places = [10, 50, 51]
    (trial,) = lab.trials(blanked(tmp_path, places, mark, delimiter=delimiter))
    force = lab.FORCE_MN.copy()
    force[10] = (force[9] + force[11]) / 2
    force[50], force[51] = (2 * force[49] + force[52]) / 3, (force[49] + 2 * force[52]) / 3
    assert trial.force_n / 1e-3 == pytest.approx(force, rel=1e-12)
    assert trial.length_m.tolist() == pytest.approx((1e-3 * lab.LENGTH_MM).tolist())
    line = "column 'force_mN': 3 blank samples in 2 runs were filled by straight lines, at 0.01 s, 0.05 to 0.051 s"
    assert trial.warnings == (f"{tmp_path / 't.csv'}, {line}",)
    assert line in trial.facts.source


def test_a_longer_run_is_refused_with_the_option_that_allows_it(tmp_path: Path) -> None:
    path = blanked(tmp_path, [20, 60, 61, 62], "#N/A")
    why = lab.refusal(path)
    assert "line 62, column 'force_mN' holds '#N/A' (a run of 3 lines)" in why
    assert "blanks of up to 2 ms are filled; allow longer ones by blanks.longest (--longest-blank '20 ms')" in why
    (trial,) = lab.trials(path, blanks={"longest": "3 ms"})
    assert "4 blank samples in 2 runs were filled" in lab.told(trial)
    assert "line 22, column 'force_mN' holds '#N/A'" in lab.refusal(
        blanked(tmp_path / "other", [20], "#N/A"), blanks={"longest": "0 ms"}
    )


@pytest.mark.parametrize("place", [0, lab.N - 1])
def test_blanks_at_the_ends_are_refused(tmp_path: Path, place: int) -> None:
    why = lab.refusal(blanked(tmp_path, [place], "-"), blanks={"longest": "1 s"})
    assert f"line {place + 2}, column 'force_mN' holds '-'" in why
    assert "blank samples at the begin or the end are not filled; remove them" in why


@pytest.mark.parametrize(("mark", "column"), [("x", 2), ("inf", 2), ("1.2.3", 1), ("", 0), ("NaN", 0)])
def test_other_faults_and_blank_times_stay_refused(tmp_path: Path, mark: str, column: int) -> None:
    found = f"'{mark}'" if mark else "nothing"
    why = lab.refusal(blanked(tmp_path, [30], mark, column), blanks={"longest": "1 s"})
    assert f"line 32, column '{lab.NAMES[column]}' holds {found}" in why


def test_a_line_that_was_cut_short_is_no_blank(tmp_path: Path) -> None:
    lines = [",".join(lab.NAMES), *lab.rows()]
    lines[40] = lines[40].rpartition(",")[0]
    assert "line 41, column 'force_mN' holds nothing; needed is a finite number" in lab.refusal(
        lab.write(tmp_path, lines)
    )


def test_runs_are_as_long_as_the_time_to_the_next_value() -> None:
    time_s = np.array([0.0, 1.0, 2.0, 10.0, 11.0])
    blank = np.array([False, True, True, False, False])
    assert not blanks.too_long(blank, time_s, 9.0).any()
    assert blanks.too_long(blank, time_s, 8.9).tolist() == blank.tolist()
    assert blanks.fill(np.array([0.0, np.nan, np.nan, 20.0, 0.0]), blank, time_s).tolist() == [0.0, 2.0, 4.0, 20.0, 0.0]
