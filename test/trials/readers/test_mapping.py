"""Mapping files: every key checked."""

from __future__ import annotations

import copy
import json
import math
from pathlib import Path
from typing import Any

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.activation import CalciumTransient
from xb_muscle_ros.trials.readers.columns import BAG
from xb_muscle_ros.trials.readers.description import filled
from xb_muscle_ros.trials.readers.mapping import build_mapping, load_mapping
from xb_muscle_ros.trials.readers.units import Quantity

TREE: dict[str, Any] = {
    "fibre": "f1",
    "columns": {
        "time": {"column": "t", "unit": "ms"},
        "length": {"column": "l", "unit": "mm"},
        "force": {"column": "f", "unit": "kPa"},
    },
    "f0": "100 kPa",
    "file_name": {"pattern": r"_pca(?P<pca>\d+)", "factors": {"pca": 0.1}},
    "amplitude_l0": 0.0383,
    "isometric_scaling": {"source": "a table", "fractions_f0": {4.5: 1.0, "6.1": "0.5"}},
}


ACTIVATION = {"rest": "0.05 uM", "tetanus": "5.1 pCa", "rise": "50 ms", "decay": "30 ms"}
SARCOMERES_IN_L0 = {"column": "l", "unit": "L0", "of": "sarcomere"}


def _changed(*path: str, value: Any = None) -> dict[str, Any]:
    """TREE with one key set, or taken out where the value is None."""
    tree = copy.deepcopy(TREE)
    branch = tree
    for part in path[:-1]:
        branch = branch[part]
    if value is None:
        del branch[path[-1]]
    else:
        branch[path[-1]] = value
    return tree


def test_a_good_tree() -> None:
    made = build_mapping(TREE, "here")
    assert (made.fibre, made.data_set) == ("f1", "f1")
    assert made.time.unit.factor == 1e-3
    assert made.f0 == Quantity(1e5, "stress")
    assert made.reference_length is None
    assert made.isometric_fractions == {4.5: 1.0, 6.1: 0.5}
    assert made.facts_of(Path("x/cell_pca61.csv")) == {"pca": 6.1, "amplitude_l0": 0.0383, "recovery_s": None}


def test_a_file_name_that_does_not_match_is_refused() -> None:
    with pytest.raises(UserError, match=r"cell\.csv: the file name does not match .* of here"):
        build_mapping(TREE, "here").facts_of(Path("cell.csv"))


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        (_changed("fiber", value="x"), "here: unknown fiber; did you mean 'fibre'"),
        (_changed("columns", "lenght", value={}), "unknown columns.lenght; did you mean 'length'"),
        (_changed("columns", "time", "units", value="s"), "unknown columns.time.units; did you mean 'unit'"),
        (_changed("isometric_scaling", "fraction_f0", value={}), "did you mean 'fractions_f0'"),
        (_changed("file_name", "factors", "pcb", value=1.0), "unknown file_name.factors.pcb; did you mean 'pca'"),
        (_changed("file_name", "pattern", value=r"(?P<pac>\d+)"), "pattern: pac; did you mean 'pca'"),
        (_changed("file_name", "pattern", value="("), "is no regular expression"),
        (_changed("fibre"), "fibre is missing"),
        (_changed("columns"), "columns.time is missing"),
        (_changed("columns", "length"), "columns.length is missing"),
        (_changed("columns", "length", "unit"), "columns.length: unit is missing; give the unit of column 'l'"),
        (_changed("columns", "length", "unit", value="kPa"), "'kPa' is no unit of length"),
        (_changed("columns", "length", "is", value="relative"), "columns.length.is is 'relative'; allowed"),
        (_changed("columns", "length", "is", value="change"), "the reference length has to be given"),
        (_changed("columns", "time", value="t"), "columns.time is 't'; needed are keys"),
        (_changed("reference_length", value="42.8"), "reference_length is '42.8'; needed is a number"),
        (_changed("reference_length", value="1 L0"), "reference_length has to be a length"),
        (_changed("f0"), "forces are in kPa, so f0 is needed"),
        (_changed("f0", value="1 N"), "f0 is a force, the force column a stress"),
        (_changed("columns", "force"), "there is no force column, so f0 has no use"),
        (_changed("columns", "force", "unit", value="F0"), "forces are in F0 and f0 is a stress, which has no use"),
        (
            {**_changed("columns", "length", "unit", value="L0"), "reference_length": "first_isometric"},
            "lengths are in L0, so 'reference_length: first_isometric' has no use",
        ),
        (
            {**_changed("columns", "length", value=SARCOMERES_IN_L0), "reference_length": "2.4 um"},
            "sarcomere lengths are in L0, so reference_length has no use",
        ),
        (_changed("pca", value="low"), "pca is 'low'; needed is a finite number"),
        (_changed("isometric_scaling", "fractions_f0", value={4.5: -1}), "at pCa 4.5 is -1"),
        (_changed("isometric_scaling", "fractions_f0", value=[1, 2]), "needed is a table"),
        (_changed("f0", value={"isometric_at": 4.5}), "unknown f0.isometric_at; did you mean 'isometric_at_pca'"),
        (_changed("f0", value="96.7 Pa"), "f0 is 96.7 Pa; allowed is 1000 to 2e+06 Pa; is its unit right?"),
        (_changed("columns", "length", "at_reference", value="40 mm"), "the reference length has to be given"),
        (_changed("columns", "length", "at_reference", value="1 L0"), "at_reference has to be a length"),
        (_changed("columns", "force", "zero", value="first"), "columns.force.zero is 'first'; allowed"),
        (_changed("columns", "time", "largest_step", value="6"), "largest_step is '6'; needed is a number above 0"),
        (_changed("columns", "time", "rate", value="1 kHz"), "columns.time has a column and a rate"),
        (_changed("columns", "length", "of", value="sarcomeres"), "allowed: fibre, half_sarcomere, sarcomere"),
        (_changed("columns", "trial", value={"name": "run"}), "unknown columns.trial.name"),
        (_changed("decimal", value="dot"), "decimal is 'dot'; allowed: point, comma"),
        (_changed("trial", value=""), "trial is missing; give a name, or leave it out"),
        (_changed("phases", value={"give": "1 mm"}), "unknown phases.give; did you mean 'servo_give'"),
        (_changed("phases", value={"servo_give": "1 L0"}), "phases.servo_give has to be a length"),
        (_changed("columns", "stimulation", value={"column": "s", "unit": "V"}), "needs activation"),
        (_changed("columns", "stimulation", value={"column": "s", "unit": "N"}), "'N' is no unit of stimulation"),
        (_changed("activation", value={"rest": "0.05 uM"}), "activation: tetanus is missing; give a value"),
        (_changed("activation", value=ACTIVATION), "neither tells when there is stimulation"),
        (_changed("activation", value={**ACTIVATION, "rise": "5 uM"}), "'uM' is no unit of time"),
        (_changed("activation", value={**ACTIVATION, "rest": "9 uM"}), "here: activation: rest is 9 µM"),
        (_changed("activation", value={**ACTIVATION, "end": "2 s"}), "activation.end needs activation.begin"),
        (_changed("activation", value={**ACTIVATION, "begin": "1 s"}), "activation.end is missing"),
        (_changed("activation", value={**ACTIVATION, "begin": "2 s", "end": "1 s"}), "goes from 2 to 1 s"),
        (_changed("activation", value={**ACTIVATION, "begin": "never"}), "so a calcium column and pCa have no use"),
    ],
)
def test_a_bad_tree_is_refused_with_a_remedy(tree: dict[str, Any], words: str) -> None:
    with pytest.raises(UserError) as refused:
        build_mapping(tree, "here")
    assert words in str(refused.value)
    assert "here" in str(refused.value)


