"""A column for each trial: patterns of names, facts from their groups, and trials of different length."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import lab_tables as lab
import numpy as np
import pytest

from xb_muscle_ros.errors import UserError

PCAS = (4.5, 6.1)
TIME = {"column": "time_s", "unit": "s"}
BY_PCA: dict[str, Any] = {
    "time": TIME,
    "length": {"pattern": "L_pCa(?P<pca>.+)", "unit": "mm"},
    "force": {"pattern": "F_pCa(?P<pca>.+)", "unit": "mN"},
}
PAIRS = (lab.LENGTH_MM, lab.FORCE_MN, lab.LENGTH_MM, 2 * lab.FORCE_MN)


def table(folder: Path, names: str, *columns: np.ndarray) -> Path:
    return lab.write(folder, [names, *lab.rows(lab.TIME_S, *columns)])


def test_length_and_force_of_each_pca(tmp_path: Path) -> None:
    path = table(tmp_path, "time_s,L_pCa4.5,F_pCa4.5,L_pCa6.1,F_pCa6.1", *PAIRS)
    one, two = lab.trials(path, BY_PCA, pca=None)
    lab.same(one)
    lab.same(two, force_mn=2 * lab.FORCE_MN)
    assert (one.facts.pca, two.facts.pca) == PCAS
    assert (one.facts.trial, two.facts.trial) == ("t_pCa4.5", "t_pCa6.1")
    assert one.warnings == (f"{path}: columns are those of 2 trials: pCa4.5, pCa6.1",)
    assert two.warnings == ()


def test_one_length_and_a_force_for_each_trial_with_units_in_the_names(tmp_path: Path) -> None:
    path = table(tmp_path, "time_s,length_mm,F_a (mN),F_b (mN)", lab.LENGTH_MM, lab.FORCE_MN, 2 * lab.FORCE_MN)
    columns = {**lab.COLUMNS, "force": {"pattern": r"F_(?P<trial>\w+) \(mN\)"}}
    one, two = lab.trials(path, columns)
    lab.same(one)
    lab.same(two, force_mn=2 * lab.FORCE_MN)
    assert (one.facts.trial, two.facts.trial, one.facts.pca) == ("t_a", "t_b", 6.1)
    assert "column 'F_a (mN)' is read in mN, as its header says" in lab.told(one)


def test_facts_have_factors_and_the_trial_a_name(tmp_path: Path) -> None:
    path = table(tmp_path, "time_s,length_mm,run1 pCa45,run2 pCa45", lab.LENGTH_MM, lab.FORCE_MN, 2 * lab.FORCE_MN)
    force = {"pattern": r"(?P<trial>run\d) pCa(?P<pca>\d+)", "factors": {"pca": 0.1}, "unit": "mN"}
    found = lab.trials(path, {**lab.COLUMNS, "force": force}, pca=None)
    assert [(each.facts.trial, each.facts.pca) for each in found] == [("t_run1", 4.5), ("t_run2", 4.5)]


def test_a_time_for_each_trial_and_columns_of_different_length(tmp_path: Path) -> None:
    lines = lab.rows(lab.TIME_S, lab.LENGTH_MM, lab.FORCE_MN, 2 * lab.TIME_S, lab.LENGTH_MM, 2 * lab.FORCE_MN)
    cut = [line if i < 100 else ",".join([*line.split(",")[:3], "", "", ""]) for i, line in enumerate(lines)]
    short = [line if i < 100 else ",".join(line.split(",")[:3]) for i, line in enumerate(lines)]
    names = "t1,L1,F1,t2,L2,F2"
    columns = {key: {"pattern": rf"{letter}(?P<trial>\d)", "unit": unit} for key, letter, unit in
               (("time", "t", "s"), ("length", "L", "mm"), ("force", "F", "mN"))}  # fmt: skip
    for folder, rows in (("cut", cut), ("short", short)):
        one, two = lab.trials(lab.write(tmp_path / folder, [names, *rows]), columns)
        lab.same(one)
        lab.same(two, lab.LENGTH_MM[:100], 2 * lab.FORCE_MN[:100], 2 * lab.TIME_S[:100])
        assert "trial '2' ends in line 101, others go on" in lab.told(two)


@pytest.mark.parametrize(
    ("names", "change", "words"),
    [
        (
            "time_s,L_pCa4.5,F_pCa4.5,L_pCa6.1,F_x",
            {},
            "column 'L_pCa6.1' is of trial 'pCa6.1', which has no column of force",
        ),
        (
            "time_s,a,b,c,d",
            {},
            "has no column whose whole name is 'L_pCa(?P<pca>.+)' (columns.length.pattern); its columns",
        ),
        (
            "time_s,L_pCa4.5,F_pCa4.5,L_pCa4.5x,F_pCa4.5x",
            {"length": {"pattern": "L_pCa(?P<pca>[0-9.]+)x?", "unit": "mm"}},
            "columns 'L_pCa4.5' and 'L_pCa4.5x' both are length of trial 'pCa4.5'",
        ),
        (
            "time_s,L_pCa4.5,F_pCa4.5,L_pCahigh,F_pCahigh",
            {},
            "column 'L_pCahigh': pca is 'high'; needed is a finite number",
        ),
    ],
)
def test_patterns_that_do_not_fit_are_refused(tmp_path: Path, names: str, change: dict[str, Any], words: str) -> None:
    assert words in lab.refusal(table(tmp_path, names, *PAIRS), {**BY_PCA, **change}, pca=None)


@pytest.mark.parametrize(
    ("force", "keys", "words"),
    [
        ({"pattern": "F_.*"}, {}, "has no named group; needed is one that tells trials apart"),
        ({"pattern": "F_(?P<run>.*)"}, {}, "unknown group in columns.force.pattern: run"),
        ({"pattern": "F_(?P<pca>.*)"}, {"pca": 6.1}, "columns.force.pattern tells pca, and it is given as well"),
        ({"pattern": "F_(?P<trial>.*)", "column": "f"}, {}, "columns.force has a column and a pattern"),
        ({"pattern": "F_(?P<trial>.*)", "factors": {"pca": 1}}, {}, "columns.force.factors.pca"),
        ({"pattern": "F_("}, {}, "is no regular expression"),
    ],
)
def test_wrong_patterns_are_told(tmp_path: Path, force: dict[str, Any], keys: dict[str, Any], words: str) -> None:
    columns = {**lab.COLUMNS, "force": {"unit": "mN", **force}}
    with pytest.raises(UserError) as refused:
        lab.run(table(tmp_path, "time_s,length_mm,F_a", lab.LENGTH_MM, lab.FORCE_MN), columns, **{"pca": None, **keys})
    assert words in str(refused.value)


def test_trials_beside_and_below_each_other(tmp_path: Path) -> None:
    lines = [*lab.rows(lab.TIME_S, *PAIRS), *lab.rows(lab.TIME_S, *PAIRS)]
    found = lab.trials(lab.write(tmp_path, ["time_s,L_pCa4.5,F_pCa4.5,L_pCa6.1,F_pCa6.1", *lines]), BY_PCA, pca=None)
    assert [each.facts.trial for each in found] == ["t_1_pCa4.5", "t_1_pCa6.1", "t_2_pCa4.5", "t_2_pCa6.1"]
    lab.same(found[2])


def test_a_block_of_the_same_pca_is_another_trial(tmp_path: Path) -> None:
    pca = np.repeat([4.5, 6.1, 4.5], lab.N)
    going_on = np.arange(3 * lab.N) / 1000
    path = lab.write(tmp_path, ["time_s,length_mm,force_mN,pCa",
                     *lab.rows(going_on, np.tile(lab.LENGTH_MM, 3), np.tile(lab.FORCE_MN, 3), pca)])  # fmt: skip
    columns = {**lab.COLUMNS, "calcium": {"column": "pCa", "unit": "pCa"}, "trial": {"column": "pCa"}}
    found = lab.trials(path, columns, pca=None)
    assert [(each.facts.trial, each.facts.pca) for each in found] == [("t_4.5", 4.5), ("t_6.1", 6.1), ("t_4.5_2", 4.5)]
    for i, each in enumerate(found):
        lab.same(each, time_s=going_on[i * lab.N : (i + 1) * lab.N])
    assert "column 'pCa' tells 3 trials apart: '4.5' comes 2 times, each time a trial of its own" in lab.told(found[0])


def test_rows_of_trials_in_turns_belong_together(tmp_path: Path) -> None:
    lines = [f"{line},{name}" for line in lab.rows() for name in ("a", "b")]
    found = lab.trials(lab.write(tmp_path, ["time_s,length_mm,force_mN,trial", *lines]))
    assert [each.facts.trial for each in found] == ["t_a", "t_b"]
    for each in found:
        lab.same(each)
