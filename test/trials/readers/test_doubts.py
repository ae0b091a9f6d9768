"""Units that make no likely muscle get one line; units that fit get none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.csv import read_csv
from xb_muscle_ros.trials.readers.mapping import build_mapping

N = 300
TIME_S = np.arange(N) / 1000
STRAIN = np.interp(TIME_S, [0.1, 0.18], [0.0, 0.04])
FORCE = 0.4 + 5.0 * STRAIN


def warnings(tmp_path: Path, columns: dict[str, tuple[Any, str]], **keys: Any) -> tuple[str, ...]:
    """Warnings of a record whose columns are given as values and unit."""
    made = {"time": (TIME_S, "s"), "length": (1.2 * (1.0 + STRAIN), "mm"), "force": (FORCE, "mN"), **columns}
    values = [np.asarray(each).tolist() for each, _ in made.values()]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([",".join(made), *(",".join(map(str, row)) for row in zip(*values, strict=True))]))
    told = {name: {"column": name, "unit": unit, **keys.pop(name, {})} for name, (_, unit) in made.items()}
    tree = {"fibre": "f", "pca": 6.1, "f0": "1 mN", "columns": told, **keys}
    mapping = build_mapping({key: value for key, value in tree.items() if value is not None}, "here")
    return read_csv(path, mapping).warnings


def test_a_fibre_as_it_should_be_gets_none(tmp_path: Path) -> None:
    assert warnings(tmp_path, {}) == ()


@pytest.mark.parametrize(
    ("columns", "keys", "words"),
    [
        ({"force": (FORCE, "N")}, {"f0": "1 N"}, "F0 = 1 N takes a cross-section 2.06 mm wide even at 300 kPa"),
        ({"force": (FORCE, "N")}, {"f0": "1 N"}, "is N the unit of force and f0"),
        ({"force": (FORCE, "nN")}, {"f0": "1 nN"}, "thinner than a myofibril; is nN the unit"),
        (
            {"length": (40 * (1 + STRAIN), "um"), "force": (FORCE, "uN")},
            {"f0": "1 uN"},
            "L0 is 4e-05 m; usual is 5e-05 to 1 m; is um its unit?",
        ),
        ({"force": (1.5 * FORCE, "MPa")}, {"f0": "1.5 MPa"}, "F0 is 1.5e+06 Pa; usual is 1000 to 1e+06 Pa"),
        ({"time": (100 * TIME_S, "s")}, {}, "samples are 0.1 s apart (10 Hz)"),
        ({"time": (10 * TIME_S, "ms")}, {}, "samples are 1e-05 s apart (1e+05 Hz)"),
        ({"calcium": (np.full(N, 1e-6), "uM")}, {"pca": None}, "calcium goes up to 1e-06 µM (pCa 12)"),
        ({"calcium": (np.full(N, 3e3), "uM")}, {"pca": None}, "usual is pCa 3 to 10; is uM its unit?"),
        ({}, {"reference_length": "3 mm"}, "the median length is 0.41"),
        ({"force": (-FORCE, "mN")}, {}, "is its sign reversed"),
        ({"force": (10 * FORCE, "mN")}, {}, "are f0 and the unit of force (mN) right?"),
        ({"force": (FORCE / 1000, "mN")}, {"pca": 4.5}, "the largest force is 0.0006 F0 at pCa 4.5"),
    ],
)
def test_what_is_doubtful_is_told_in_one_line(
    tmp_path: Path, columns: dict[str, tuple[Any, str]], keys: dict[str, Any], words: str
) -> None:
    (told,) = warnings(tmp_path, columns, **keys)
    assert words in told


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("length", 1.5, "line 52, column 'length': a single sample is at 1.25 L0 between 1 and 1 L0"),
        ("force", 4.0, "line 52, column 'force': a single sample is at 4 F0 between 0.4 and 0.4 F0"),
    ],
)
def test_a_single_sample_far_off_is_named(tmp_path: Path, name: str, value: float, words: str) -> None:
    values = {"length": 1.2 * (1.0 + STRAIN), "force": FORCE.copy()}[name]
    values[50] = value
    told = warnings(tmp_path, {name: (values, {"length": "mm", "force": "mN"}[name])}, reference_length="1.2 mm")
    assert any(words in warning for warning in told), told


def test_a_column_called_pca_is_hardly_a_concentration(tmp_path: Path) -> None:
    rows = zip(TIME_S.tolist(), (1.2 * (1.0 + STRAIN)).tolist(), strict=True)
    (tmp_path / "a.csv").write_text("\n".join(["t,l,pCa", *(f"{t},{length},6.1" for t, length in rows)]))
    columns = {
        "time": {"column": "t", "unit": "s"},
        "length": {"column": "l", "unit": "mm"},
        "calcium": {"column": "pCa", "unit": "uM"},
    }
    (told,) = read_csv(tmp_path / "a.csv", build_mapping({"fibre": "f", "columns": columns}, "here")).warnings
    assert "column 'pCa' is read in uM but called pCa; is pCa its unit?" in told


@pytest.mark.parametrize(
    ("l0", "f0"),
    [("13.7 mm", "15.5 N"), ("42.8 mm", "36 N"), ("44 mm", "6200 N"), ("5.5 mm", "0.35 N"), ("2 mm", "2 mN")],
    ids=["rat gastrocnemius", "cat soleus", "human soleus", "mouse EDL", "trabecula"],
)
def test_muscles_of_every_size_get_none(tmp_path: Path, l0: str, f0: str) -> None:
    (length, length_unit), (force, unit) = l0.split(), f0.split()
    columns = {"length": (float(length) * (1 + STRAIN), length_unit), "force": (float(force) * FORCE, unit)}
    assert warnings(tmp_path, columns, f0=f0) == ()


@pytest.mark.parametrize(
    ("of", "um", "words"),
    [
        ("sarcomere", 2.4, ""),
        ("half_sarcomere", 1.2, ""),
        (
            "half_sarcomere",
            2.4,
            "a half-sarcomere has 0.8 to 1.9 µm; it fits a sarcomere: is it --length-of sarcomere?",
        ),
        (
            "sarcomere",
            1.2,
            "a sarcomere has 1.6 to 3.8 µm; it fits a half-sarcomere: is it --length-of half_sarcomere?",
        ),
        ("sarcomere", 5.0, "a sarcomere has 1.6 to 3.8 µm; is um its unit?"),
    ],
)
def test_sarcomeres_and_halves_of_them(tmp_path: Path, of: str, um: float, words: str) -> None:
    told = warnings(tmp_path, {"length": (um * (1 + STRAIN), "um")}, length={"of": of})
    assert len(told) == bool(words)
    assert not words or words in told[0]


def test_a_sarcomere_taken_for_a_fibre_is_refused_with_the_option(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"L0 is 2\.4e-06 m; .* give --length-of sarcomere, or the right unit"):
        warnings(tmp_path, {"length": (2.4 * (1 + STRAIN), "um")})


def test_concentrations_in_a_column_of_pca_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is pCa 30; allowed is 2 to 12; is it a concentration"):
        warnings(tmp_path, {"calcium": (np.full(N, 30.0), "pCa")}, pca=None)


def test_the_largest_gap_counts_not_the_median_step(tmp_path: Path) -> None:
    kept = np.r_[0:50, 80:N]
    columns = {"time": (TIME_S[kept], "s"), "length": (1.2 + 0 * kept, "mm"), "force": (FORCE[kept], "mN")}
    (told,) = warnings(tmp_path, columns)
    assert "column 'time': samples are missing from 0.049 to 0.08 s" in told
    assert warnings(tmp_path, columns, time={"largest_step": "40 ms"}) == ()
    with pytest.raises(
        UserError, match=r"line 52, .* missing from 0\.049 to 0\.08 s \(0\.031 s\); allowed are 0\.02 s"
    ):
        warnings(tmp_path, columns, time={"largest_step": "20 ms"})


def test_samples_taken_more_and_more_slowly_have_no_gap(tmp_path: Path) -> None:
    time_s = np.concatenate([TIME_S[:100], 0.1 + np.cumsum(np.geomspace(0.001, 0.04, 200))])
    assert warnings(tmp_path, {"time": (time_s, "s"), "length": (np.full(N, 1.2), "mm")}) == ()


def test_a_rate_stands_for_a_column_of_time(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("\n".join(["l", *(repr(float(s)) for s in 1 + STRAIN)]))
    columns: dict[str, Any] = {"time": {"rate": "2 kHz"}, "length": {"column": "l", "unit": "L0"}}
    trial = read_csv(tmp_path / "a.csv", build_mapping({"fibre": "f", "pca": 6, "columns": columns}, "here"))
    assert trial.time_s == pytest.approx(np.arange(N) / 2000)
    columns["time"]["column"] = "t"
    with pytest.raises(UserError, match=r"columns\.time has a column and a rate"):
        build_mapping({"fibre": "f", "pca": 6, "columns": columns}, "here")


def test_a_rounded_column_of_time_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"line 3, .*0 s comes again, as 269 times do; .*--rate"):
        warnings(tmp_path, {"time": (np.round(TIME_S, 2), "s")})


def test_one_sample_is_no_trial(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="has one sample; a trial needs two"):
        warnings(tmp_path, {name: ([0.5], unit) for name, unit in (("time", "s"), ("length", "mm"), ("force", "mN"))})
