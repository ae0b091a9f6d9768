"""A diagnosis to JSON and back: nothing is lost, nothing is not a number, and what does not fit is named."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from generated_diagnoses import diagnoses
from hypothesis import given, settings
from sample_diagnoses import ALL, one_fibre

from xb_muscle_ros.diagnose.component import Component
from xb_muscle_ros.diagnose.report.codec import from_json, to_json
from xb_muscle_ros.diagnose.residual import ResidualMap
from xb_muscle_ros.diagnose.result import FORMAT, Diagnosis, Verdict
from xb_muscle_ros.errors import UserError


@pytest.mark.slow
@settings(max_examples=40)
@given(diagnoses(holes=False))
def test_finite_records_come_back_as_they_were(d: Diagnosis) -> None:
    assert from_json(json.loads(json.dumps(to_json(d), allow_nan=False))) == d


@settings(max_examples=25)
@given(diagnoses())
def test_what_is_not_finite_is_null_and_comes_back_as_nan_or_none(d: Diagnosis) -> None:
    row = json.loads(json.dumps(to_json(d), allow_nan=False))
    again = from_json(row)
    assert to_json(again) == row
    for c, other in zip(d.components, again.components, strict=True):
        assert math.isnan(c.ablation_loss) == math.isnan(other.ablation_loss)


@pytest.mark.parametrize("name", ALL)
def test_keys_are_the_fields(name: str) -> None:
    d = ALL[name]().diagnosis
    row = to_json(d)
    assert list(row) == [f.name for f in dataclasses.fields(Diagnosis)]
    assert row["verdict"] == d.verdict.value
    assert list(row["components"][0]) == [f.name for f in dataclasses.fields(Component)]
    assert from_json(row) == d


def test_numbers_of_numpy_are_numbers() -> None:
    d = one_fibre().diagnosis
    odd = dataclasses.replace(
        d,
        explained_fraction=np.float64(0.25),
        seed=np.int64(3),
        described=np.bool_(True),
        map_before={
            "18Dec2017a": ResidualMap(rms_f0=((np.float64(math.nan), np.float32(0.5)),), counts=((np.bool_(False),),))
        },
    )
    row = json.loads(json.dumps(to_json(odd), allow_nan=False))
    assert (row["explained_fraction"], row["seed"], row["described"]) == (0.25, 3, True)
    table = row["map_before"]["18Dec2017a"]
    assert (table["rms_f0"], table["counts"]) == ([[None, 0.5]], [[False]])


def test_what_has_no_place_in_json_is_an_error_of_the_program() -> None:
    with pytest.raises(TypeError, match="set"):
        to_json(dataclasses.replace(one_fibre().diagnosis, notes=({"a"},)))


def changed(**changes: Any) -> dict[str, Any]:
    return {**to_json(one_fibre().diagnosis), **changes}


def test_fields_with_a_default_may_be_missing_and_further_keys_are_passed_over() -> None:
    row = changed(summary="In words.", glossary={})
    del row["features"], row["notes"]
    d = from_json(row)
    assert d.features == ()
    assert d.verdict is Verdict.PHYSICS


def test_a_file_of_the_former_format_is_read() -> None:
    """`format_2.json`: a quick diagnosis of a made study by the version that wrote format 2, its lists cut short."""
    row = json.loads((Path(__file__).parent / "format_2.json").read_text(encoding="utf-8"))
    assert row["format_version"] == 2
    d = from_json(row)
    assert d.format_version == FORMAT
    assert d.explained_fraction == row["explained_share"]
    assert d.residual.rmsd_f0 == row["remaining"]["rmsd_f0"]
    assert len(d.residual.places) == len(row["remaining"]["where"]) == 2
    assert [c.ablation_loss for c in d.components] == [c["share_of_mismatch"] for c in row["components"]]
    assert [n.value for n in d.nuisance_parameters] == [n["value"] for n in row["nuisances"]]
    assert {t.noise_source for t in d.trials} == {"window"}
    assert d.p_value_floor == 0.0
    assert from_json(to_json(d)) == d
    assert "share" not in json.dumps(to_json(d))


OLD = {"version": 1, "fibre": "18Dec2017a", "verdict": "physics"}


@pytest.mark.parametrize(
    ("row", "told"),
    [
        (OLD, r"older version \(format 1\); run xb_muscle diagnose again"),
        (changed(format_version=4), "format_version is 4, this version reads 2 and 3"),
        ({}, "format_version is None"),
        ([1], "holds a list"),
        (changed(verdict="guess"), "verdict is 'guess'; it has to be one of none, measurement"),
        (changed(seed=1.5), "seed is 1.5; it has to be a whole number"),
        (changed(seed=True), "seed is True"),
        (changed(quick=0), "quick is 0; it has to be true or false"),
        (changed(model=None), "model is None; it has to be text"),
        (changed(explained_fraction="much"), "explained_fraction is 'much'; it has to be a number"),
        (changed(explained_fraction=False), "explained_fraction is False"),
        (changed(fibres="18Dec2017a"), "fibres is '18Dec2017a'; it has to be a list"),
        (changed(trials=[[]]), r"trials\[0\] is \[\]; it has to be an object"),
        (changed(map_before=[]), "map_before is .*an object"),
        (changed(components=[{"name": "x"}]), r"components\[0\]: kind is missing"),
    ],
)
def test_what_does_not_fit_is_told_in_one_line(row: Any, told: str) -> None:
    with pytest.raises(UserError, match=told) as caught:
        from_json(row, "x/diagnosis.json")
    assert str(caught.value).startswith("x/diagnosis.json")
    assert "\n" not in str(caught.value)


def test_a_pair_has_two_ends() -> None:
    row = changed()
    row["components"][0]["parameters"][0]["interval"] = [1.0]
    with pytest.raises(UserError, match=r"interval is \[1.0\]; it has to be a list of 2"):
        from_json(row)