def test_activation_takes_pca_and_times() -> None:
    tree = _changed("file_name")
    told = {**ACTIVATION, "begin": "1 s", "end": "force_drop", "source": "made\n  up"}
    made = build_mapping({**tree, "activation": told}, "here").activation
    assert made is not None
    assert made.transient == CalciumTransient(0.05, 10.0 ** (6.0 - 5.1), 0.05, 0.03)
    assert (made.source, made.begin_s, made.end_s) == ("made up", 1.0, None)
    never = build_mapping({**tree, "activation": {**ACTIVATION, "begin": "never"}}, "here").activation
    assert never is not None
    assert never.begin_s == math.inf


def test_names_may_come_from_file_and_folder() -> None:
    made = build_mapping({**TREE, "fibre": "{folder}", "trial": "{folder}_{file}"}, "here")
    file = Path("somewhere/rat7/cell_pca61.csv")
    names = [filled(name, file) for name in (made.fibre, made.trial, made.data_set)]
    assert names == ["rat7", "rat7_cell_pca61", "rat7"]


def test_signals_of_a_bag_are_topics() -> None:
    columns = {"length": {"topic": "/l", "field": "position[0]", "unit": "mm"}, "time": {"stamp": "log"}}
    made = build_mapping({"fibre": "f", "pca": 6.1, "columns": columns}, "here", BAG)
    assert made.length[:2] == ("/l", "mm")
    assert made.length.field == "position[0]"
    assert made.time.name == "log"
    for change, words in (
        ({"length": {"topic": "/l", "unit": "mm"}}, "field is missing; name the field of /l"),
        ({"length": {"column": "l", "unit": "mm"}}, "unknown columns.length.column"),
        ({"time": {"stamp": "sent"}}, "columns.time.stamp is 'sent'; allowed: header, log"),
    ):
        with pytest.raises(UserError, match=words):
            build_mapping({"fibre": "f", "columns": {**columns, **change}}, "here", BAG)


@pytest.mark.parametrize(
    ("text", "words"), [("a: [", "malformed YAML"), ("- a\n- b\n", "needed are keys"), ("", "needed are keys")]
)
def test_a_file_that_is_no_mapping_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(UserError, match=words) as refused:
        load_mapping(tmp_path / "m.yaml")
    assert "m.yaml" in str(refused.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no\.yaml cannot be read"):
        load_mapping(tmp_path / "no.yaml")


def test_the_example_of_the_documentation_is_a_mapping(repo_root: Path, tmp_path: Path) -> None:
    text = (repo_root / "docs" / "bags.md").read_text(encoding="utf-8")
    (tmp_path / "m.yaml").write_text(text.split("```yaml\n", 1)[1].split("```", 1)[0])
    made = build_mapping(load_mapping(tmp_path / "m.yaml"), "docs")
    assert made.facts_of(Path("amp383_rt1ms_pca61.csv")) == {"pca": 6.1, "amplitude_l0": 0.0383, "recovery_s": 0.001}


def test_the_isometric_fractions_are_those_of_the_data(repo_root: Path, shared_data: Path) -> None:
    table = json.loads((shared_data / "empirical_srs.json").read_text())
    cells = table["fibres"]["18Dec2017a"]["isometric_force"]
    for name in ("rat_soleus_18Dec2017a.yaml", "rat_soleus_18Dec2017a_triangles.yaml"):
        path = repo_root / "scripts" / "datasets" / name
        made = build_mapping(load_mapping(path), str(path))
        assert sorted(made.isometric_fractions) == table["pCa"]
        for pca, recoveries in zip(table["pCa"], cells, strict=True):
            values = [value for row in recoveries for value in row if value is not None]
            assert made.isometric_fractions[pca] == pytest.approx(sum(values) / len(values), abs=1e-6)
