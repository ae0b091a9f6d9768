"""Our numbers beside the paper's, on made tables whose numbers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.evaluate.paper import REPORTED, Reported, Source, compare, computed, readings_table
from xb_muscle_ros.evaluate.sets import gather
from xb_muscle_ros.evaluate.srs_scores import (
    ALL_READINGS,
    RELEASED,
    TEXT,
    AicReference,
    profile_masks,
    profile_rmsd,
    relative_aic,
    rows,
    score,
)
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable
from xb_muscle_ros.scores.conditions import AMPLITUDES_L0, CONDITIONS, RECOVERIES_S
from xb_muscle_ros.trials.trial import Array

PCA = np.array([4.5, 6.1, 6.3, 9.0])
FORCE = np.array([1.0, 0.5, 0.2, 0.01])
AMPLITUDES = np.array([0.0, *AMPLITUDES_L0])
INF = float("inf")


def table(relative: float | Array, fibres: tuple[str, ...] = ("a", "b")) -> SrsTable:
    """Fibres with one pCa in each class: SRS is 40 F, and that times a factor after a conditioning stretch."""
    shape = (PCA.size, len(RECOVERIES_S), AMPLITUDES.size)
    unconditioned = np.broadcast_to(40.0 * FORCE[:, None, None], shape)
    test = np.where(AMPLITUDES == 0.0, 1.0, relative) * unconditioned
    isometric = np.broadcast_to(FORCE[:, None, None], shape)
    one = FibreSrs(test, unconditioned.copy(), isometric.copy())
    return SrsTable("made", PCA, np.array(RECOVERIES_S), AMPLITUDES, dict.fromkeys(fibres, one))


DATA = table(0.8)


def test_rmsd_of_a_constant_difference() -> None:
    found = score(table(1.0), DATA, TEXT, 7)
    # Every condition but the four references is off by 0.2.
    assert found.rmsd["large"] == pytest.approx(0.2)
    assert found.rmsd["small"] == pytest.approx(0.2 * np.sqrt(74 / 78))
    assert found.rmsd["all"] == pytest.approx(0.2 * np.sqrt(80 / 84))
    assert found.conditions == {"large": 6, "small": 78, "all": 84}
    assert found.aic == pytest.approx(14.0 + 84.0 * np.log(80 * 0.04 / 84))


@pytest.mark.parametrize("reading", ALL_READINGS)
def test_readings_agree_where_nothing_is_in_doubt(reading: tuple[str, ...]) -> None:
    found = score(table(1.0), DATA, reading, 7)
    assert found.rmsd["large"] == pytest.approx(0.2)
    assert found.rmsd["all"] == pytest.approx(0.2 * np.sqrt(80 / 84))
    assert found.conditions["large"] == (6 if reading[3] == "text" else 12)


def test_readings_differ_in_the_class_of_a_model_that_is_too_strong() -> None:
    strong = table(1.0)
    for fibre in strong.fibres.values():
        fibre.isometric[1:] += 0.3
    own, measured = (score(strong, DATA, TEXT._replace(classes=c), 7) for c in ("own", "measured"))
    assert measured.conditions["all"] == 84
    # Its own force makes it high at two pCa and intermediate at the two others: half the conditions are gone.
    assert own.conditions["all"] == 42


def test_profiles_have_the_papers_points() -> None:
    masks = profile_masks()
    assert {name: int(mask.sum()) for name, mask in masks.items()} == {"activation": 4, "amplitude": 4, "recovery": 5}
    amplitudes = [CONDITIONS[k].amplitude_l0 for _, k in np.argwhere(masks["amplitude"]).tolist()]
    assert amplitudes == list(AMPLITUDES_L0)
    assert profile_rmsd(table(1.0), DATA, RELEASED) == pytest.approx(dict.fromkeys(masks, 0.2))


def test_aic_is_relative_where_conditions_are_the_same() -> None:
    scores = {"hill_se": score(table(1.0), DATA, TEXT, 7), "2state": score(table(0.9), DATA, TEXT, 10)}
    shown = relative_aic(scores, AicReference("hill_se", ""))
    assert shown["hill_se"] == 0.0
    assert shown["2state"] == pytest.approx(2 * 3 + 84 * np.log(0.01 / 0.04))
    assert relative_aic(scores, AicReference(None, ""))["2state"] == scores["2state"].aic
    fewer = {**scores, "2state": replace(scores["2state"], conditions={"large": 6, "small": 77, "all": 83})}
    assert relative_aic(fewer, AicReference("hill_se", ""))["2state"] is None


def test_rows_say_what_each_condition_is() -> None:
    found = list(rows(DATA, TEXT, None))
    assert len(found) == 84
    assert sum(row["reduction"] == "large" for row in found) == 6
    chosen = [row for row in found if row["activation"] == "low" and row["amplitude_l0"] == 0.0383]
    assert chosen[0]["relative_srs"] == pytest.approx(0.8)
    assert (chosen[0]["fibres"], chosen[0]["sd"]) == (2, pytest.approx(0.0, abs=1e-12))


@pytest.mark.parametrize(
    ("quantity", "expected"),
    [("srs_rmsd.large", 0.1), ("profile.recovery", 0.1), ("reduction.mean", 0.3), ("k_tr", 4.0)],
)
def test_numbers_in_the_papers_place(quantity: str, expected: float) -> None:
    source = Source("ours", {"3state_coop": table(0.7)}, {"3state_coop": [3.0, 5.0]})
    row = Reported(quantity, "3state_coop", 0.0, 0.0, "")
    assert computed(row, source, DATA, TEXT) == pytest.approx(expected)
    assert computed(row._replace(model="hill"), source, DATA, TEXT) is None


@pytest.mark.parametrize(
    ("lower", "upper", "agrees"),
    [(0.105, 0.105, True), (0.12, 0.12, False), (0.11, 0.2, True), (0.2, INF, False), (-INF, 0.11, True)],
)
def test_agreement_with_values_ranges_and_bounds(lower: float, upper: float, agrees: bool) -> None:
    source = Source("ours", {"3state_coop": table(0.7)}, {})
    models = gather(["18Dec2017a"], ["3state_coop"], None)
    reported = Reported("srs_rmsd.large", "3state_coop", lower, upper, "made up")
    (entry,) = compare([source], DATA, models, [reported])
    assert entry.agrees["ours"]["text"] is agrees
    assert ("not reproduced" in entry.remark) is not agrees


def test_what_cannot_be_had_is_said() -> None:
    models = gather(["18Dec2017a"], ["hill", "3state_coop"], None)
    source = Source("ours", {"hill": table(1.0), "3state_coop": table(0.8)}, {})
    by = {(e.quantity, e.model): e for e in compare([source], DATA, models)}
    assert "set borrowed from hill_se" in by["srs_rmsd.large", "hill"].remark
    assert by["srs_rmsd.small", "2state_coop"].remark == "no parameter set released for this model"
    assert by["srs_rmsd.small", "2state_coop"].agrees == {"ours": {"text": None, "released": None}}
    assert "does not redevelop" in by["k_tr", "3state_coop"].remark


def test_the_papers_numbers_are_written_as_it_has_them() -> None:
    texts = {(row.quantity, row.model): row.text for row in REPORTED}
    assert texts["srs_rmsd.large", "hill_se"] == "0.312"
    assert texts["srs_rmsd.all", "4state_coop"] == "0.103 to 0.104"
    assert texts["profile.recovery", "3state_coop"] == "<= 0.1"
    assert texts["profile.recovery", "2state"] == "> 0.15"


def test_all_readings_are_listed() -> None:
    models = gather(["18Dec2017a"], ["3state_coop"], None)
    found = readings_table([Source("ours", {"3state_coop": table(1.0)}, {})], DATA, models, ALL_READINGS)
    assert len(found) == len(ALL_READINGS) == 32
    assert found[0].scores.rmsd["large"] == pytest.approx(0.2)
