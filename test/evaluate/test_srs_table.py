"""Tables of SRS: read, refused, averaged by hand."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable, read_table, read_tables, table_of
from xb_muscle_ros.scores.conditions import CLASSES

LOW = CLASSES.index("low")


def tree() -> dict[str, Any]:
    """One fibre, two pCa of low activation, recovery 1 ms and 0.1 s, amplitude 0 and 3.83 % L0."""
    return {
        "pCa": [6.3, 6.4],
        "recovery_s": [0.001, 0.1],
        "amplitude_L0": [0.0, 0.0383],
        "fibres": {
            "f": {
                "srs_test": [[[20.0, 10.0], [None, 15.0]], [[4.0, 1.0], [None, None]]],
                "srs_conditioning": [[[None, 30.0], [None, 34.0]], [[None, 8.0], [None, None]]],
                "isometric_force": [[[None, 0.2], [None, 0.22]], [[None, 0.1], [None, None]]],
            }
        },
    }


@pytest.fixture
def table() -> SrsTable:
    return table_of(tree(), "measured", "made")


def test_nulls_are_unknown(table: SrsTable) -> None:
    assert np.isnan(table.fibres["f"].test[0, 1, 0])
    assert table.isometric_f0("f") == pytest.approx([0.21, 0.1])


def test_unconditioned_stretches(table: SrsTable) -> None:
    assert table.unconditioned("f", "reference")[0].tolist() == [20.0, 4.0]
    assert table.unconditioned("f", "conditioning")[0].tolist() == [32.0, 8.0]


def test_the_reference_of_the_shortest_recovery_counts() -> None:
    made = tree()
    made["fibres"]["f"]["srs_test"][0] = [[None, 10.0], [25.0, 15.0]]
    made["fibres"]["f"]["srs_test"][1] = [[4.0, 1.0], [9.0, None]]
    assert table_of(made, "m", "made").unconditioned("f", "reference")[0].tolist() == [25.0, 4.0]


def test_relative_srs_by_hand(table: SrsTable) -> None:
    found = table.relative("mean", "reference").centre[LOW]
    # At 1 ms both pCa count, (10 + 1)/(20 + 4); at 0.1 s the first alone.
    assert found[0, 1] == pytest.approx(11.0 / 24.0)
    assert found[1, 1] == pytest.approx(15.0 / 20.0)
    assert found[0, 0] == pytest.approx(1.0)
    assert table.relative("mean_of_trials", "reference").centre[LOW][0, 1] == pytest.approx((0.5 + 0.25) / 2)
    assert table.relative("mean", "conditioning").centre[LOW][0, 1] == pytest.approx(11.0 / 40.0)


def test_classes_may_come_from_another_table(table: SrsTable) -> None:
    other = tree()
    other["pCa"] = [6.4, 6.2]
    other["fibres"]["f"]["isometric_force"] = [[[None, 0.5], [None, None]], [[None, 0.9], [None, None]]]
    by = table_of(other, "m", "made")
    assert table.classes("f").tolist() == [LOW, LOW]
    # pCa 6.3 is not in the other table; 6.4 is intermediate there.
    assert table.classes("f", by).tolist() == [-1, CLASSES.index("intermediate")]
    assert table.classes("f", by.only(["g"])).tolist() == [-1, -1]


def test_conditions_are_picked_by_their_nominal_values(table: SrsTable) -> None:
    picked = table.at_conditions(table.fibres["f"].test)[0]
    assert np.flatnonzero(np.isfinite(picked)).tolist() == [0, 16, 17]
    assert picked[[0, 16, 17]].tolist() == [20.0, 10.0, 15.0]


Change = Callable[[dict[str, Any]], object]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.pop("pCa"), "axis 'pCa' is missing"),
        (lambda t: t.update(pCa=["a", 6.4]), "axis 'pCa' is missing or not a list of numbers"),
        (lambda t: t.update(amplitude_L0=[0.0, 3.83]), "amplitude_L0 3.83 is outside 0 to 0.5 L0; amplitudes are frac"),
        (lambda t: t.update(recovery_s=[1.0, 10000.0]), "recovery_s 10000 is outside 0 to 1000 s; recovery times are"),
        (lambda t: t.update(pCa=[6.3e-7, 6.4]), "pCa 6.3e-07 is outside 3 to 12; pCa is -log10"),
        (lambda t: t.update(pCa=[6.3, 6.3]), "pCa 6.3 comes twice"),
        (lambda t: t.update(fibres={}), "'fibres' is missing or empty"),
        (lambda t: t["fibres"].update(f=3), "fibre f is 3"),
        (lambda t: t["fibres"]["f"].pop("srs_test"), "fibre f has no 'srs_test'"),
        (lambda t: t["fibres"]["f"]["srs_test"].pop(), "srs_test holds 1 values; needed are 2, one for each pCa"),
        (
            lambda t: t["fibres"]["f"]["srs_test"][1][0].append(1.0),
            "srs_test at pCa 6.4, recovery_s 0.001 holds 3 values; needed are 2, one for each amplitude_L0",
        ),
        (
            lambda t: t["fibres"]["f"]["srs_test"][1][0].__setitem__(1, float("nan")),
            "srs_test at pCa 6.4, recovery_s 0.001, amplitude_L0 0.0383 is nan; allowed are finite numbers",
        ),
        (lambda t: t["fibres"]["f"]["srs_test"][1].__setitem__(0, None), "at pCa 6.4, recovery_s 0.001 holds None"),
        (
            lambda t: t["fibres"]["f"]["isometric_force"][0][0].__setitem__(1, 97.0),
            "isometric_force at pCa 6.3, recovery_s 0.001, amplitude_L0 0.0383 is 97; allowed is up to 10 F0: check",
        ),
    ],
)
def test_faults_are_told_in_one_line(change: Change, words: str) -> None:
    made = copy.deepcopy(tree())
    change(made)
    with pytest.raises(UserError) as refused:
        table_of(made, "m", "made.json")
    assert str(refused.value).startswith("made.json")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [("{", "is not valid JSON"), ("[]", "holds list"), ('{"a": 1}', "axis 'pCa' is missing")],
)
def test_files_that_hold_no_table(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "t.json"
    path.write_text(text)
    with pytest.raises(UserError, match=words):
        read_table(path, "m")
    with pytest.raises(UserError, match="cannot be read"):
        read_table(tmp_path / "absent.json", "m")


def test_several_tables_in_one_file(tmp_path: Path) -> None:
    path = tmp_path / "t.json"
    path.write_text(json.dumps({"a": tree(), "note": "x"}))
    assert list(read_tables(path, "m")) == ["a"]
    path.write_text(json.dumps({"note": "x"}))
    with pytest.raises(UserError, match="holds no table"):
        read_tables(path, "m")


def test_relative_srs_within_their_errors_are_left_out_and_counted() -> None:
    """A stretch whose own SRS is small stays: means of those that happen to be large would come out too high."""
    test = np.array([[[20.0, 0.1]], [[0.3, 0.5]], [[20.0, 18.0]]])
    error = np.array([[[1.0, 1.0]], [[0.4, 0.4]], [[1.0, 30.0]]])
    isometric = np.full(test.shape, 0.5)
    fibre = FibreSrs(test, np.full(test.shape, np.nan), isometric, error, np.full(test.shape, np.nan))
    axes = np.array([6.1, 6.2, 6.3]), np.array([0.001]), np.array([0.0, 0.0383])
    table = SrsTable("measured", *axes, {"f": fibre})
    # pCa 6.2: the reference is within its error; pCa 6.3: the test stretch has an error of more than the reference.
    assert table.sound("f", "reference")[:, 0, 1].tolist() == [True, False, False]
    assert table.left_out("reference") == (3, 6)
    level = CLASSES.index("intermediate")
    assert table.pooled("reference")["f"].test[level, 0, 1] == pytest.approx(0.1)
    # The same without errors, as simulated SRS and tables have none, uses all.
    bare = SrsTable("simulated", *axes, {"f": FibreSrs(test, fibre.conditioning, isometric)})
    assert bare.left_out("reference") == (0, 6)
