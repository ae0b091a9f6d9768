"""A new fibre file: valid, commented, without invented values, and never half written."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import xb_muscle_ros as xb
from xb_muscle_ros.cli.main import main
from xb_muscle_ros.mechanisms.extras.temperature import RATES
from xb_muscle_ros.models.fibre_making import middle_fibre


@pytest.mark.parametrize("command", ["fibre", "fiber"])
def test_what_is_known_is_in_the_file_and_the_rest_as_published(
    tmp_path: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    known = ["--f0", "0.5mN", "--length", "1.2mm", "--area", "0.004mm2", "--species", "mouse", "--temperature", "15"]
    assert main([command, "new", "mine", "--like", "18Dec2017a", "--out", str(tmp_path), *known]) == 0
    fibre, published = xb.load_fibre(tmp_path / "mine.yaml"), xb.load_fibre("18Dec2017a")
    assert (fibre.name, fibre.f0_n, fibre.reference_length_m) == ("mine", 0.5e-3, 1.2e-3)
    assert dict(fibre.values) == dict(published.values)
    assert fibre.available_models == published.available_models
    text, told = (tmp_path / "mine.yaml").read_text(encoding="utf-8"), capsys.readouterr().out
    for line in ("No published set of the package fits species mouse", "no Q10 was given", "F0 is 125 kPa"):
        assert line in text
        assert line in told


def test_rates_are_scaled_by_the_q10_that_is_given_and_nothing_else_is(tmp_path: Path) -> None:
    file = xb.new_fibre("cold", tmp_path, like="18Dec2017a", temperature=12.0, q10=2.0, tell=[].append)
    fibre, published = xb.load_fibre(file), xb.load_fibre("18Dec2017a")
    for name, value in published.values.items():
        assert fibre.values[name] == pytest.approx(0.5 * value if name in RATES else value, rel=1e-12), name
    assert "  # 79.0573 at 22 °C" in file.read_text(encoding="utf-8")


def test_without_a_fibre_to_start_from_one_in_the_middle_is_taken_and_said(tmp_path: Path) -> None:
    lines: list[str] = []
    xb.new_fibre("mine", tmp_path, tell=lines.append)
    assert any(f"fibre {middle_fibre()} " in line and "nearest to the median" in line for line in lines)
    assert any("F0 is not given" in line for line in lines)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["mine", "--f0", "0.5 mm"], "--f0"),
        (["mine", "--length", "1.2 km"], "--length"),
        (["mine", "--area", "3 mm"], "--area"),
        (["mine", "--like", "18Dec2017"], "did you mean '18Dec2017"),
        (["mine", "--model", "5state"], "5state"),
        (["mine", "--q10", "2"], "--temperature"),
        (["mine", "--temperature", "295"], "0 to 45"),
        (["18Dec2017a"], "another name"),
        (["../mine"], "allowed are letters"),
    ],
)
def test_what_is_wrong_is_told_and_nothing_is_written(
    tmp_path: Path, arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fibre", "new", *arguments, "--out", str(tmp_path)]) == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_there_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.yaml").write_text("mine")
    assert main(["fibre", "new", "mine", "--out", str(tmp_path)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert (tmp_path / "mine.yaml").read_text() == "mine"


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    f0_n=st.floats(1e-6, 1e2),
    length_m=st.floats(1e-5, 0.7),
    temperature=st.floats(5.0, 37.0),
    q10=st.floats(1.0, 3.0),
    species=st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs", "Zl", "Zp"]), min_size=1, max_size=9),
)
def test_whatever_is_known_the_file_loads(
    tmp_path: Path, f0_n: float, length_m: float, temperature: float, q10: float, species: str
) -> None:
    file = xb.new_fibre(
        "mine", tmp_path, like="18Dec2017a", f0=f0_n, length=length_m, temperature=temperature, q10=q10,
        species=species, overwrite=True, tell=[].append,
    )  # fmt: skip
    fibre = xb.load_fibre(file)
    assert (fibre.f0_n, fibre.reference_length_m) == (f0_n, length_m)


def test_amounts_are_the_numbers_that_were_written(tmp_path: Path) -> None:
    file = xb.new_fibre("mine", tmp_path, length="1.05 mm", f0="0.55mN", tell=lambda line: None)
    assert (xb.load_fibre(file).reference_length_m, xb.load_fibre(file).f0_n) == (0.00105, 0.00055)
